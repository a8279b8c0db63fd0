"""Points of whole motions in the pictures of all cameras, lens distortion included."""

from typing import cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.data.calibration import CameraRig
from sogjax.model.camera import NEAR, Camera, distort, near_picture, project_points

POINTS_AT_ONCE = 8192
"""Every motion is projected in blocks of this size, so that the projection is compiled once for a rig."""


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
    """By camera the tangent of the angle from its axis up to which its polynomial model grows; farther out it folds.

    Infinity where it never folds, and for fisheye cameras.
    """
    radii = np.full(len(rig), np.inf)
    for k, (k1, k2, _, _, k3) in enumerate(np.asarray(rig.cameras.distortion, float)):
        slope = np.roots([7.0 * k3, 5.0 * k2, 3.0 * k1, 1.0])  # of r (1 + k1 r^2 + k2 r^4 + k3 r^6), in r^2
        folds = slope.real[(np.abs(slope.imag) < 1e-9) & (slope.real > 0)]
        if len(folds) and not rig.is_fisheye(rig.names[k]):
            radii[k] = np.sqrt(folds.min())
    return radii


@eqx.filter_jit
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
