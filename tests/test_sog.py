"""Padding of Sums of Gaussians."""

import jax.numpy as jnp
import numpy as np
import pytest

from sogjax.model.sog import Sog


def arrays(n, dim=2):
    rng = np.random.default_rng(n)
    return tuple(jnp.asarray(rng.random(shape), jnp.float32) for shape in ((n, dim), (n,), (n, 3)))


@pytest.mark.parametrize("dim", [2, 3])
def test_real_blobs_come_first_and_padding_is_harmless(dim):
    means, sigmas, colors = arrays(5, dim)
    sog = Sog.from_arrays(means, sigmas, colors, capacity=8)
    assert sog.capacity == 8
    assert sog.mask.tolist() == [True] * 5 + [False] * 3
    np.testing.assert_array_equal(sog.means[:5], means)
    np.testing.assert_array_equal(sog.sigmas[:5], sigmas)
    np.testing.assert_array_equal(sog.colors[:5], colors)
    assert (sog.sigmas[5:] > 0.0).all()


def test_without_a_capacity_there_is_no_padding():
    sog = Sog.from_arrays(*arrays(4))
    assert sog.capacity == 4
    assert sog.mask.all()


def test_no_blob_is_cut_off():
    with pytest.raises(ValueError, match="5 blobs do not fit into a capacity of 4"):
        Sog.from_arrays(*arrays(5), capacity=4)
