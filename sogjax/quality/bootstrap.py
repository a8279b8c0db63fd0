"""How sure a mean over a few recordings is: bootstrap over recordings, or over stretches of frames of a single one."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.stats import t as student

BLOCK = 10
"""Frames that are drawn together: the errors of neighbouring frames are alike."""
FEWEST_BLOCKS = 3
"""Of one recording; blocks of shorter ones are shorter."""
DRAWS = 2000
LEVEL = 0.95


class Interval(NamedTuple):
    """Within which a mean lies; NaN where there is nothing to say it from."""

    low: float
    high: float

    @property
    def holds_zero(self) -> bool:
        """Whether a difference with this interval is not significant."""
        return not (self.low > 0.0 or self.high < 0.0)


def bootstrap_interval(
    clips: Sequence[Float[np.ndarray, "_"]],
    *,
    block: int = BLOCK,
    draws: int = DRAWS,
    level: float = LEVEL,
    seed: int = 0,
) -> Interval:
    """Interval of the mean of all frames of all clips: Student's t with the standard error of a bootstrap.

    Recordings are drawn with replacement as a whole, since their frames are alike (cluster bootstrap). Of a single one
    stretches of frames are drawn: that says nothing of other recordings.
    Percentiles of so few pieces would be too narrow, so the error is that of a sample (n / (n - 1)) and the quantile
    that of n - 1 degrees of freedom. NaN is left out beforehand.
    """
    present = [values for clip in clips if (values := np.asarray(clip, float)[np.isfinite(clip)]).size]
    if len(present) == 1:
        present = _blocks(present[0], block)
    count = len(present)
    if count < 2:
        return Interval(float("nan"), float("nan"))
    sums, lengths = np.array([clip.sum() for clip in present]), np.array([len(clip) for clip in present], float)
    drawn = np.random.default_rng(seed).integers(count, size=(draws, count))
    means = sums[drawn].sum(axis=1) / lengths[drawn].sum(axis=1)
    half = student.ppf(0.5 + level / 2.0, count - 1) * means.std() * (count / (count - 1)) ** 0.5
    mean = sums.sum() / lengths.sum()
    return Interval(float(mean - half), float(mean + half))


def _blocks(clip: Float[np.ndarray, "_"], block: int) -> list[Float[np.ndarray, "_"]]:
    """A clip as stretches of frames; none where it is too short for `FEWEST_BLOCKS`."""
    size = min(block, len(clip) // FEWEST_BLOCKS)
    return np.array_split(clip, len(clip) // size) if size else []
