"""What the cameras see at one time, as the energy takes it: image blobs, foreground around the body, keypoints.

Foreground is seen on small regular grids. An axis-aligned Gaussian is a product of one of x and one of y, so what all
blobs cover of a grid is a product of two small matrices: a few thousand exponentials a frame, and no lists of pairs
that hold only near a pose.
"""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.coloring import Coloring
from sogjax.energy.keypoint_views import KeypointViews
from sogjax.energy.neighbours import margins, near_pairs
from sogjax.energy.overlap import pair_color_similarities, self_overlaps
from sogjax.energy.pairs import SparsePairs
from sogjax.model.camera import Camera, cells_at, project
from sogjax.model.sog import Sog

COLUMNS, ROWS = 32, 48
"""Cells of a window. A standing person is about three times as tall as wide, and the box has a border."""


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
        """These windows, of which the cameras that have no picture say nothing."""
        return eqx.tree_at(lambda w: w.odds, self, jnp.where(present[:, None, None, None], self.odds, 0.0))


def windows_around(
    odds: Float[Array, "camera rows columns"],
    cell_sizes: Float[Array, "camera"],
    cameras: Camera,
    boxes: Float[Array, "camera actor 2 2"],
) -> Windows:
    """The log odds in boxes (undistorted pixels), from those of the cells of the pictures as recorded.

    A box is its lowest and highest x, y; an empty one says nothing. Sides of cells are in pixels.
    """
    real = jnp.all(boxes[..., 1, :] > boxes[..., 0, :], axis=-1) & jnp.all(jnp.isfinite(boxes), axis=(-2, -1))
    boxes = jnp.where(real[..., None, None], boxes, jnp.array([[[[0.0, 0.0], [1.0, 1.0]]]], boxes.dtype))
    step = (boxes[..., 1, :] - boxes[..., 0, :]) / jnp.array([[[COLUMNS, ROWS]]], boxes.dtype)
    along = lambda axis, places: boxes[..., 0, axis, None] + places[None, None, :] * step[..., axis, None]
    centres = lambda count, axis: along(axis, jnp.arange(count, dtype=boxes.dtype) + 0.5)
    x, y = centres(COLUMNS, 0), centres(ROWS, 1)
    of_window = jax.vmap(odds_on_grid, in_axes=(None, None, None, 0, 0))
    looked_at = jax.vmap(of_window)(odds, cell_sizes, cameras, x, y)
    return Windows(x, y, step, jnp.where(real[..., None, None], looked_at, 0.0))


def odds_on_grid(
    odds: Float[Array, "*cluster rows columns"],
    cell_size: Float[Array, ""],
    camera: Camera,
    x: Float[Array, "n"],
    y: Float[Array, "m"],
) -> Float[Array, "*cluster n m"]:
    """The log odds of cells of one camera at the places of a grid (undistorted pixels); 0 outside its picture."""
    shape = (x.shape[0], y.shape[0])
    pixels = jnp.stack([jnp.broadcast_to(x[:, None], shape), jnp.broadcast_to(y[None], shape)], axis=-1)
    cell, inside = cells_at(camera, cell_size, pixels.reshape(-1, 2))
    values = jnp.where(inside.reshape(*[1] * (odds.ndim - 2), -1), odds[..., cell[:, 1], cell[:, 0]], 0.0)
    return values.reshape(*odds.shape[:-2], *shape)


class Views(eqx.Module):
    """A stack of cameras and, for each, its image as a Sog."""

    cameras: Camera
    images: Sog
    color_similarities: Float[Array, "camera body image"]
    """d(c_i, c_j) of Eq. 7: it does not depend on the pose, so it is computed once per frame."""
    normalizers: Float[Array, "camera"]
    """E(K_l, K_l) of Eq. 9 over the whole image, before culling, in square pixels."""
    pairs: SparsePairs | None = None
    """The pairs that matter near some pose; None: all pairs are compared."""
    coloring: Coloring | None = None
    """How the similarities follow from colours; None: not by Eq. 7 alone, so nothing is differentiated by colours."""
    windows: Windows | None = None
    """Foreground against background around the body; None: no background is known."""
    keypoints: KeypointViews | None = None
    """What detectors saw; None: nothing is known of that."""
    caps: Float[Array, "camera image"] | None = None
    """What of each image blob is left to be explained (Eq. 8), square pixels; None: all of it."""

    @classmethod
    def from_images(
        cls,
        cameras: Camera,
        images: Sog,
        body: Sog,
        normalizers: Float[Array, "camera"],
        space: str,
        color_radius: Float[Array, ""],
    ) -> "Views":
        """Compare the colours of a body's blobs with every image; all colours are in `space`."""
        compare = lambda image: pair_color_similarities(image, body, space, color_radius)
        coloring = Coloring(color_radius, space, body_colors=body.colors)
        return cls(cameras, images, jax.vmap(compare)(images), normalizers, coloring=coloring)

    def near(self, blobs: Sog, exponent: Float[Array, ""], capacity: int) -> tuple["Views", Int[Array, ""]]:
        """These views with only the pairs that matter near `blobs` (world), and how many blocks those are.

        Raises:
            ValueError: the similarities do not follow from colours.
        """
        seen = jax.vmap(project, in_axes=(0, None))(self.cameras, blobs)
        pairs, count = self.near_seen(seen, exponent, capacity)
        return replace(self, pairs=pairs), count

    def near_seen(self, seen: Sog, exponent: Float[Array, ""], capacity: int) -> tuple[SparsePairs, Int[Array, ""]]:
        """The pairs that matter near projected blobs, and how many blocks those are.

        Raises:
            ValueError: the similarities do not follow from colours.
        """
        if self.coloring is None:
            raise ValueError("near pairs are listed by their colours, which these views do not have (Views.coloring)")
        return near_pairs(self.images, self.coloring, seen, margins(self.cameras), exponent, capacity)

    @property
    def unexplained(self) -> Float[Array, "camera image"]:
        """Caps of Eq. 8 of the image blobs."""
        return self_overlaps(self.images) if self.caps is None else self.caps

    def image_caps(self, pairs: SparsePairs) -> Float[Array, "camera image"]:
        """Caps of Eq. 8 of the image blobs that pairs count, which fill whole tiles."""
        extra = pairs.image_shape[1] - self.images.capacity
        return jnp.pad(self.unexplained, ((0, 0), (0, extra)))


def whole_image_overlap(image_sizes: Float[Array, "*camera 2"]) -> Float[Array, "*camera"]:
    """E(K_l, K_l): the sum of pi sigma_i^2 over a quad-tree that tiles the image, (pi/4) x its area."""
    return jnp.pi / 4.0 * image_sizes[..., 0] * image_sizes[..., 1]
