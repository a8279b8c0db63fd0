"""The time offset between two systems that measured the same motion, by cross-correlation."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

LARGEST_OFFSET = 10.0
"""Seconds."""
FINEST_STEP = 0.01
"""Seconds: a parabola through three lags tells the offset more finely."""
AS_GOOD = 0.005
"""Lags whose correlation is so little below the best one are as good; a walk is like itself a stride later."""
LEAST_CORRELATION = 0.5
MOVES = 0.1
"""Part of the largest deviation of a signal below which one counts less than the others: it may be noise."""


def time_offset(
    ours: Sequence[Float[np.ndarray, "frame"]],
    our_time: Float[np.ndarray, "frame"],
    theirs: Sequence[Float[np.ndarray, "other"]],
    their_time: Float[np.ndarray, "other"],
) -> tuple[float, float]:
    """Seconds to add to their time, and the correlation there; of lags that are as good the smallest.

    The signals are pairs of the same quantity; either may count the other way, and all that move count alike: a heading
    that goes round and round is as like itself at any lag. At least half of the shorter motion overlaps. NaN is left
    out.
    """
    step = max(float(np.median(np.diff(each))) for each in (our_time, their_time))
    step = max(step / 2.0, FINEST_STEP)
    one, begin = _even(ours, our_time, step)
    other, other_begin = _even(theirs, their_time, step)
    written = round((other_begin - begin) / step)
    least = max(min(one.shape[1], other.shape[1]) // 2, 2)
    reach = int(LARGEST_OFFSET / step)
    lags = [lag for lag in range(-reach, reach + 1) if _overlap(one, other, written + lag) >= least]
    if not lags:
        return 0.0, 0.0
    likeness = np.array([_correlation(one, other, written + lag) for lag in lags])
    best = _chosen(np.array(lags), likeness)
    seconds = (lags[best] + _peak(likeness, best)) * step + (written * step - (other_begin - begin))
    return round(seconds, 3) + 0.0, float(likeness[best])


def _even(
    signals: Sequence[Float[np.ndarray, "frame"]], time: Float[np.ndarray, "frame"], step: float
) -> tuple[Float[np.ndarray, "signal sample"], float]:
    """The signals at even times, NaN before and after they are known, in their deviations; the first of these times."""
    even = np.arange(time[0], time[-1] + 1e-9, step)
    known = [np.isfinite(signal) for signal in signals]
    filled = np.stack([np.interp(even, time[k], s[k], np.nan, np.nan) for s, k in zip(signals, known, strict=True)])
    spread = np.nanstd(filled, axis=1, keepdims=True)
    return filled / np.maximum(spread, max(MOVES * spread.max(), 1e-9)), float(time[0])


def _overlap(one: np.ndarray, other: np.ndarray, lag: int) -> int:
    return min(one.shape[1], other.shape[1] + lag) - max(0, lag)


def _correlation(one: np.ndarray, other: np.ndarray, lag: int) -> float:
    """How alike all signals are together where sample k of the other is sample k + lag of one."""
    first, end = max(0, lag), min(one.shape[1], other.shape[1] + lag)
    a, b = one[:, first:end], other[:, first - lag : end - lag]
    both = np.isfinite(a) & np.isfinite(b)
    a, b = (_about_mean(each, both) for each in (a, b))
    norm = np.sqrt((a**2).sum() * (b**2).sum())
    return float(np.abs((a * b).sum(axis=1)).sum() / norm) if norm > 0 else 0.0


def _about_mean(signals: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Signals less their means over the samples that are known; 0 at the others."""
    values = np.where(known, signals, 0.0)
    mean = values.sum(axis=1, keepdims=True) / np.maximum(known.sum(axis=1, keepdims=True), 1)
    return np.where(known, values - mean, 0.0)


def _chosen(lags: np.ndarray, likeness: np.ndarray) -> int:
    """The peak with the smallest lag among those that are as good as the best."""
    padded = np.concatenate([[-np.inf], likeness, [-np.inf]])
    is_peak = (likeness >= padded[:-2]) & (likeness >= padded[2:])
    peaks = np.flatnonzero(is_peak & (likeness >= likeness.max() - AS_GOOD))
    return int(peaks[np.abs(lags[peaks]).argmin()])


def _peak(likeness: np.ndarray, best: int) -> float:
    """Where a parabola through the best value and its neighbours is largest, in samples from the best."""
    if not 0 < best < len(likeness) - 1:
        return 0.0
    left, middle, right = likeness[best - 1 : best + 2]
    bend = left - 2.0 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0 else 0.0
