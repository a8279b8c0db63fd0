"""Points from their pixels in several cameras: weighted least squares over those cameras that agree.

The linear triangulation of Hartley and Zisserman (Section 12.2) with the detector's confidences as weights; of all
pairs of cameras the one that most others agree with decides which cameras count, as in RANSAC but complete.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.io.calibration.rig import CameraRig
from sogjax.model.camera import NEAR, undistort

TOLERANCE = 0.06
"""Metres at the point's distance by which a camera's pixel may miss it."""

_AT_ONCE = 1000
"""Points that are triangulated together."""
_DAMPING = 1e-9
"""Keeps parallel rays from dividing by zero; their point is far off and agrees with nobody."""


@dataclass(frozen=True)
class Rays:
    """What cameras see points at: pixels without lens and intrinsics, x = X / Z."""

    poses: Float[np.ndarray, "view 3 4"]
    """Camera from world, metres."""
    rays: Float[np.ndarray, "view point 2"]
    weights: Float[np.ndarray, "view point"]
    """The weights of the views, 0 where a point is not seen."""

    def of_points(self, chosen: slice) -> "Rays":
        """The rays of some of the points."""
        return Rays(self.poses, self.rays[:, chosen], self.weights[:, chosen])


@dataclass(frozen=True)
class Triangulated:
    """Points in the world, and how well their cameras agree."""

    points: Float[np.ndarray, "*group point 3"]
    """Metres; NaN where fewer than two cameras agree."""
    num_cameras: Int[np.ndarray, "*group point"]
    """How many cameras agree."""
    errors: Float[np.ndarray, "*group point"]
    """Weighted mean distance of the point from those cameras' rays, metres; NaN where there is no point."""


def rays_of(rig: CameraRig, pixels: Float[np.ndarray, "camera point 2"]) -> Float[np.ndarray, "camera point 2"]:
    """Rays of pixels of the pictures as recorded."""
    matrix = np.asarray(rig.cameras.intrinsics, float)
    straight = undistorted(rig, pixels)
    focal = np.stack([matrix[:, 0, 0], matrix[:, 1, 1]], axis=-1)
    return (straight - matrix[:, None, :2, 2]) / focal[:, None]


def undistorted(rig: CameraRig, pixels: Float[np.ndarray, "camera point 2"]) -> Float[np.ndarray, "camera point 2"]:
    """Undistorted pixels of pixels of the pictures as recorded."""
    return np.asarray(_undistorted(rig.cameras, jnp.asarray(pixels, jnp.float32)), float)


def poses_of(rig: CameraRig) -> Float[np.ndarray, "camera 3 4"]:
    """Camera from world."""
    return np.asarray(rig.cameras.camera_from_world, float)[:, :3]


def triangulated(seen: Rays, tolerance: float = TOLERANCE) -> Triangulated:
    """The points, each from the cameras that agree about it within `tolerance` metres."""
    num_views, num_points = seen.weights.shape
    pairs = np.array([*combinations(range(num_views), 2)], int).reshape(-1, 2)
    if not len(pairs) or not num_points:
        nothing = np.full(num_points, np.nan)
        return Triangulated(np.full((num_points, 3), np.nan), np.zeros(num_points, int), nothing)
    parts = [_agreed(seen.of_points(slice(k, k + _AT_ONCE)), pairs, tolerance) for k in range(0, num_points, _AT_ONCE)]
    points, counts, errors = (np.concatenate(part) for part in zip(*parts, strict=True))
    return Triangulated(points, counts, errors)


def points_of_pairs(
    seen: Rays, pairs: Int[np.ndarray, "pair 2"]
) -> tuple[Float[np.ndarray, "pair point 3"], Bool[np.ndarray, "pair point"]]:
    """The points by two views each, and whether both see them."""
    matrices, sides = _normal_equations(seen, seen.weights)
    points = _solved(matrices[pairs].sum(1), sides[pairs].sum(1))
    first, second = pairs.T
    return points, (seen.weights[first] > 0.0) & (seen.weights[second] > 0.0)


def distances(seen: Rays, points: Float[np.ndarray, "*group point 3"]) -> Float[np.ndarray, "*group view point"]:
    """How far points are from the rays of the views, metres; infinite behind a camera and where a view sees none."""
    rotation, translation = seen.poses[:, :, :3], seen.poses[:, :, 3]
    there = np.einsum("vij,...nj->...vni", rotation, points) + translation[:, None]
    depths = there[..., 2]
    front = (depths > NEAR) & (seen.weights > 0.0)
    misses = np.linalg.norm(there[..., :2] - seen.rays * depths[..., None], axis=-1)
    return np.where(front, misses, np.inf)


def _agreed(
    seen: Rays, pairs: Int[np.ndarray, "pair 2"], tolerance: float
) -> tuple[Float[np.ndarray, "point 3"], Int[np.ndarray, "point"], Float[np.ndarray, "point"]]:
    candidates, both = points_of_pairs(seen, pairs)
    closeness = np.clip(1.0 - distances(seen, candidates) / tolerance, 0.0, None)
    scores = np.where(both, (closeness * seen.weights).sum(1), -1.0)
    best = scores.argmax(0)
    points = np.take_along_axis(candidates, best[None, :, None], axis=0)[0]
    for _ in range(2):
        agree = distances(seen, points) < tolerance
        points = np.where((agree.sum(0) >= 2)[:, None], _solved(*_summed(seen, agree)), points)
    missed = distances(seen, points)
    agree = missed < tolerance
    counts = np.where(scores.max(0) > 0.0, agree.sum(0), 0)
    weights = seen.weights * agree
    errors = (weights * np.where(agree, missed, 0.0)).sum(0) / np.maximum(weights.sum(0), 1e-12)
    found = counts >= 2
    return np.where(found[:, None], points, np.nan), np.where(found, counts, 0), np.where(found, errors, np.nan)


def _summed(
    seen: Rays, agree: Bool[np.ndarray, "view point"]
) -> tuple[Float[np.ndarray, "point 3 3"], Float[np.ndarray, "point 3"]]:
    matrices, sides = _normal_equations(seen, seen.weights * agree)
    return matrices.sum(0), sides.sum(0)


def _normal_equations(
    seen: Rays, weights: Float[np.ndarray, "view point"]
) -> tuple[Float[np.ndarray, "view point 3 3"], Float[np.ndarray, "view point 3"]]:
    """The equations of each view, that the point lies on its ray: (R_x - x R_z) X = x t_z - t_x, and so for y."""
    rotation, translation = seen.poses[:, :, :3], seen.poses[:, :, 3]
    rows = rotation[:, None, :2] - seen.rays[..., None] * rotation[:, None, 2:]
    right = seen.rays * translation[:, None, 2:] - translation[:, None, :2]
    squared = weights[..., None] ** 2
    return np.einsum("vnki,vnkj,vnk->vnij", rows, rows, np.broadcast_to(squared, right.shape)), np.einsum(
        "vnki,vnk->vni", rows, right * squared
    )


def _solved(
    matrices: Float[np.ndarray, "*group 3 3"], sides: Float[np.ndarray, "*group 3"]
) -> Float[np.ndarray, "*group 3"]:
    return np.linalg.solve(matrices + _DAMPING * np.eye(3), sides[..., None])[..., 0]


@jax.jit
def _undistorted(cameras, pixels):
    single = jax.tree.map(lambda leaf: leaf if leaf.dtype == bool else leaf.astype(pixels.dtype), cameras)
    return jax.vmap(undistort)(single, pixels)


def interpolated(points: Float[np.ndarray, "frame point 3"], longest: int) -> Float[np.ndarray, "frame point 3"]:
    """Gaps of at most `longest` frames between two known places filled on a straight line."""
    filled = points.copy()
    for k in range(points.shape[1]):
        known = np.flatnonzero(np.isfinite(points[:, k]).all(-1))
        for before, after in pairwise(known):
            if 1 < after - before <= longest + 1:
                shares = np.arange(1, after - before)[:, None] / (after - before)
                filled[before + 1 : after, k] = (1.0 - shares) * points[before, k] + shares * points[after, k]
    return filled


def all_pairs(views_of: Sequence[int]) -> Int[np.ndarray, "pair 2"]:
    """Pairs of views of two different cameras; `views_of` names the camera of each view."""
    return np.array([(a, b) for a, b in combinations(range(len(views_of)), 2) if views_of[a] != views_of[b]], int)
