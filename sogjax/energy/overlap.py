"""Overlap of a projected body with images, both Sums of Gaussians (Eq. 5, 6, 8), over any layout of their pairs.

The derivative of `capped_overlap` is computed together with its value from the closed form, which costs little more
than the value: its exponentials are the expensive part and are shared. Forward mode, reverse mode and second
derivatives follow from it. `gradient="autodiff"` differentiates the plain formula instead.
"""

from functools import partial
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Float

from sogjax.energy.pairs import DensePairs, Disks, Pairs, separations
from sogjax.model.color import color_similarity
from sogjax.model.sog import Sog


class ImagePulls(NamedTuple):
    """A value of each camera and how it changes with the projected body blobs."""

    value: Float[Array, "*camera"]
    by_mean: Float[Array, "*camera body 2"]
    by_sigma: Float[Array, "*camera body"]
    stiffness: Float[Array, "*camera body"]
    """The curvature of the value by a mean with its sign turned; the same in both directions, never below 0."""


GradientMode = Literal["forward", "autodiff"]

EXACT_EXPONENT = 0.5
"""Eq. 6 as Eq. 2 implies it: `exp(-|d|^2 / (2 (si^2 + sj^2)))`."""
PRINTED_EXPONENT = 1.0
"""Eq. 6 as printed, without the 1/2."""


def pair_color_similarities(
    image: Sog, body: Sog, space: str, color_radius: Float[Array, ""]
) -> Float[Array, "body image"]:
    """d(c_i, c_j) of Eq. 7 for every pair; 0 where either blob is padding. Both Sogs' colours are in `space`."""
    similarities = color_similarity(image.colors[None, :, :], body.colors[:, None, :], space, color_radius)
    return jnp.where(image.mask[None, :] & body.mask[:, None], similarities, 0.0)


def overlaps(
    image: Sog, body: Sog, color_similarities: Float[Array, "body image"], exponent: Float[Array, ""]
) -> Float[Array, "body image"]:
    """E_ij of Eq. 6 in square pixels; `body` is projected (2-D). Blobs masked out overlap nothing."""
    return _overlaps_and_weights(DensePairs.from_image(image, color_similarities), body, exponent)[0]


def self_overlaps(image: Sog) -> Float[Array, "*camera image"]:
    """E_ii = pi sigma_i^2: the most that an image blob can contribute (Eq. 8)."""
    return jnp.pi * image.sigmas**2


def capped_overlap(
    image: Sog,
    body: Sog,
    color_similarities: Float[Array, "body image"],
    exponent: Float[Array, ""],
    *,
    capped: bool = True,
    gradient: GradientMode = "forward",
) -> Float[Array, ""]:
    """Similarity of a projected body with one image (Eq. 8) over all pairs, in square pixels.

    The cap is a kink: the gradient is defined as 0 where the sum reaches it. `capped=False` gives Eq. 5, which
    counts body blobs that hide each other several times.
    """
    pairs = DensePairs.from_image(image, color_similarities)
    return overlap_of_pairs(pairs, self_overlaps(image), body, exponent, capped=capped, gradient=gradient)


def overlap_of_pairs(
    pairs: Pairs,
    caps: Float[Array, "*camera image"],
    body: Sog,
    exponent: Float[Array, ""],
    *,
    capped: bool = True,
    gradient: GradientMode = "forward",
) -> Float[Array, "*camera"]:
    """Eq. 8 over a layout of pairs; `caps` are the self overlaps of the image blobs."""
    if gradient == "autodiff":
        return _plain_overlap(capped, pairs, caps, body, exponent)
    return _forward_overlap(capped, pairs, caps, body, exponent)


def overlap_pulls(
    pairs: Pairs, caps: Float[Array, "*camera image"], body: Sog, exponent: Float[Array, ""], *, capped: bool = True
) -> ImagePulls:
    """Eq. 8 with its derivatives by the projected body blobs, image blobs at the cap left out, and its curvature.

    The stiffness is 2 k sum_i E_ij / (si^2 + sj^2): the weights E_ij are held fixed.
    """
    disks = _disks(body)
    total, weights = pairs.totals(_overlaps_and_weights, body, exponent)
    live = (total < caps) if capped else jnp.ones_like(total, dtype=bool)
    moments = pairs.moments(live, weights, disks)
    return ImagePulls(
        value=jnp.sum(_apply_cap(total, caps, capped), axis=-1),
        by_mean=2.0 * exponent * moments.away,
        by_sigma=2.0 * (moments.variance / _safe_sigmas(body) + exponent * moments.spread * body.sigmas),
        stiffness=2.0 * exponent * moments.weight,
    )


def _overlaps_and_weights(pairs: Pairs, body: Sog, exponent: Float[Array, ""]) -> tuple[Array, Array]:
    """E_ij of Eq. 6, the one place where it stands, and E_ij / (si^2 + sj^2)."""
    disks = _disks(body)
    gaps = separations(pairs, disks)
    inverse = 1.0 / gaps.variance_sum
    amplitudes = pairs.amplitudes * pairs.of_body(disks.variances) * inverse
    overlaps = amplitudes * jnp.exp(-exponent * gaps.squared_distance * inverse)
    return overlaps, overlaps * inverse


def _disks(body: Sog) -> Disks:
    return Disks(body.means, jnp.where(body.mask, body.sigmas, 0.0) ** 2)


def _plain_overlap(
    capped: bool, pairs: Pairs, caps: Float[Array, "*camera image"], body: Sog, exponent: Float[Array, ""]
) -> Float[Array, "*camera"]:
    total, _ = pairs.totals(_overlaps_and_weights, body, exponent)
    return jnp.sum(_apply_cap(total, caps, capped), axis=-1)


def _apply_cap(
    total: Float[Array, "*camera image"], caps: Float[Array, "*camera image"], capped: bool
) -> Float[Array, "*camera image"]:
    return jnp.where(total < caps, total, caps) if capped else total


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def _forward_overlap(
    capped: bool, pairs: Pairs, caps: Float[Array, "*camera image"], body: Sog, exponent: Float[Array, ""]
) -> Float[Array, "*camera"]:
    return _plain_overlap(capped, pairs, caps, body, exponent)


def _value_and_rate(capped, primals, tangents):
    """The rate comes in closed form by the body's means and sigmas, from the plain formula by anything else."""
    pulls = overlap_pulls(*primals, capped=capped)
    pairs, caps, body, exponent = tangents
    rate = jnp.zeros_like(pulls.value)
    if not isinstance(body.means, SymbolicZero):
        rate = rate + jnp.sum(pulls.by_mean * body.means, axis=(-2, -1))
    if not isinstance(body.sigmas, SymbolicZero):
        rate = rate + jnp.sum(pulls.by_sigma * body.sigmas, axis=-1)
    rates = jax.tree.leaves((pairs, caps, exponent))
    changing = [not isinstance(leaf, SymbolicZero) and leaf.dtype != jax.dtypes.float0 for leaf in rates]
    return pulls.value, rate + _plain_rate(capped, primals, rates, changing) if any(changing) else rate


def _plain_rate(capped: bool, primals: Any, rates: list[Any], changing: list[bool]) -> Float[Array, "*camera"]:
    """How fast the plain formula changes with those leaves of pairs, caps and exponent that do."""
    pairs, caps, body, exponent = primals
    leaves, structure = jax.tree.flatten((pairs, caps, exponent))

    def overlap(moving: list[Array]) -> Float[Array, "*camera"]:
        moved = iter(moving)
        rebuilt = [next(moved) if changes else leaf for leaf, changes in zip(leaves, changing, strict=True)]
        pairs, caps, exponent = jax.tree.unflatten(structure, rebuilt)
        return _plain_overlap(capped, pairs, caps, body, exponent)

    chosen = lambda values: [value for value, changes in zip(values, changing, strict=True) if changes]
    return jax.jvp(overlap, (chosen(leaves),), (chosen(rates),))[1]


_forward_overlap.defjvp(_value_and_rate, symbolic_zeros=True)


def _safe_sigmas(sog: Sog) -> Float[Array, "*camera blob"]:
    """The sigmas, and 1 in the padding, where a 0 would divide by 0."""
    return jnp.where(sog.mask, sog.sigmas, 1.0)
