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

    A pixel is NaN behind a camera and far outside its picture, where a lens model means nothing.
    """
    cameras = jax.tree.map(lambda leaf: leaf if leaf.dtype == bool else leaf.astype(jnp.float32), rig.cameras)
    flat = points.reshape(-1, 3).astype(np.float32)
    pixels = np.empty((len(rig), len(flat), 2), np.float32)
    depths = np.empty((len(rig), len(flat)), np.float32)
    for start in range(0, len(flat), POINTS_AT_ONCE):
        part = flat[start : start + POINTS_AT_ONCE]
        padded = np.pad(part, ((0, POINTS_AT_ONCE - len(part)), (0, 0)))
        where, depth = _project(cameras, jnp.asarray(padded))
        pixels[:, start : start + len(part)] = np.asarray(where)[:, : len(part)]
        depths[:, start : start + len(part)] = np.asarray(depth)[:, : len(part)]
    shape = (len(rig), *points.shape[:2])
    return pixels.reshape(*shape, 2), depths.reshape(shape)


@eqx.filter_jit
def _project(
    cameras: Camera, points: Float[Array, "n 3"]
) -> tuple[Float[Array, "camera n 2"], Float[Array, "camera n"]]:
    return cast(tuple[Array, Array], jax.vmap(_project_one, in_axes=(0, None))(cameras, points))


def _project_one(camera: Camera, points: Float[Array, "n 3"]) -> tuple[Float[Array, "n 2"], Float[Array, "n"]]:
    pixels, depth = project_points(camera, points)
    near = near_picture(camera, pixels, 1.0) & (depth > NEAR)
    return jnp.where(near[:, None], distort(camera, pixels), jnp.nan), depth
