"""Overlap of a projected body with an image, both Sums of Gaussians (Eq. 5, 6, 8).

Pair matrices have the layout (body blob, image blob). The gradient of `capped_overlap` is computed together with
its value from the closed form, which costs little more than the value: its exponentials are the expensive part and
are shared. `gradient="autodiff"` differentiates the plain formula instead.
"""

from functools import partial
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.model.color import color_similarity
from sogjax.model.sog import Sog

GradientMode = Literal["forward", "autodiff"]
Pairs = Float[Array, "body image"]

EXACT_EXPONENT = 0.5
"""Eq. 6 as Eq. 2 implies it: exp(-|d|^2 / (2 (si^2 + sj^2)))."""
PRINTED_EXPONENT = 1.0
"""Eq. 6 as printed, without the 1/2."""


def pair_color_similarities(image: Sog, body: Sog, space: str, color_radius: Float[Array, ""]) -> Pairs:
    """d(c_i, c_j) of Eq. 7 for every pair; 0 where either blob is padding. Both Sogs' colours are in `space`."""
    similarities = color_similarity(image.colors[None, :, :], body.colors[:, None, :], space, color_radius)
    return jnp.where(image.mask[None, :] & body.mask[:, None], similarities, 0.0)


def overlaps(image: Sog, body: Sog, color_similarities: Pairs, exponent: Float[Array, ""]) -> Pairs:
    """E_ij of Eq. 6 in square pixels; `body` is projected (2-D). Blobs masked out overlap nothing."""
    variance_sum, squared_distance = _pair_geometry(image, body)
    body_variance = jnp.where(body.mask, body.sigmas, 0.0) ** 2
    image_variance = jnp.where(image.mask, image.sigmas, 0.0) ** 2
    variance_product = body_variance[:, None] * image_variance[None, :]
    amplitude = color_similarities * (2.0 * jnp.pi) * variance_product / variance_sum
    return amplitude * jnp.exp(-exponent * squared_distance / variance_sum)


def self_overlaps(image: Sog) -> Float[Array, "image"]:
    """E_ii = pi sigma_i^2: the most that an image blob can contribute (Eq. 8)."""
    return jnp.pi * image.sigmas**2


def capped_overlap(
    image: Sog,
    body: Sog,
    color_similarities: Pairs,
    exponent: Float[Array, ""],
    *,
    capped: bool = True,
    gradient: GradientMode = "forward",
) -> Float[Array, ""]:
    """Similarity of a projected body with one image (Eq. 8), in square pixels.

    The cap is a kink: the gradient is defined as 0 where the sum reaches it. `capped=False` gives Eq. 5, which
    counts body blobs that hide each other several times.
    """
    if gradient == "autodiff":
        return _capped_overlap(capped, image, body, color_similarities, exponent)
    return _capped_overlap_forward(capped, image, body, color_similarities, exponent)


def _capped_overlap(
    capped: bool, image: Sog, body: Sog, color_similarities: Pairs, exponent: Float[Array, ""]
) -> Float[Array, ""]:
    total = jnp.sum(overlaps(image, body, color_similarities, exponent), axis=0)
    return jnp.sum(_apply_cap(total, image, capped))


def _apply_cap(total: Float[Array, "image"], image: Sog, capped: bool) -> Float[Array, "image"]:
    if not capped:
        return total
    caps = self_overlaps(image)
    return jnp.where(total < caps, total, caps)


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def _capped_overlap_forward(
    capped: bool, image: Sog, body: Sog, color_similarities: Pairs, exponent: Float[Array, ""]
) -> Float[Array, ""]:
    return _capped_overlap(capped, image, body, color_similarities, exponent)


def _value_and_residuals(capped, image, body, color_similarities, exponent):
    pairs = overlaps(image, body, color_similarities, exponent)
    total = jnp.sum(pairs, axis=0)
    value = jnp.sum(_apply_cap(total, image, capped))
    live = (total < self_overlaps(image)) if capped else jnp.ones_like(total, dtype=bool)
    gradients = _body_gradients(image, body, jnp.where(live[None, :], pairs, 0.0), exponent)
    return value, (gradients, image, body, color_similarities, exponent)


def _body_gradients(
    image: Sog, body: Sog, live_pairs: Pairs, exponent: Float[Array, ""]
) -> tuple[Float[Array, "body 2"], Float[Array, "body"]]:
    """Derivatives by the means and sigmas of the projected body blobs, from the pairs below the cap."""
    variance_sum, squared_distance = _pair_geometry(image, body)
    weights = live_pairs / variance_sum
    # Sums over the image axis as one matrix product: sum_i w (mu_i - mu_j), sum_i w, sum_i w sigma_i^2.
    origin = body.means[0]
    centred = image.means - origin[None, :]
    columns = jnp.concatenate([centred, jnp.ones_like(centred[:, :1]), (image.sigmas**2)[:, None]], axis=1)
    sums = jnp.matmul(weights, columns, precision="highest")
    pull = sums[:, :2] - (body.means - origin[None, :]) * sums[:, 2:3]
    spread = jnp.sum(weights * squared_distance / variance_sum, axis=1)
    by_mean = 2.0 * exponent * pull
    by_sigma = 2.0 * (sums[:, 3] / _safe_sigmas(body) + exponent * spread * body.sigmas)
    return by_mean, by_sigma


def _pull_back(capped, residuals, cotangent):
    (by_mean, by_sigma), image, body, color_similarities, exponent = residuals
    # What nobody asks for (the gradient by the image, the colours) is dropped when the caller is compiled.
    plain = partial(_capped_overlap, capped)
    _, pull_back = jax.vjp(plain, image, body, color_similarities, exponent)
    by_image, by_body, by_similarity, by_exponent = pull_back(cotangent)
    # Not `Sog(...)`: the cotangent of a mask is no array of truth values.
    by_body = eqx.tree_at(lambda sog: (sog.means, sog.sigmas), by_body, (cotangent * by_mean, cotangent * by_sigma))
    return by_image, by_body, by_similarity, by_exponent


_capped_overlap_forward.defvjp(_value_and_residuals, _pull_back)


def _pair_geometry(image: Sog, body: Sog) -> tuple[Pairs, Pairs]:
    """Sums of the variances and squared distances of the centres, for every pair."""
    variance_sum = (_safe_sigmas(body) ** 2)[:, None] + (_safe_sigmas(image) ** 2)[None, :]
    dx = image.means[None, :, 0] - body.means[:, None, 0]
    dy = image.means[None, :, 1] - body.means[:, None, 1]
    return variance_sum, dx * dx + dy * dy


def _safe_sigmas(sog: Sog) -> Float[Array, "blob"]:
    """The sigmas, and 1 in the padding, where a 0 would divide by 0."""
    return jnp.where(sog.mask, sog.sigmas, 1.0)
