"""Points of the world in the pictures of a recording's cameras, as recorded and freed of lens distortion."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import cv2
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, UInt8

from sogjax.errors import InputError
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.model.camera import NEAR, Camera, distort, near_picture, project_points
from sogjax.model.program import compiled
from sogjax.view.tiles import shrink

POINTS_AT_ONCE = 8192
"""Motions are projected in blocks of this size, so that the projection is compiled once for a rig."""


def picture_points(
    rig: CameraRig, points: Float[np.ndarray, "frame point 3"]
) -> tuple[Float[np.ndarray, "camera frame point 2"], Float[np.ndarray, "camera frame point"]]:
    """Pixels of the pictures as recorded, and depths in metres.

    A pixel is NaN where a lens model means nothing: behind a camera, far outside its picture, and where a polynomial
    model folds back.
    """
    bounds = jnp.asarray(unfolded_radii(rig), jnp.float32)
    cameras = jax.tree.map(lambda leaf: leaf if leaf.dtype == bool else leaf.astype(jnp.float32), rig.cameras)
    flat = points.reshape(-1, 3).astype(np.float32)
    pixels = np.empty((len(rig), len(flat), 2), np.float32)
    depths = np.empty((len(rig), len(flat)), np.float32)
    for start in range(0, len(flat), POINTS_AT_ONCE):
        part = flat[start : start + POINTS_AT_ONCE]
        padded = np.pad(part, ((0, POINTS_AT_ONCE - len(part)), (0, 0)))
        where, depth = _project(cameras, bounds, jnp.asarray(padded))
        pixels[:, start : start + len(part)] = np.asarray(where)[:, : len(part)]
        depths[:, start : start + len(part)] = np.asarray(depth)[:, : len(part)]
    shape = (len(rig), *points.shape[:2])
    return pixels.reshape(*shape, 2), depths.reshape(shape)


def unfolded_radii(rig: CameraRig) -> Float[np.ndarray, "camera"]:
    """The tangent of the angle from each camera's axis up to which its polynomial model grows; farther out it folds.

    Infinity where it never folds, and for fisheye cameras.
    """
    radii = np.full(len(rig), np.inf)
    for k, (k1, k2, _, _, k3) in enumerate(np.asarray(rig.cameras.distortion, float)):
        slope = np.roots([7.0 * k3, 5.0 * k2, 3.0 * k1, 1.0])  # of r (1 + k1 r^2 + k2 r^4 + k3 r^6), in r^2
        folds = slope.real[(np.abs(slope.imag) < 1e-9) & (slope.real > 0)]
        if len(folds) and not rig.is_fisheye(rig.names[k]):
            radii[k] = np.sqrt(folds.min())
    return radii


@compiled
def _project(
    cameras: Camera, bounds: Float[Array, "camera"], points: Float[Array, "n 3"]
) -> tuple[Float[Array, "camera n 2"], Float[Array, "camera n"]]:
    return cast(tuple[Array, Array], jax.vmap(_project_one, in_axes=(0, 0, None))(cameras, bounds, points))


def _project_one(
    camera: Camera, bound: Float[Array, ""], points: Float[Array, "n 3"]
) -> tuple[Float[Array, "n 2"], Float[Array, "n"]]:
    pixels, depth = project_points(camera, points)
    focal = jnp.stack([camera.intrinsics[0, 0], camera.intrinsics[1, 1]])
    unfolded = jnp.linalg.norm((pixels - camera.intrinsics[None, :2, 2]) / focal[None, :], axis=1) < bound
    near = near_picture(camera, pixels, 1.0) & unfolded & (depth > NEAR)
    return jnp.where(near[:, None], distort(camera, pixels), jnp.nan), depth


@dataclass(frozen=True)
class PictureCamera:
    """A camera as a viewer gets it: its pictures smaller, and freed of their lens distortion.

    Here pixel (0, 0) is the left upper CORNER of the picture, as in Rerun.
    """

    name: str
    intrinsics: Float[np.ndarray, "3 3"]
    world_from_camera: Float[np.ndarray, "4 4"]
    scale: Float[np.ndarray, "2"]
    size: tuple[int, int]
    maps: tuple[np.ndarray, np.ndarray] | None
    """The maps with which `cv2.remap` undistorts the smaller picture; None without distortion."""

    def jpeg(self, image: UInt8[np.ndarray, "h w 3"]) -> bytes:
        """A picture (BGR) as recorded, made smaller and freed of distortion."""
        small = shrink(image, self.size)
        if self.maps is not None:
            small = cv2.remap(small, *self.maps, cv2.INTER_LINEAR)
        return cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 80])[1].tobytes()

    def pixels(self, pixels: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """Undistorted pixels of the picture as recorded, as pixels of the small one."""
        return (pixels + 0.5) * self.scale


def picture_camera(rig: CameraRig, name: str, picture_width: int) -> PictureCamera:
    """The camera `name`, its pictures at most `picture_width` pixels wide."""
    camera, (width, height) = rig.camera(name), rig.image_size(name)
    factor = min(1.0, picture_width / width)
    size = (round(factor * width), round(factor * height))
    scale = np.array(size, float) / (width, height)
    matrix = np.array(camera.intrinsics, float)
    matrix[:2, 2] += 0.5
    matrix[:2] *= scale[:, None]
    maps = None
    distortion = np.array(camera.distortion, float)
    fisheye = camera.fisheye is not None and bool(camera.fisheye)
    if distortion.any() or fisheye:
        centred = matrix - np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
        make, coefficients = cv2.initUndistortRectifyMap, distortion
        if fisheye:
            make, coefficients = cv2.fisheye.initUndistortRectifyMap, distortion[:4]
        x, y = make(centred, coefficients, np.eye(3), centred, size, cv2.CV_16SC2)
        maps = (x, y)
    pose = np.linalg.inv(np.array(camera.camera_from_world, float))
    return PictureCamera(name, matrix, pose, scale, size, maps)


def frame_range(recording: Recording, motions: Sequence[Motion]) -> tuple[int, int]:
    """[first, stop) of the frames from the motions' first to their last, by the recording's own numbers.

    Raises:
        InputError: the recording does not have them all.
    """
    first = min(int(motion.frame[0]) for motion in motions)
    stop = max(int(motion.frame[-1]) for motion in motions) + 1
    end = recording.first_frame + recording.num_frames
    if first < recording.first_frame or stop > end:
        raise InputError(
            f"{recording.path}: the motion has frames {first} to {stop - 1}, the recording "
            f"{recording.first_frame} to {end - 1}; give the recording that was tracked"
        )
    return first, stop
