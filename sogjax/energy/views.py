"""What the cameras see at one time, as the energy takes it."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from sogjax.energy.coloring import Coloring
from sogjax.energy.keypoint_views import KeypointViews
from sogjax.energy.neighbours import margins, near_pairs
from sogjax.energy.overlap import pair_color_similarities, self_overlaps
from sogjax.energy.pairs import SparsePairs
from sogjax.energy.windows import Windows
from sogjax.model.camera import Camera, project
from sogjax.model.sog import Sog


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
        return cls(cameras, images, jax.vmap(compare)(images), normalizers, coloring=Coloring(color_radius, space))

    def near(self, blobs: Sog, exponent: Float[Array, ""], capacity: int) -> tuple["Views", Int[Array, ""]]:
        """The same views with only the pairs that matter near `blobs` (world), and how many blocks those are."""
        seen = jax.vmap(project, in_axes=(0, None))(self.cameras, blobs)
        pairs, count = near_pairs(self.images, self.color_similarities, seen, margins(self.cameras), exponent, capacity)
        return replace(self, pairs=pairs), count

    def image_caps(self, pairs: SparsePairs) -> Float[Array, "camera image"]:
        """Caps of Eq. 8 of the image blobs that pairs count, which fill whole tiles."""
        extra = pairs.image_shape[1] - self.images.capacity
        return jnp.pad(self_overlaps(self.images), ((0, 0), (0, extra)))


def whole_image_overlap(image_sizes: Float[Array, "*camera 2"]) -> Float[Array, "*camera"]:
    """E(K_l, K_l): the sum of pi sigma_i^2 over a quad-tree that tiles the image, (pi/4) x its area."""
    return jnp.pi / 4.0 * image_sizes[..., 0] * image_sizes[..., 1]
