"""What pictures say about where projected blobs should be."""

from typing import NamedTuple

from jaxtyping import Array, Float


class ImagePulls(NamedTuple):
    """A value of each camera and how it changes with the projected body blobs."""

    value: Float[Array, "*camera"]
    by_mean: Float[Array, "*camera body 2"]
    by_sigma: Float[Array, "*camera body"]
    stiffness: Float[Array, "*camera body"]
    """The curvature of the value by a mean with its sign turned; the same in both directions, never below 0."""
