"""Linear algebra that may run in several threads at once."""

import subprocess
import sys
import textwrap

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sogjax.solve.linear import eigen, solve_positive


def matrices(count, size, seed=0):
    parts = np.random.default_rng(seed).normal(size=(count, size, size)).astype(np.float32)
    return parts @ parts.transpose(0, 2, 1) + size * np.eye(size, dtype=np.float32)


def test_solutions_and_eigenvectors_are_those_of_numpy_in_batches_of_batches():
    every, vectors = matrices(6, 5), np.random.default_rng(1).normal(size=(6, 5)).astype(np.float32)
    np.testing.assert_allclose(solve_positive(every[0], vectors[0]), np.linalg.solve(every[0], vectors[0]), rtol=1e-4)
    several = jax.vmap(jax.vmap(solve_positive))(every.reshape(2, 3, 5, 5), vectors.reshape(2, 3, 5))
    expected = np.linalg.solve(every, vectors[..., None])[..., 0]
    np.testing.assert_allclose(several.reshape(6, 5), expected, rtol=1e-3, atol=1e-5)
    one_vector = jax.vmap(solve_positive, in_axes=(0, None))(every, vectors[0])
    np.testing.assert_allclose(one_vector, np.linalg.solve(every, vectors[0]), rtol=1e-3, atol=1e-5)
    values, directions = jax.vmap(eigen)(every)
    np.testing.assert_allclose(values, np.linalg.eigvalsh(every), rtol=1e-4)
    np.testing.assert_allclose(
        jnp.einsum("nij,nj,nkj->nik", directions, values, directions), every, rtol=1e-3, atol=1e-3
    )


@pytest.mark.parametrize("function", [lambda m: solve_positive(m, m[0]), lambda m: eigen(m)[0]])
def test_no_kernel_gets_a_batch_of_matrices_also_in_batches_of_batches(function):
    every = jnp.asarray(matrices(6, 5).reshape(2, 3, 5, 5))
    text = jax.jit(jax.vmap(jax.vmap(function))).lower(every).as_text()
    calls = [line for line in text.splitlines() if "lapack_s" in line]
    assert calls
    assert all("x5x5x" not in line for line in calls)


def test_forward_slopes_of_a_solution_can_be_asked_for():
    matrix, vector = matrices(1, 4)[0], jnp.arange(4.0)
    slope = jax.jvp(solve_positive, (matrix, vector), (jnp.zeros((4, 4)), jnp.ones(4)))[1]
    np.testing.assert_allclose(slope, np.linalg.solve(matrix, np.ones(4)), rtol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("function", ["solve_positive(m, v)", "eigen(m)[0]"])
def test_programs_with_batches_end_in_two_threads_on_two_cores(function):
    """jaxlib's own batched kernels do not: they wait for the pool's threads in these threads."""
    script = f"""
        import os, sys
        if hasattr(os, "sched_setaffinity"):
            os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:2])
        from concurrent.futures import ThreadPoolExecutor
        import jax, jax.numpy as jnp
        from sogjax.solve.linear import eigen, solve_positive

        @jax.jit
        @jax.vmap
        def program(v):
            def body(k, v):
                matrices = [jnp.eye(64) * (9.0 + j) + v[:, None] * v[None] for j in range(3)]
                v = sum([{function} for m in matrices])
                v += 1e-6 * jnp.sum(jnp.exp(-jnp.abs(v[:, None, None] + v[:, None] + v)), axis=(1, 2))
                return v / jnp.linalg.norm(v)
            return jax.lax.fori_loop(0, 10, body, v)

        starts = jnp.linspace(0.0, 1.0, 32 * 64).reshape(32, 64)
        with ThreadPoolExecutor(2) as pool:
            ends = [*pool.map(lambda _: float(program(starts).sum()), range(4))]
        assert len(set(ends)) == 1
        print("done")
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, timeout=120)
    assert done.stdout == "done\n", done.stderr
