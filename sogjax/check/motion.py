"""How much moves in each camera's pictures, from a frame to the next, and along which rays."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, UInt8

from sogjax.check.clip import Clip
from sogjax.data.calibration import CameraRig
from sogjax.model.camera import undistort

BLUR = 1.5
"""Pixels; takes noise and coding artefacts out."""
NOISE_FACTOR, NOISE_FLOOR = 4.0, 1.0
"""Differences of grey values count above this many medians of a picture's differences, and above this value."""


@dataclass(frozen=True)
class CameraMotion:
    """What moves in one camera's pictures."""

    energy: Float[np.ndarray, "step pixel"]
    """How much each pixel changes from a frame to the next: roots of grey values, 0 for noise.

    NaN in steps from or to a frame in which the camera is missing.
    """
    shape: tuple[int, int]
    """Rows and columns of the pixels."""
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


def motion_of(clip: Clip) -> list[CameraMotion]:
    """What moves in each camera of a clip."""
    rig = clip.recording.rig
    rows = zip(rig.names, clip.grey, clip.present, strict=True)
    return [_camera_motion(rig, name, grey, present) for name, grey, present in rows]


def _camera_motion(
    rig: CameraRig, name: str, grey: UInt8[np.ndarray, "frame h w"], present: Bool[np.ndarray, "frame"]
) -> CameraMotion:
    energy = frame_differences(grey)
    shape = (max(1, grey.shape[1] // 2), max(1, grey.shape[2] // 2))
    small = np.empty((len(energy), *shape), np.float32)
    for k, step in enumerate(energy):
        small[k] = cv2.resize(step, shape[::-1], interpolation=cv2.INTER_AREA)
    small[~(present[1:] & present[:-1])] = np.nan
    return CameraMotion(np.sqrt(small).reshape(len(small), shape[0] * shape[1]), shape, *world_rays(rig, name, shape))


def with_rig(motions: Sequence[CameraMotion], rig: CameraRig) -> list[CameraMotion]:
    """The same pictures under another calibration."""
    return [
        CameraMotion(motion.energy, motion.shape, *world_rays(rig, name, motion.shape))
        for motion, name in zip(motions, rig.names, strict=True)
    ]


def frame_differences(grey: UInt8[np.ndarray, "frame h w"]) -> Float[np.ndarray, "step h w"]:
    """How much each pixel differs from the frame before, beyond noise."""
    smooth = [cv2.GaussianBlur(picture.astype(np.float32), (0, 0), BLUR) for picture in grey]
    steps = np.empty((len(grey) - 1, *grey.shape[1:]), np.float32)
    for k in range(len(grey) - 1):
        difference = np.abs(smooth[k + 1] - smooth[k])
        steps[k] = np.maximum(difference - NOISE_FACTOR * float(np.median(difference)) - NOISE_FLOOR, 0.0)
    return steps


def world_rays(
    rig: CameraRig, name: str, shape: tuple[int, int]
) -> tuple[Float[np.ndarray, "pixel 3"], Float[np.ndarray, "3"]]:
    """Directions (world, unit vectors) of all pixels of a smaller picture of `shape`, and the camera's place."""
    camera, (width, height) = rig.camera(name), rig.image_size(name)
    columns = (np.arange(shape[1]) + 0.5) * width / shape[1] - 0.5
    rows = (np.arange(shape[0]) + 0.5) * height / shape[0] - 0.5
    grid = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
    pixels = np.asarray(undistort(camera, jnp.asarray(grid, camera.intrinsics.dtype)), float)
    matrix, pose = np.asarray(camera.intrinsics, float), np.asarray(camera.camera_from_world, float)
    plane = (pixels - matrix[:2, 2]) / np.array([matrix[0, 0], matrix[1, 1]])
    local = np.concatenate([plane, np.ones((len(plane), 1))], axis=1)
    rays = local @ pose[:3, :3]
    return rays / np.linalg.norm(rays, axis=1, keepdims=True), -pose[:3, :3].T @ pose[:3, 3]
