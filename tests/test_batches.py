"""Rows of a batch: the same one by one and all at once, and shared out among threads without waste."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sogjax.model.batches import ROWS, THREADS, of_each, shared_out


@pytest.mark.parametrize("backend", ["cpu", "gpu"])
@pytest.mark.parametrize("count", [None, 0, 3, ROWS + 3])
def test_rows_give_what_a_batch_gives(monkeypatch, backend, count):
    monkeypatch.setattr(jax, "default_backend", lambda: backend)
    whole, rows = jnp.arange(ROWS + 3), jnp.linspace(0.0, 1.0, 2 * (ROWS + 3)).reshape(-1, 2)
    function = lambda k, row: {"sum": jnp.sum(row), "late": k > 2, "number": k, "row": jnp.sin(row)}
    known = None if count is None else jnp.asarray(count)
    found = jax.jit(lambda *given: of_each(function, *given, count=known))(whole, rows)
    expected = jax.vmap(function)(whole, rows)
    for name, values in expected.items():
        assert (found[name].shape, found[name].dtype) == (values.shape, values.dtype)
        np.testing.assert_allclose(found[name][:count], values[:count], rtol=1e-6)


def test_a_function_is_traced_once_for_all_counts():
    traced = []

    @jax.jit
    def compute(rows, count):
        return of_each(lambda row: traced.append(1) or row * 2.0, rows, count=count)

    for count in (1, 2, 4):
        np.testing.assert_array_equal(compute(jnp.arange(4.0), jnp.asarray(count))[:count], 2.0 * np.arange(count))
    assert len(traced) == 1


@pytest.mark.parametrize("number", [1, 3, 4, 8, 9, 21])
def test_starts_are_shared_out_and_nothing_beyond_their_number_is_read(number):
    counts = []

    def function(count, place, poses):
        assert len(place) == len(poses) == 4
        counts.append(int(count))
        return (jnp.where(jnp.arange(4) < count, place + poses[:, 0], jnp.nan),)

    place = np.arange(number)
    (found,) = shared_out(function, 4, place, 10.0 * place[:, None].astype(np.float32))
    np.testing.assert_array_equal(found, 11.0 * place)
    assert sum(counts) == number
    assert max(counts) - min(counts) <= 1
    assert len(counts) % THREADS == 0 or number == 1
