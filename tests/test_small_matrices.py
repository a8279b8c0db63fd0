"""Sums in place of matrix products, against numpy's."""

import jax.numpy as jnp
import numpy as np
import pytest

from sogjax.model.compiled import applied, product


@pytest.mark.parametrize("shapes", [((7, 4, 4), (7, 4, 4)), ((1, 2, 3), (5, 3, 6)), ((5, 3, 3), (5, 3, 3))])
def test_products_of_batches(shapes):
    a, b = (jnp.asarray(np.random.default_rng(k).normal(size=shape), jnp.float32) for k, shape in enumerate(shapes))
    np.testing.assert_allclose(product(a, b), np.asarray(a) @ np.asarray(b), atol=1e-5)
    np.testing.assert_allclose(applied(a, b[..., 0]), (np.asarray(a) @ np.asarray(b)[..., :1])[..., 0], atol=1e-5)
