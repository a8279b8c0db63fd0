"""What moves, seen along epipolar lines: the same planes of space hold the same motion in two cameras.

All points of a plane through two cameras lie on one line in each of their pictures. How much moves on the lines of a
pencil of such planes, over time, is a "motion barcode" that both cameras share, whatever they see otherwise (Pundik
and Moses, ECCV 2010; Kasten, Ben-Artzi, Peleg and Werman, ECCV 2016). It shifts with time offsets, and is unlike the
other's where a calibration is wrong.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from jaxtyping import Float

from sogjax.check.motion import CameraMotion

NUM_PLANES = 64
FEWEST_COMMON = 5
"""Steps that two cameras must both see, for their motion to be compared."""
TAILS = 0.01
"""Share of the motion at either end that the pencil of planes need not hold."""

PairCodes = dict[tuple[int, int], tuple[Float[np.ndarray, "step plane"], Float[np.ndarray, "step plane"]]]
"""By pair of cameras how much moves in each plane through both, at each step, as either sees it."""


def barcodes(
    first: CameraMotion, second: CameraMotion
) -> tuple[Float[np.ndarray, "step plane"], Float[np.ndarray, "_step plane"]] | None:
    """How much moves in each plane through two cameras, at each step, seen by either; None where nothing moves.

    NaN in steps in which a camera is missing.
    """
    if not (first.total.any() and second.total.any()):
        return None
    baseline = second.centre - first.centre
    axis = baseline / max(float(np.linalg.norm(baseline)), 1e-12)
    towards = first.direction + second.direction
    towards = towards - (towards @ axis) * axis
    length = float(np.linalg.norm(towards))
    if length < 1e-3:
        return None
    towards = towards / length
    across = np.cross(axis, towards)
    angles = [np.arctan2(motion.rays @ across, motion.rays @ towards) for motion in (first, second)]
    ranges = [_range(motion.total, angle) for motion, angle in zip((first, second), angles, strict=True)]
    low, high = min(low for low, _ in ranges), max(high for _, high in ranges)
    return (
        _binned(first, angles[0], low, high),
        _binned(second, angles[1], low, high),
    )


def pair_barcodes(motions: Sequence[CameraMotion]) -> PairCodes:
    """The barcodes of all pairs of cameras that see something move."""
    pairs = combinations(range(len(motions)), 2)
    codes = {(a, b): barcodes(motions[a], motions[b]) for a, b in pairs}
    return {pair: both for pair, both in codes.items() if both is not None}


def _range(weights: Float[np.ndarray, "pixel"], angles: Float[np.ndarray, "pixel"]) -> tuple[float, float]:
    order = np.argsort(angles)
    share = np.cumsum(weights[order], dtype=float) / weights.sum(dtype=float)
    ends = np.searchsorted(share, [TAILS, 1.0 - TAILS])
    low, high = angles[order][np.minimum(ends, len(order) - 1)]
    return float(low), float(max(high, low + 1e-6))


def _binned(
    motion: CameraMotion, angles: Float[np.ndarray, "pixel"], low: float, high: float
) -> Float[np.ndarray, "step plane"]:
    number = np.floor((angles - low) / (high - low) * NUM_PLANES).astype(int)
    used = np.flatnonzero((number >= 0) & (number < NUM_PLANES) & (motion.total > 0.0))
    chosen = np.zeros((len(used), NUM_PLANES), np.float32)
    chosen[np.arange(len(used)), number[used]] = 1.0
    return motion.energy[:, used] @ chosen


def correlation(a: Float[np.ndarray, "step plane"], b: Float[np.ndarray, "_step plane"]) -> float:
    """Normalised correlation over time and planes, the mean of each plane taken off; 0 where little is seen by both."""
    both = ~(np.isnan(a).any(axis=1) | np.isnan(b).any(axis=1))
    if both.sum() < FEWEST_COMMON:
        return 0.0
    a, b = a[both], b[both]
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    return float((a * b).sum() / np.sqrt(float((a * a).sum()) * float((b * b).sum()) + 1e-12))


def lag_curve(
    a: Float[np.ndarray, "step plane"], b: Float[np.ndarray, "_step plane"], most: int
) -> Float[np.ndarray, "lag"]:
    """Correlation of a(t + lag) with b(t), for lags from -most to most."""
    return np.array([correlation(*shifted(a, b, lag)) for lag in range(-most, most + 1)])


def shifted(
    a: Float[np.ndarray, "step plane"], b: Float[np.ndarray, "_step plane"], lag: int
) -> tuple[np.ndarray, np.ndarray]:
    """The parts of two series where a(t + lag) and b(t) exist, side by side."""
    count = min(len(a), len(b))
    return a[max(lag, 0) : count + min(lag, 0)], b[max(-lag, 0) : count - max(lag, 0)]
