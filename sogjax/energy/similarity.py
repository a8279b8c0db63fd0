"""Similarity of a posed body with the pictures (Eq. 9), with the curvature of its springs.

Each image blob that is not at its cap pulls at the body blobs it resembles, as a spring whose stiffness is the weight
of the pair at the current pose. Springs only ever hold: the curvature is positive semi-definite wherever the pose is.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.coloring import colored_pairs, colored_similarities
from sogjax.energy.image_term import ImageTerm
from sogjax.energy.overlap import (
    EXACT_EXPONENT,
    GradientMode,
    ImagePulls,
    overlap_of_pairs,
    overlap_pulls,
)
from sogjax.energy.pairs import DensePairs
from sogjax.energy.posed import Frame, Posed
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.model.camera import project
from sogjax.model.sog import Sog


class Similarity(ImageTerm):
    """E(Theta) of Eq. 9: the mean over the cameras of the normalised similarity."""

    exponent: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=EXACT_EXPONENT)
    """k of Eq. 6: `EXACT_EXPONENT` or `PRINTED_EXPONENT`."""
    capped: bool = eqx.field(static=True, default=True)
    """Eq. 8; False: Eq. 5, in which blobs that hide each other count several times."""
    gradient: GradientMode = eqx.field(static=True, default="forward")

    def value(self, posed: Posed, frame: Frame) -> Float[Array, ""]:
        """The similarity of the posed blobs with all pictures."""
        return self.of_blobs(posed.blobs, frame.views)

    def of_blobs(self, blobs: Sog, views: Views) -> Float[Array, ""]:
        """The similarity of blobs in the world, which need not be a body's."""
        seen = jax.vmap(project, in_axes=(0, None))(views.cameras, blobs)
        modes = {"capped": self.capped, "gradient": self.gradient}
        if views.pairs is not None:
            pairs = colored_pairs(views.pairs, views.coloring, blobs.colors, views.images)
            overlap = overlap_of_pairs(pairs, views.image_caps(pairs), seen, self.exponent, **modes)
            return jnp.mean(overlap / views.normalizers)
        similarities = colored_similarities(views.color_similarities, views.coloring, blobs.colors, views.images)

        def one_camera(image: Sog, caps: Float[Array, "image"], seen: Sog, similar: Array) -> Float[Array, ""]:
            return overlap_of_pairs(DensePairs.from_image(image, similar), caps, seen, self.exponent, **modes)

        overlap = jax.vmap(one_camera)(views.images, views.unexplained, seen, similarities)
        return jnp.mean(overlap / views.normalizers)

    def pulls(self, posed: Posed, seen: Sog, frame: Frame) -> ImagePulls:
        """Pulls of the image blobs at the projected body blobs, for each camera; the exponentials computed once."""
        views = _colored(frame.views, posed.blobs.colors)
        if views.pairs is not None:
            caps = views.image_caps(views.pairs)
            return overlap_pulls(views.pairs, caps, seen, self.exponent, capped=self.capped)

        def one_camera(image: Sog, caps: Float[Array, "image"], similar: Array, seen: Sog) -> ImagePulls:
            pairs = DensePairs.from_image(image, similar)
            return overlap_pulls(pairs, caps, seen, self.exponent, capped=self.capped)

        return jax.vmap(one_camera)(views.images, views.unexplained, views.color_similarities, seen)


def _colored(views: Views, body_colors: Float[Array, "blob 3"]) -> Views:
    """The views with similarities that have derivatives by the colours."""
    if views.pairs is not None:
        pairs = colored_pairs(views.pairs, views.coloring, body_colors, views.images)
        return eqx.tree_at(lambda v: v.pairs, views, pairs)
    similarities = colored_similarities(views.color_similarities, views.coloring, body_colors, views.images)
    return eqx.tree_at(lambda v: v.color_similarities, views, similarities)


def similarity_among(terms: Terms) -> Similarity:
    """The similarity of an energy.

    Raises:
        ValueError: the energy has none.
    """
    found = [term for term in terms if isinstance(term, Similarity)]
    if not found:
        raise ValueError("this needs a Similarity among the terms of the energy")
    return found[0]
