"""The colours that similarities follow from: those of listed pairs, and derivatives by colours.

Eq. 7 does not depend on the pose, so its values are computed once per frame and only looked up while a pose is found.
They still are functions of the colours: differentiating by the colours of blobs, or by eps_sim, gives the derivatives
of Eq. 7, which are computed only then.
"""

from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Float, Int

from sogjax.energy.pairs import TILE, SparsePairs
from sogjax.model.color import color_similarity, distance_of_planes, from_rgb, wendland
from sogjax.model.sog import Sog


class Coloring(eqx.Module):
    """How similarities follow from colours (Eq. 7)."""

    radius: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    """eps_sim."""
    space: str = eqx.field(static=True)
    """The colour space of the images; a body's colours are sRGB."""
    weights: Float[Array, "camera image"] | None = None
    """What similarities are multiplied by, the same for all body blobs; None: 1."""
    body_colors: Float[Array, "body 3"] | None = None
    """The colours of the body's blobs in `space`; None: unknown, so that no pairs can be listed."""
    depths: Float[Array, "camera body"] | None = None
    """Of the body's blobs (metres), where something may hide them; None: nothing does."""
    hidden_from: Float[Array, "camera image"] | None = None
    """Depth from which on a body's blobs are hidden where an image blob is; None: nothing is hidden."""

    @property
    def known_body_colors(self) -> Float[Array, "body 3"]:
        """The colours of the body's blobs.

        Raises:
            ValueError: they are not known.
        """
        if self.body_colors is None:
            raise ValueError("near pairs are listed by the colours of the body's blobs, which Coloring does not have")
        return self.body_colors

    def of_listed(
        self, images: Sog, tile_index: Int[Array, "block"], body_index: Int[Array, "member block"]
    ) -> Float[Array, "member slot block"]:
        """The similarities of listed pairs (see `SparsePairs`), with their weights; image blobs fill whole tiles."""
        of_body, extra = self.known_body_colors, images.capacity - _num_images(self, images)
        slots = jnp.arange(TILE, dtype=tile_index.dtype)[:, None]
        places = tile_index[None, :] * TILE + slots
        of_image = lambda values: jnp.pad(values, ((0, 0), (0, extra))).reshape(-1)[places][None]
        body = body_index % of_body.shape[0]
        apart = [images.colors[..., k].reshape(-1)[places][None] - of_body[:, k][body][:, None] for k in range(3)]
        similarities = wendland(distance_of_planes(apart, self.space) / self.radius)
        if self.depths is not None and self.hidden_from is not None:
            shown = self.depths.reshape(-1)[body_index][:, None] < of_image(self.hidden_from)
            similarities = jnp.where(shown, similarities, 0.0)
        return similarities if self.weights is None else similarities * of_image(self.weights)


def _num_images(coloring: Coloring, images: Sog) -> int:
    """How many image blobs the weights are of, which do not fill whole tiles."""
    known = [table for table in (coloring.weights, coloring.hidden_from) if table is not None]
    return known[0].shape[1] if known else images.capacity


def colored_similarities(
    similarities: Float[Array, "camera body image"],
    coloring: Coloring | None,
    body_colors: Float[Array, "body 3"],
    images: Sog,
) -> Float[Array, "camera body image"]:
    """The similarities as they are, but with derivatives by the colours."""
    space, radius, weights = _parts(coloring)
    return _following(_all_pairs, space, similarities, (body_colors, images.colors, radius), (None, weights))


def colored_pairs(
    pairs: SparsePairs, coloring: Coloring | None, body_colors: Float[Array, "body 3"], images: Sog
) -> SparsePairs:
    """The pairs as they are, but their amplitudes with derivatives by the colours."""
    space, radius, weights = _parts(coloring)
    extra = pairs.image_shape[1] - images.capacity
    image_colors = jnp.pad(images.colors, ((0, 0), (0, extra), (0, 0)))
    weights = None if weights is None else jnp.pad(weights, ((0, 0), (0, extra)))
    colors = (body_colors, image_colors, radius)
    amplitudes = _following(_listed_pairs, space, pairs.amplitudes, colors, (pairs, weights))
    return eqx.tree_at(lambda p: p.amplitudes, pairs, amplitudes)


def _parts(coloring: Coloring | None) -> tuple[str | None, Array | None, Array | None]:
    """Space, radius and weights, where they are known."""
    return (None, None, None) if coloring is None else (coloring.space, coloring.radius, coloring.weights)


def _all_pairs(space: str, colors: Any, fixed: Any) -> Float[Array, "camera body image"]:
    """Eq. 7 for all pairs, with their weights."""
    body_colors, image_colors, radius = colors
    similarities = color_similarity(image_colors[:, None], from_rgb(body_colors, space)[None, :, None], space, radius)
    return similarities if fixed[1] is None else similarities * fixed[1][:, None, :]


def _listed_pairs(space: str, colors: Any, fixed: Any) -> Float[Array, "member slot block"]:
    """The amplitudes of listed pairs."""
    body_colors, image_colors, radius = colors
    pairs, weights = fixed
    of_body = from_rgb(body_colors, space)[pairs.body_index % pairs.body_shape[1]]
    slots = jnp.arange(TILE, dtype=pairs.tile_index.dtype)[:, None]
    of_image = pairs.tile_index[None, :] * TILE + slots
    similarities = color_similarity(image_colors.reshape(-1, 3)[of_image][None], of_body[:, None], space, radius)
    scale = 2.0 * jnp.pi * pairs.variances
    return similarities * (scale if weights is None else scale * weights.reshape(-1)[of_image][None])


@partial(jax.custom_jvp, nondiff_argnums=(0, 1))
def _following(function: Any, space: str | None, stored: Array, colors: Any, fixed: Any) -> Array:
    """What is stored of `function(space, colors, fixed)`, differentiated by the colours as it is; 0 stays 0."""
    return stored


def _rates(function, space, primals, tangents):
    stored, colors, fixed = primals
    stored_rate, color_rates, _ = tangents
    solid = lambda rate, like: jnp.zeros_like(like) if isinstance(rate, SymbolicZero) else rate
    rate = solid(stored_rate, stored)
    if all(isinstance(leaf, SymbolicZero) for leaf in jax.tree.leaves(color_rates)):
        return stored, rate
    if space is None:
        raise TypeError(
            "these similarities do not follow from the colours by Eq. 7 alone (Views.coloring is None), "
            "so nothing can be differentiated by colours; make the views with Views.from_images"
        )
    rates = jax.tree.map(solid, color_rates, colors)
    by_colors = jax.jvp(lambda colors: function(space, colors, fixed), (colors,), (rates,))[1]
    return stored, rate + jnp.where(stored != 0.0, by_colors, 0.0)


_following.defjvp(_rates, symbolic_zeros=True)
