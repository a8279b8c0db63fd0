"""Which of several passes holds in each frame, chosen over time by dynamic programming."""

import numpy as np
from jaxtyping import Float, Int


def best_passes(
    worth: Float[np.ndarray, "frame other"], changes: Float[np.ndarray, "change pass pass"]
) -> tuple[Int[np.ndarray, "frame"], float]:
    """The number of the pass that is taken in each frame, and the sum: what it is worth there, less the changes.

    Pass 0 is the known one, which is worth 0, and holds before the first frame and behind the last.

    Args:
        worth: what each of the others gains; minus infinity where there is no such pass.
        changes: what it costs to go on from one pass (first) with another, before each frame and behind the last.
    """
    count, others = worth.shape
    of_known = np.where(np.arange(1 + others) == 0, 0.0, -np.inf)
    best, came = of_known, np.zeros((count + 1, 1 + others), int)
    for t in range(count + 1):
        ways = best[:, None] - changes[t]
        came[t], best = ways.argmax(axis=0), ways.max(axis=0)
        best = best + (np.concatenate([[0.0], worth[t]]) if t < count else of_known)
    taken, at = np.zeros(count, int), 0
    for t in range(count, 0, -1):
        at = taken[t - 1] = came[t, at]
    return taken, float(best[0])
