"""How sure a mean over a few recordings is: bootstrap over recordings, and over stretches of frames within them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

BLOCK = 10
"""Frames that are drawn together: the errors of neighbouring frames are alike."""
DRAWS = 2000
LEVEL = 0.95


class Interval(NamedTuple):
    """Within which a mean lies; NaN where there is nothing to say it from."""

    low: float
    high: float

    @property
    def holds_zero(self) -> bool:
        """Whether a difference with this interval does not show."""
        return not (self.low > 0.0 or self.high < 0.0)


def bootstrap_interval(
    clips: Sequence[Float[np.ndarray, "_"]],
    *,
    block: int = BLOCK,
    draws: int = DRAWS,
    level: float = LEVEL,
    seed: int = 0,
) -> Interval:
    """Percentile interval of the mean of all frames of all clips (Efron; circular blocks of Politis and Romano).

    Recordings are drawn with replacement, then within each drawn one as many frames as it has, in blocks. NaN is left
    out beforehand. With a single recording only its frames are drawn: the interval says nothing of other recordings.
    """
    present = [values for clip in clips if (values := np.asarray(clip, float)[np.isfinite(clip)]).size]
    if not present:
        return Interval(float("nan"), float("nan"))
    rng = np.random.default_rng(seed)
    count = len(present)
    means = np.stack([_drawn_means(clip, block, draws, count, rng) for clip in present])
    lengths = np.array([len(clip) for clip in present], float)
    drawn = rng.integers(count, size=(draws, count))
    picked = means[drawn, np.arange(draws)[:, None], np.arange(count)[None, :]]
    totals = np.sum(picked * lengths[drawn], axis=1) / np.sum(lengths[drawn], axis=1)
    low, high = np.quantile(totals, [0.5 - level / 2.0, 0.5 + level / 2.0])
    return Interval(float(low), float(high))


def _drawn_means(
    clip: Float[np.ndarray, "_"], block: int, draws: int, places: int, rng: np.random.Generator
) -> Float[np.ndarray, "{draws} {places}"]:
    """Means of clips made of random blocks of one clip, for every draw and every place that it may be drawn to."""
    size = min(block, len(clip))
    around = np.concatenate([clip, clip[: size - 1]])
    block_means = np.convolve(around, np.full(size, 1.0 / size), mode="valid")
    num_blocks = -(-len(clip) // size)
    return block_means[rng.integers(len(clip), size=(draws, places, num_blocks))].mean(axis=-1)
