"""Points of whole motions in the pictures of all cameras, lens distortion included."""

from typing import cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.data.calibration import CameraRig
from sogjax.model.camera import NEAR, Camera, distort, project_points

FRAMES_AT_ONCE = 256


def picture_points(
    rig: CameraRig, points: Float[np.ndarray, "frame point 3"]
) -> tuple[Float[np.ndarray, "camera frame point 2"], Float[np.ndarray, "camera frame point"]]:
    """Pixels of the pictures as recorded, and depths in metres.

    A pixel is NaN behind a camera and far outside its picture, where a lens model means nothing.
    """
    cameras = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), rig.cameras)
    num_frames, num_points, _ = points.shape
    pixels = np.empty((len(rig.names), num_frames, num_points, 2), np.float32)
    depths = np.empty(pixels.shape[:-1], np.float32)
    for start in range(0, num_frames, FRAMES_AT_ONCE):
        part = slice(start, start + FRAMES_AT_ONCE)
        flat = jnp.asarray(points[part].reshape(-1, 3), jnp.float32)
        where, depth = _project(cameras, flat)
        pixels[:, part] = np.asarray(where).reshape(len(rig.names), -1, num_points, 2)
        depths[:, part] = np.asarray(depth).reshape(len(rig.names), -1, num_points)
    return pixels, depths


@eqx.filter_jit
def _project(
    cameras: Camera, points: Float[Array, "n 3"]
) -> tuple[Float[Array, "camera n 2"], Float[Array, "camera n"]]:
    return cast(tuple[Array, Array], jax.vmap(_project_one, in_axes=(0, None))(cameras, points))


def _project_one(camera: Camera, points: Float[Array, "n 3"]) -> tuple[Float[Array, "n 2"], Float[Array, "n"]]:
    pixels, depth = project_points(camera, points)
    size = camera.image_size[None, :]
    near = jnp.all((pixels > -size) & (pixels < 2.0 * size), axis=1) & (depth > NEAR)
    return jnp.where(near[:, None], distort(camera, pixels), jnp.nan), depth
