"""Smooth motion over a clip, both ways in time, forgiving where a motion is sudden."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int


class SmoothModel(NamedTuple):
    """The value (to be maximised) with its gradient and curvature: diagonals of a frame with itself and later ones."""

    value: float
    gradient: Float[np.ndarray, "frame dof"]
    own: Float[np.ndarray, "frame dof"]
    next: Float[np.ndarray, "frame dof"]
    after_next: Float[np.ndarray, "frame dof"]


def smooth_model(
    poses: Float[np.ndarray, "frame dof"], frames: Int[np.ndarray, "frame"], weight: float, sudden: float
) -> SmoothModel:
    """Minus Huber's penalty of the second differences of three frames that follow each other.

    Args:
        poses: radians and metres.
        frames: their numbers; where some are missing in between, nothing is penalised.
        weight: of half a squared second difference.
        sudden: second difference from which on the penalty grows only linearly.
    """
    triples = _following(frames)[:, None]
    bend = poses[2:] - 2.0 * poses[1:-1] + poses[:-2]
    size = np.abs(bend)
    cost = np.where(size <= sudden, 0.5 * bend**2, sudden * (size - 0.5 * sudden))
    stiffness = weight * np.where(size <= sudden, 1.0, sudden / np.maximum(size, 1e-12)) * triples
    force = stiffness * bend
    gradient, own, following, after_next = (np.zeros_like(poses) for _ in range(4))
    for part, factor in ((slice(None, -2), 1.0), (slice(1, -1), -2.0), (slice(2, None), 1.0)):
        gradient[part] -= factor * force
        own[part] += factor**2 * stiffness
    following[:-2] -= 2.0 * stiffness
    following[1:-1] -= 2.0 * stiffness
    after_next[:-2] += stiffness
    return SmoothModel(-weight * float(np.sum(triples * cost)), gradient, own, following, after_next)


def _following(frames: Int[np.ndarray, "frame"]) -> Bool[np.ndarray, "triple"]:
    """Which frames are followed by the next and the one after it."""
    return (frames[1:-1] - frames[:-2] == 1) & (frames[2:] - frames[1:-1] == 1)
