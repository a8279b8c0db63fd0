"""Which frames of a long clip tell a body's shape: those whose poses differ most, where the body was well seen."""

import numpy as np
from jaxtyping import Float, Int

from sogjax.model.skeleton import Skeleton

WELL_SEEN = 0.9
"""Of the median energy of the frames around: where it is less, a limb may be lost, and a lost limb bends the shape."""
AROUND = 30
"""Frames to both sides."""


def frames_by_spread(
    skeleton: Skeleton,
    poses: Float[np.ndarray, "frame dof"],
    similarity: Float[np.ndarray, "frame"],
    count: int,
) -> Int[np.ndarray, "chosen"]:
    """Rows of `poses`, increasing: all where there are no more than `count`, less those that were badly seen.

    Farthest-point choice by joint angles in units of their ranges; where the body is and which way it looks is no
    matter. A similarity that is NaN leaves nothing out.
    """
    rows = np.flatnonzero(_well_seen(np.asarray(similarity, float)))
    if len(rows) <= count:
        return rows
    bent = _bent(skeleton, poses[rows])
    first = int(np.argmin(np.linalg.norm(bent - np.median(bent, axis=0), axis=1)))
    chosen, distance = [first], np.linalg.norm(bent - bent[first], axis=1)
    while len(chosen) < count:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(bent - bent[chosen[-1]], axis=1))
    return rows[np.sort(chosen)]


def _bent(skeleton: Skeleton, poses: Float[np.ndarray, "frame dof"]) -> Float[np.ndarray, "frame limited"]:
    """The degrees of freedom that have limits, in units of their ranges."""
    spans = np.asarray(skeleton.dof_upper, float) - np.asarray(skeleton.dof_lower, float)
    limited = np.isfinite(spans) & (spans > 0.0)
    return poses[:, limited] / spans[limited]


def _well_seen(similarity: Float[np.ndarray, "frame"]) -> np.ndarray:
    """Frames that are explained about as well as those around them."""
    if np.isnan(similarity).any():
        return np.ones(len(similarity), bool)
    count = len(similarity)
    around = [np.median(similarity[max(k - AROUND, 0) : k + AROUND + 1]) for k in range(count)]
    return similarity >= WELL_SEEN * np.array(around)
