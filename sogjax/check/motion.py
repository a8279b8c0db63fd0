"""How much moves in each camera's pictures, from a frame to the next, and what two cameras share of it.

All points of a plane through two cameras lie on one line in each of their pictures. How much moves on the lines of a
pencil of such planes, over time, is a "motion barcode" that both cameras share, whatever they see otherwise (Pundik
and Moses, ECCV 2010; Kasten, Ben-Artzi, Peleg and Werman, ECCV 2016). It shifts with time offsets, and is unlike the
other's where a calibration is wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import cv2
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, UInt8

from sogjax.check.pictures import Clip
from sogjax.io.calibration.rig import CameraRig
from sogjax.model.camera import undistort

STEEPEST = 50.0
"""Tangent of the angle to the optical axis from which on a lens model is not believed."""


@dataclass(frozen=True)
class CameraMotion:
    """What moves in one camera's pictures."""

    energy: Float[np.ndarray, "step pixel"]
    """How much each pixel changes from a frame to the next: roots of grey values, 0 for noise.

    NaN in steps from or to a frame in which the camera is missing.
    """
    rays: Float[np.ndarray, "pixel 3"]
    """The pixels' directions in the world, unit vectors."""
    centre: Float[np.ndarray, "3"]

    @cached_property
    def total(self) -> Float[np.ndarray, "pixel"]:
        """How much each pixel changes in all the steps that are seen."""
        return np.nansum(self.energy, axis=0)

    @property
    def num_seen(self) -> int:
        """Steps in which the camera is not missing."""
        return int((~np.isnan(self.energy[:, 0])).sum())

    @property
    def mean(self) -> float:
        """How much a pixel changes in a step on average."""
        return float(self.total.mean()) / max(self.num_seen, 1)

    @property
    def direction(self) -> Float[np.ndarray, "3"]:
        """The mean direction of what moves."""
        mean = self.total @ self.rays
        return mean / max(float(np.linalg.norm(mean)), 1e-12)


def motion_of(clip: Clip, rig: CameraRig) -> list[CameraMotion]:
    """What moves in each camera of a clip, whose calibration is `rig`."""
    rows = zip(rig.names, clip.grey, clip.present, strict=True)
    return [_camera_motion(rig, name, grey, present) for name, grey, present in rows]


def _camera_motion(
    rig: CameraRig, name: str, grey: UInt8[np.ndarray, "frame h w"], present: Bool[np.ndarray, "frame"]
) -> CameraMotion:
    energy = _frame_differences(grey)
    shape = (max(1, grey.shape[1] // 2), max(1, grey.shape[2] // 2))
    small = np.empty((len(energy), *shape), np.float32)
    for k, step in enumerate(energy):
        small[k] = cv2.resize(step, shape[::-1], interpolation=cv2.INTER_AREA)
    rays, centre = _world_rays(rig, name, shape)
    energy = np.sqrt(small).reshape(len(small), shape[0] * shape[1])
    energy[:, ~rays.any(axis=1)] = 0.0
    energy[~(present[1:] & present[:-1])] = np.nan
    return CameraMotion(energy, rays, centre)


def _frame_differences(grey: UInt8[np.ndarray, "frame h w"]) -> Float[np.ndarray, "step h w"]:
    """How much each pixel differs from the frame before, beyond one grey value and four medians of all pixels.

    A blur takes noise and coding artefacts out.
    """
    smooth = [cv2.GaussianBlur(picture.astype(np.float32), (0, 0), 1.5) for picture in grey]
    steps = np.empty((len(grey) - 1, *grey.shape[1:]), np.float32)
    for k in range(len(grey) - 1):
        difference = np.abs(smooth[k + 1] - smooth[k])
        steps[k] = np.maximum(difference - 4.0 * float(np.median(difference)) - 1.0, 0.0)
    return steps


def _world_rays(
    rig: CameraRig, name: str, shape: tuple[int, int]
) -> tuple[Float[np.ndarray, "pixel 3"], Float[np.ndarray, "3"]]:
    """Directions (world, unit vectors) of all pixels of a smaller picture of `shape`, and the camera's place.

    Zeros where the lens model gives none, at the border of wide lenses.
    """
    camera, (width, height) = rig.camera(name), rig.image_size(name)
    columns = (np.arange(shape[1]) + 0.5) * width / shape[1] - 0.5
    rows = (np.arange(shape[0]) + 0.5) * height / shape[0] - 0.5
    grid = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    pixels = np.asarray(undistort(camera, jnp.asarray(grid, camera.intrinsics.dtype)), float)
    matrix, pose = np.asarray(camera.intrinsics, float), np.asarray(camera.camera_from_world, float)
    plane = (pixels - matrix[:2, 2]) / np.array([matrix[0, 0], matrix[1, 1]])
    told = np.all(np.abs(plane) < STEEPEST, axis=1, keepdims=True)  # also not where it is NaN
    local = np.concatenate([np.where(told, plane, 0.0), np.ones((len(plane), 1))], axis=1)
    rays = local @ pose[:3, :3]
    return rays / np.linalg.norm(rays, axis=1, keepdims=True) * told, -pose[:3, :3].T @ pose[:3, 3]


NUM_PLANES = 64

PairCodes = dict[tuple[int, int], tuple[Float[np.ndarray, "step plane"], Float[np.ndarray, "step plane"]]]
"""How much moves in each plane through the cameras of a pair, at each step, as either sees it."""


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
    return _binned(first, angles[0], low, high), _binned(second, angles[1], low, high)


def pair_barcodes(motions: Sequence[CameraMotion]) -> PairCodes:
    """The barcodes of all pairs of cameras that see something move."""
    pairs = combinations(range(len(motions)), 2)
    codes = {(a, b): barcodes(motions[a], motions[b]) for a, b in pairs}
    return {pair: both for pair, both in codes.items() if both is not None}


def _range(weights: Float[np.ndarray, "pixel"], angles: Float[np.ndarray, "pixel"]) -> tuple[float, float]:
    """The angles between which there is all motion but one per cent at either end."""
    order = np.argsort(angles)
    share = np.cumsum(weights[order], dtype=float) / max(weights.sum(dtype=float), 1e-12)
    ends = np.searchsorted(share, [0.01, 0.99])
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
    """Normalised correlation over time and planes, the mean of each plane taken off; 0 where both see few steps."""
    both = ~(np.isnan(a).any(axis=1) | np.isnan(b).any(axis=1))
    if both.sum() < 5:
        return 0.0
    a, b = a[both], b[both]
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    return float((a * b).sum() / np.sqrt(float((a * a).sum()) * float((b * b).sum()) + 1e-12))


def lag_curve(
    a: Float[np.ndarray, "step plane"], b: Float[np.ndarray, "_step plane"], most: int
) -> Float[np.ndarray, "lag"]:
    """Correlation of a(t + lag) with b(t), for lags from -most to most."""
    count = min(len(a), len(b))
    lags = range(-most, most + 1)
    return np.array([correlation(a[max(k, 0) : count + min(k, 0)], b[max(-k, 0) : count - max(k, 0)]) for k in lags])
