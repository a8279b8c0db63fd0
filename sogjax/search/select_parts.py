"""Which parts of the body are taken from which of two passes."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from sogjax.quality.fitted import fitted_numbers
from sogjax.search.body_parts import Part


def stretches(marked: Bool[np.ndarray, "frame"], gap: int = 1) -> list[tuple[int, int]]:
    """First and last frames of the stretches that are marked; gaps of fewer frames than `gap` belong to them."""
    rows = np.flatnonzero(marked)
    parts = np.split(rows, np.flatnonzero(np.diff(rows) > gap) + 1) if len(rows) else []
    return [(int(part[0]), int(part[-1])) for part in parts]


def select_parts(
    parts: Sequence[Part],
    apart: Float[np.ndarray, "frame part"],
    gains: Float[np.ndarray, "frame part"],
    energy: float,
    open_ends: tuple[bool, bool] = (False, False),
) -> Bool[np.ndarray, "frame part"]:
    """Which parts are taken from the other pass, in frames that follow each other; the pass itself holds around them.

    The choice that gains the most energy in sum, less what it costs to change from one pass to the other: the more,
    the farther apart they are there. A limb is looked at only where the trunk that it hangs on is in the same place in
    both passes; else the whole actor is taken, or left.

    Args:
        parts: of the body.
        apart: metres between the passes.
        gains: of taking each part.
        energy: of a frame, for scale.
        open_ends: whether the clip ends before the first and behind the last of the frames.
    """
    costs, taken = fitted_numbers().merge_passes, np.zeros(apart.shape, bool)
    for k, part in enumerate(parts):
        whole = 0.0 if part.whole is None else apart[:, part.whole]
        worth = np.where(whole > costs.apart, 0.0, gains[:, k] / energy) - costs.bias
        found = best_choice(worth, costs.change * apart[:, k], open_ends)
        for first, last in stretches(found):
            stretch = slice(first, last + 1)
            taken[stretch, k] = apart[stretch, k].max() > costs.apart
    return taken


def best_choice(
    worth: Float[np.ndarray, "frame"], change: Float[np.ndarray, "frame"], open_ends: tuple[bool, bool] = (False, False)
) -> Bool[np.ndarray, "frame"]:
    """Where to take the other pass, by dynamic programming: `worth` for each frame, less `change` at both ends.

    At an open end of the frames there is no frame beside, so that no change is made there.
    """
    at_ends = {0: 0.0 if open_ends[0] else change[0], len(worth): 0.0 if open_ends[1] else change[-1]}
    count = len(worth)
    best, chosen = np.array([0.0, -np.inf]), np.zeros((count + 1, 2), int)
    for t in range(count + 1):
        cost = at_ends[t] if t in at_ends else 0.5 * (change[t - 1] + change[t])
        ways = best[:, None] - cost * (1.0 - np.eye(2))
        chosen[t], best = ways.argmax(axis=0), ways.max(axis=0)
        best = best + np.array([0.0, worth[t] if t < count else -np.inf])
    taken, at = np.zeros(count, bool), 0
    for t in range(count, 0, -1):
        at = chosen[t, at]
        taken[t - 1] = at == 1
    return taken
