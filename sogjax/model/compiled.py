"""What XLA on a CPU compiles badly, written as it compiles well: stages, choices, products of many small matrices.

And programs that run once, which are compiled in a hurry.
"""

from collections.abc import Callable
from functools import reduce
from operator import add
from typing import ParamSpec, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.model.program import compiled

Arguments = ParamSpec("Arguments")
Results = TypeVar("Results")


def compiled_hastily(function: Callable[Arguments, Results]) -> Callable[Arguments, Results]:
    """The function as a program that is compiled without optimisation: for what runs once or twice in a command.

    It is there in a third of the time, and takes up to five times as long to run.
    """
    return compiled(function, xla_backend_optimization_level=0)


def stage_barrier(
    true_at_run_time: Bool[Array, ""],
    function: Callable[Arguments, Results],
    *arguments: Arguments.args,
    **keywords: Arguments.kwargs,
) -> Results:
    """The results of a function, finished before anything that uses them begins; zeros where `true_at_run_time` is not.

    On a CPU, XLA fuses a chain of cheap operations into its last one, which then computes the whole chain again for
    every entry it reads; `optimization_barrier` is gone before that. A branch is not fused: the quad-trees of twelve
    cameras take 2.2 ms in stages instead of 12.

    Args:
        true_at_run_time: a condition that the compiler cannot know: one that always holds when the program runs, such
            as a variance being positive, or whether there is anything to do. A constant would be optimised away
            together with the branch.
        function: the stage.
        arguments: its arrays.
        keywords: what it needs beside them.
    """
    shapes = jax.eval_shape(function, *arguments, **keywords)
    zeros = lambda *_: jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), shapes)
    return jax.lax.cond(true_at_run_time, lambda *a: function(*a, **keywords), zeros, *arguments)


_RUN = 32
"""Entries that are counted together; the ranks within a run come from one small matrix product."""


def chosen_indices(chosen: Bool[Array, "n"], capacity: int) -> tuple[Int[Array, "capacity"], Int[Array, ""]]:
    """Where `chosen` is True, in order, and how often; slots beyond that hold any valid index.

    What `jnp.nonzero` does with a size, four times faster on a CPU: that one counts entry by entry.
    """
    runs = jnp.pad(chosen, (0, -chosen.shape[0] % _RUN)).reshape(-1, _RUN).astype(jnp.float32)
    ranks = jnp.matmul(runs, jnp.asarray(np.triu(np.ones((_RUN, _RUN), np.float32))), precision="highest")
    counts = ranks[:, -1].astype(jnp.int32)
    ends = jnp.cumsum(counts, dtype=jnp.int32)
    wanted = jnp.arange(1, capacity + 1, dtype=jnp.int32)
    # How many runs end before each one: counted where they end, which is quicker than a search for each.
    ended = jnp.zeros(capacity + 1, jnp.int32).at[jnp.minimum(ends, capacity)].add(1, mode="promise_in_bounds")
    run = jnp.minimum(jnp.cumsum(ended[:-1], dtype=jnp.int32), ends.shape[0] - 1)
    wanted_in_run = (wanted - (ends - counts)[run]).astype(jnp.float32)
    index = run * _RUN + jnp.sum(ranks[run] < wanted_in_run[:, None], axis=1, dtype=jnp.int32)
    return jnp.minimum(index, chosen.shape[0] - 1), ends[-1]


def product(a: Float[Array, "*#batch i k"], b: Float[Array, "*#batch k j"]) -> Float[Array, "*batch i j"]:
    """Matrix products of a batch; `k` is small.

    As sums, since XLA on a CPU calls a matrix routine for every pair of a batch, which costs more than the numbers of a
    4x4 matrix: the frames of 61 joints took 124 microseconds so, and take 6 as sums, which become one loop.
    """
    return reduce(add, [a[..., :, k, None] * b[..., k, None, :] for k in range(a.shape[-1])])


def applied(matrix: Float[Array, "*#batch i k"], vector: Float[Array, "*#batch k"]) -> Float[Array, "*batch i"]:
    """Matrices times vectors as sums (see `product`); `k` is small."""
    return reduce(add, [matrix[..., :, k] * vector[..., k, None] for k in range(matrix.shape[-1])])
