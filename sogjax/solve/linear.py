"""Linear algebra that may run in several threads at once.

On a CPU the LAPACK kernels of jaxlib (0.10) take a batch of matrices apart, leave the parts to the pool of threads that
runs all programs, and wait for them in one of its threads. Where all threads of the pool wait so, nobody is left to do
the parts: two programs at once, or one with several solves in it, hang for ever. So matrices go one by one.
"""

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

import jax
import jax.numpy as jnp
from jax.custom_batching import custom_vmap
from jaxtyping import Array, Float

Arguments = ParamSpec("Arguments")
Found = TypeVar("Found")


def one_by_one(function: Callable[Arguments, Found]) -> Callable[Arguments, Found]:
    """The function, of which `vmap` makes a loop on a CPU; elsewhere the batch stays one. Slopes: `jax.jvp` only."""
    single = custom_vmap(function)

    @single.def_vmap
    def batched(size: int, has_batch: list[bool], *given: Any):
        wide = lambda array, has: array if has else jnp.broadcast_to(array, (size, *array.shape))
        every = map(wide, given, has_batch)
        loop = lambda *arrays: jax.lax.map(lambda one: single(*one), arrays)  # which may be in a batch itself
        found = jax.lax.platform_dependent(*every, cpu=loop, default=jax.vmap(function))
        return found, jax.tree.map(lambda _: True, found)

    return cast(Any, single)


@one_by_one
def solve_positive(matrix: Float[Array, "n n"], vector: Float[Array, "n"]) -> Float[Array, "n"]:
    """The x of matrix x = vector, of a symmetric and positive definite matrix; of another it is not finite."""
    return jax.scipy.linalg.cho_solve(jax.scipy.linalg.cho_factor(matrix), vector)


@one_by_one
def eigen(matrix: Float[Array, "n n"]) -> tuple[Float[Array, "n"], Float[Array, "n n"]]:
    """Eigenvalues, ascending, and eigenvectors (columns) of a symmetric matrix."""
    values, vectors = jnp.linalg.eigh(matrix)
    return values, vectors
