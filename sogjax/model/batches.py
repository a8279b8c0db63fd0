"""Rows of a batch: one by one on a CPU, several at once elsewhere, and shared out among threads."""

from collections.abc import Callable
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int

from sogjax.model.cores import in_threads

Results = TypeVar("Results")

ROWS = 8
"""Of a batch that are computed at once, where that is quicker: more takes more memory."""
THREADS = 2
"""Calls at the same time: one alone leaves half of two cores idle; each takes memory."""


def of_each(function: Callable[..., Results], *rows: Array, count: Int[Array, ""] | None = None) -> Results:
    """What a function makes of each row; with `count`, of the first so many: what stands for the others is arbitrary.

    On a CPU one after the other: a climb ends by itself, not with the last one of a batch, no row takes a copy of what
    it looks up, and threads share the cores. Elsewhere several at once. `rows` are arrays of one length, not empty.
    """
    if jax.default_backend() != "cpu":
        return jax.lax.map(lambda row: function(*row), rows, batch_size=min(ROWS, len(rows[0])))
    if count is None:
        return jax.lax.map(lambda row: function(*row), rows)
    one = jax.jit(lambda k: function(*(row[k] for row in rows)))  # which is traced once
    shapes = jax.eval_shape(one, count)
    nothing = jax.tree.map(lambda leaf: jnp.zeros((len(rows[0]), *leaf.shape), leaf.dtype), shapes)
    put = lambda k, found: jax.tree.map(lambda every, here: every.at[k].set(here), found, one(k))
    return jax.lax.fori_loop(jnp.zeros_like(count), count, put, nothing)


def shared_out(function: Callable[..., tuple[Array, ...]], room: int, *rows: np.ndarray | Array) -> list[Any]:
    """What a program makes of each row, which is given how many rows mean something, and always `room` rows.

    So one program serves any number of them. They are shared out evenly among threads.
    """
    count = len(rows[0])
    calls = THREADS * -(-count // (THREADS * room))
    parts = np.array_split(np.arange(count), min(calls, count))

    def of_part(some: np.ndarray) -> list[np.ndarray]:
        filled = np.resize(some, room)
        found = jax.device_get(function(jnp.asarray(len(some)), *(row[filled] for row in rows)))
        return [result[: len(some)] for result in found]

    return [np.concatenate(part) for part in zip(*in_threads(of_part, parts, THREADS), strict=True)]
