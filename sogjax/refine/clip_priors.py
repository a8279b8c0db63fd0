"""Feet on the floor: points near it that are slow stay where they are, and nothing goes through it.

Smooth motion over a clip, both ways in time, forgiving where a motion is sudden.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

SILHOUETTE = 1.35
"""Sigmas from a blob's centre to the edge of its silhouette."""
NEAR_FLOOR = 0.04
"""Metres between the underside of a blob and the floor within which it may stand."""
SLOW = 0.15
"""Metres per second above which it does not."""
SPAN = 2
"""Frames to both sides over which its speed is taken."""
FLOOR_SHARE = 0.1
"""Share of the frames in which something is below what is taken for the floor: steps, and blobs that are too low."""
FLOOR_SCATTER = 0.03
"""Metres by which the lowest points of frames scatter on a floor; where half of them scatter more, there is none (a
swing, a climber, a jump)."""


class MovingBlobs(NamedTuple):
    """The blobs of all frames, and how they move with the poses and the shape."""

    means: Float[np.ndarray, "frame blob 3"]
    by_pose: Float[np.ndarray, "frame blob 3 dof"]
    by_shape: Float[np.ndarray, "frame blob 3 shape"]
    sigmas: Float[np.ndarray, "blob"]
    sigmas_by_shape: Float[np.ndarray, "blob shape"]


class ContactModel(NamedTuple):
    """The value (to be maximised) with its gradient and curvature, as `ArrowSystem` has them."""

    value: float
    gradient: Float[np.ndarray, "frame dof"]
    own: Float[np.ndarray, "frame dof dof"]
    next: Float[np.ndarray, "frame dof dof"]
    cross: Float[np.ndarray, "frame dof shape"]
    shared_gradient: Float[np.ndarray, "shape"]
    corner: Float[np.ndarray, "shape shape"]


def step_of(frames: Int[np.ndarray, "frame"]) -> int:
    """By how much the numbers of a clip's frames grow where none is missing."""
    return int(np.diff(frames).min()) if len(frames) > 1 else 1


def undersides(
    means: Float[np.ndarray, "frame blob 3"], sigmas: Float[np.ndarray, "blob"], vertical: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "frame blob"]:
    """Heights of the lowest points of blobs (metres)."""
    return means @ vertical - SILHOUETTE * sigmas[None, :]


def floor_height(lowest_points: Float[np.ndarray, "frame blob"]) -> float:
    """Where the floor is, from the undersides of the blobs of a clip; NaN where there is none."""
    lowest = lowest_points.min(axis=1)
    floor = float(np.quantile(lowest, FLOOR_SHARE))
    return float("nan") if np.median(np.abs(lowest - floor)) > FLOOR_SCATTER else floor


def standing(
    means: Float[np.ndarray, "frame blob 3"],
    heights: Float[np.ndarray, "frame blob"],
    frames: Int[np.ndarray, "frame"],
    fps: float,
    step: int,
) -> Bool[np.ndarray, "frame blob"]:
    """Which blobs stand from each frame to the next one, whatever body it is; the last row is false.

    Heights are those of undersides over the floor (NaN: there is none); `fps` counts the numbers of frames. Frames
    farther apart than a `step` join nothing.
    """
    pairs = np.zeros(heights.shape, bool)
    if len(frames) > 2 * SPAN:
        still = (heights < NEAR_FLOOR) & (_speeds(means, frames, fps) < SLOW)
        pairs[:-1] = still[:-1] & still[1:] & (np.diff(frames) == step)[:, None]
    return pairs


def contact_model(
    blobs: MovingBlobs,
    floor: float,
    vertical: Float[np.ndarray, "3"],
    pairs: Bool[np.ndarray, "frame blob"],
    weight: float,
) -> ContactModel:
    """Minus half the weighted squares of how far standing blobs move from frame to frame, and of depths in the floor.

    `pairs` marks blobs that stand from each frame to the next; the floor's height is NaN where there is none; the
    weight is in 1/m^2.
    """
    frames, shape = len(blobs.means), blobs.by_shape.shape[-1]
    depths, sinking, sinking_by_shape = _below_floor(blobs, floor, vertical)
    moved, here, after, by_shape = _slides(blobs, pairs)
    dofs = here.shape[-1]
    transposed = lambda part: np.swapaxes(part, 1, 2)
    gradient = -np.einsum("tkd,tk->td", sinking, depths)
    own, cross = transposed(sinking) @ sinking, transposed(sinking) @ sinking_by_shape
    gradient[:-1] += np.einsum("tkd,tk->td", here, moved)
    gradient[1:] -= np.einsum("tkd,tk->td", after, moved)
    own[:-1] += transposed(here) @ here
    own[1:] += transposed(after) @ after
    cross[:-1] -= transposed(here) @ by_shape
    cross[1:] += transposed(after) @ by_shape
    beside = np.zeros((frames, dofs, dofs))
    beside[:-1] -= transposed(here) @ after
    rates = np.concatenate([sinking_by_shape.reshape(-1, shape), by_shape.reshape(-1, shape)])
    rest = np.concatenate([depths.reshape(-1), moved.reshape(-1)])
    parts = (gradient, own, beside, cross, -rates.T @ rest, rates.T @ rates)
    return ContactModel(-0.5 * weight * float(rest @ rest), *(weight * part for part in parts))


def _below_floor(
    blobs: MovingBlobs, floor: float, vertical: Float[np.ndarray, "3"]
) -> tuple[Float[np.ndarray, "frame some"], Float[np.ndarray, "frame some dof"], Float[np.ndarray, "frame some shape"]]:
    """Depths of undersides in the floor (0 above it), and how they change with poses and shape."""
    heights = undersides(blobs.means, blobs.sigmas, vertical) - floor
    depths = np.maximum(-np.nan_to_num(heights, nan=1.0), 0.0)
    some = (depths > 0.0).any(axis=0)
    depths, below = depths[:, some], (depths[:, some] > 0.0)[..., None]
    along = lambda part: np.einsum("tbkp,k->tbp", part[:, some], vertical)
    by_shape = SILHOUETTE * blobs.sigmas_by_shape[None, some] - along(blobs.by_shape)
    return depths, -along(blobs.by_pose) * below, by_shape * below


def _slides(blobs: MovingBlobs, pairs: Bool[np.ndarray, "frame blob"]) -> tuple[np.ndarray, ...]:
    """How far standing blobs move from each frame to the next, and derivatives: by both poses, and by the shape."""
    some = pairs.any(axis=0)
    stands = pairs[:-1, some]
    means, by_pose, by_shape = (part[:, some] for part in (blobs.means, blobs.by_pose, blobs.by_shape))
    steps = len(stands)
    rows = lambda part: np.where(stands[..., None, None], part, 0.0).reshape(steps, stands.shape[1] * 3, part.shape[-1])
    moved = np.where(stands[..., None], means[1:] - means[:-1], 0.0).reshape(steps, stands.shape[1] * 3)
    return moved, rows(by_pose[:-1]), rows(by_pose[1:]), rows(by_shape[1:] - by_shape[:-1])


def _speeds(
    means: Float[np.ndarray, "frame blob 3"], frames: Int[np.ndarray, "frame"], fps: float
) -> Float[np.ndarray, "frame blob"]:
    """Metres per second over a few frames, since a motion that is not smoothed yet shakes."""
    count = len(frames)
    before, after = np.maximum(np.arange(count) - SPAN, 0), np.minimum(np.arange(count) + SPAN, count - 1)
    seconds = (frames[after] - frames[before]) / fps
    return np.linalg.norm(means[after] - means[before], axis=-1) / seconds[:, None]


class SmoothModel(NamedTuple):
    """The value (to be maximised) with its gradient and curvature: diagonals of a frame with itself and later ones."""

    value: float
    gradient: Float[np.ndarray, "frame dof"]
    own: Float[np.ndarray, "frame dof"]
    next: Float[np.ndarray, "frame dof"]
    after_next: Float[np.ndarray, "frame dof"]


def smooth_model(
    poses: Float[np.ndarray, "frame dof"], frames: Int[np.ndarray, "frame"], weight: float, sudden: float, step: int
) -> SmoothModel:
    """Minus Huber's penalty of the second differences of three frames that follow each other.

    Farther apart than a `step`, they are not penalised. From the second difference `sudden` on (radians and metres) the
    penalty grows only linearly; `weight` is that of half a squared one.
    """
    follows = np.diff(frames) == step
    triples = (follows[:-1] & follows[1:])[:, None]
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
