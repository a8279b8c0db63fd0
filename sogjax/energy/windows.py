"""Foreground against background around a body: small regular grids, which Gaussians cover as products of rows.

An axis-aligned Gaussian is a product of one of x and one of y, so what all blobs cover of a grid is a product of two
small matrices: a few thousand exponentials a frame, and no lists of pairs that hold only near a pose.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from sogjax.model.camera import Camera, distort, near_picture

COLUMNS, ROWS = 32, 48
"""Cells of a window. A standing person is about three times as tall as wide, and the box has a border."""
_BEYOND = 0.2
"""Of the picture's size, outside it, where the lens model still means something."""


class Windows(eqx.Module):
    """A grid around each actor in each camera, undistorted pixels."""

    x: Float[Array, "*camera window column"]
    """Centres of the cells."""
    y: Float[Array, "*camera window row"]
    step: Float[Array, "*camera window 2"]
    """Width and height of a cell."""
    odds: Float[Array, "*camera window column row"]
    """Log odds of foreground against background; 0 where nothing is known."""

    @property
    def areas(self) -> Float[Array, "*camera window"]:
        """E_ii of Eq. 8 of a cell: (pi/4) times its area."""
        return jnp.pi / 4.0 * self.step[..., 0] * self.step[..., 1]

    def of_present(self, present: Bool[Array, "camera"]) -> "Windows":
        """The same, of which the cameras that have no picture say nothing."""
        return eqx.tree_at(lambda w: w.odds, self, jnp.where(present[:, None, None, None], self.odds, 0.0))


def windows_around(
    odds: Float[Array, "camera rows columns"],
    cell_sizes: Float[Array, "camera"],
    cameras: Camera,
    boxes: Float[Array, "camera actor 2 2"],
) -> Windows:
    """The log odds in boxes (undistorted pixels), from those of the cells of the pictures as recorded.

    Args:
        odds: of every cell.
        cell_sizes: their sides, pixels.
        cameras: that recorded them.
        boxes: lowest and highest x, y; an empty one says nothing.
    """
    real = jnp.all(boxes[..., 1, :] > boxes[..., 0, :], axis=-1) & jnp.all(jnp.isfinite(boxes), axis=(-2, -1))
    boxes = jnp.where(real[..., None, None], boxes, jnp.array([[[[0.0, 0.0], [1.0, 1.0]]]], boxes.dtype))
    step = (boxes[..., 1, :] - boxes[..., 0, :]) / jnp.array([[[COLUMNS, ROWS]]], boxes.dtype)
    along = lambda axis, places: boxes[..., 0, axis, None] + places[None, None, :] * step[..., axis, None]
    centres = lambda count, axis: along(axis, jnp.arange(count, dtype=boxes.dtype) + 0.5)
    x, y = centres(COLUMNS, 0), centres(ROWS, 1)
    looked_at = jax.vmap(_looked_at)(odds, cell_sizes, cameras, x, y)
    return Windows(x, y, step, jnp.where(real[..., None, None], looked_at, 0.0))


def _looked_at(
    odds: Float[Array, "rows columns"],
    cell_size: Float[Array, ""],
    camera: Camera,
    x: Float[Array, "window n"],
    y: Float[Array, "window m"],
) -> Float[Array, "window n m"]:
    """The log odds at the places of a grid in one camera; 0 outside its picture."""
    shape = (*x.shape, y.shape[-1])
    pixels = jnp.stack(
        [jnp.broadcast_to(x[:, :, None], shape), jnp.broadcast_to(y[:, None, :], shape)], axis=-1
    ).reshape(-1, 2)
    recorded = distort(camera, pixels)
    inside = jnp.all((recorded > -0.5) & (recorded < camera.image_size[None, :] - 0.5), axis=1)
    inside &= near_picture(camera, pixels, _BEYOND)
    cell = jnp.floor((jnp.where(inside[:, None], recorded, 0.0) + 0.5) / cell_size).astype(jnp.int32)
    return jnp.where(inside, odds[cell[:, 1], cell[:, 0]], 0.0).reshape(shape)
