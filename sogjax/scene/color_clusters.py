"""Clusters of blobs of a body by their colours, and what cells say for each cluster against the background."""

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.cluster.vq import kmeans2

from sogjax.model.body import Body
from sogjax.scene.foreground import (
    LARGEST,
    SUBJECT_UNKNOWN,
    TEMPER,
    UNKNOWN_BACKGROUND,
    BackgroundModel,
    background_surprise,
    color_bins,
    color_surprise,
    subject_colors,
    surprise_of,
)

NUM_COLORS = 6
"""Skin, hair, shirt, trousers, shoes, and what lies between two of them."""
SLOTS = 8
"""Blobs of a cluster, at most: a colour of more blobs is several clusters, so that one program serves all actors."""
SPARE = 4
"""Clusters beside as many as the blobs would fill."""
ALIKE = 0.1
"""Difference of a channel up to which colours are taken for the same, in what speaks against a body."""


@dataclass(frozen=True)
class ColorClusters:
    """The blobs of a body by colour, and the log density of the colours of each cluster."""

    members: tuple[tuple[int, ...], ...]
    """The blobs of each cluster, at most `SLOTS`; none for clusters that a body does not need."""
    tables: Float[np.ndarray, "cluster bin bin bin"]
    whole: Float[np.ndarray, "bin bin bin"]
    """The log density of the colours of the whole body."""

    @classmethod
    def from_body(cls, body: Body) -> "ColorClusters":
        """The clusters of a body's blobs, from their colours (sRGB) and how much of the body each is."""
        colors, areas = np.asarray(body.blob_colors, float), np.asarray(np.asarray(body.blob_sigmas) ** 2, float)
        members, whole = _by_color(colors), subject_colors(colors, areas)
        tables = [subject_colors(colors[np.array(part)], areas[np.array(part)]) for part in members]
        missing = _num_clusters(len(colors)) - len(members)
        every = tuple(tuple(part) for part in [*members, *[[]] * missing])
        return cls(every, np.stack([*tables, *[np.zeros_like(whole)] * missing]), whole)


def _by_color(colors: Float[np.ndarray, "blob 3"]) -> list[list[int]]:
    """Blobs of about the same colour, at most `SLOTS` together."""
    most, clusters = _num_clusters(len(colors)), []
    for count in range(min(NUM_COLORS, len(np.unique(np.round(colors, 2), axis=0))), 0, -1):
        labels = (
            kmeans2(colors, count, minit="++", rng=np.random.default_rng(0))[1]
            if count > 1
            else np.zeros(len(colors), int)
        )
        parts = [np.flatnonzero(labels == k).tolist() for k in range(count)]
        clusters = [part[k : k + SLOTS] for part in parts for k in range(0, len(part), SLOTS)]
        if len(clusters) <= most:
            break
    return clusters


def _num_clusters(num_blobs: int) -> int:
    return -(-num_blobs // SLOTS) + SPARE


def cluster_odds(
    cells: Float[Array, "camera rows columns 3"],
    inside: Float[Array, "camera rows columns"],
    background: BackgroundModel | None,
    tables: Float[Array, "cluster bin bin bin"],
    most_unlike: float = LARGEST,
) -> Float[Array, "camera cluster rows columns"]:
    """Log odds of each cluster of blobs against the background in every cell, within `LARGEST`.

    Where the background is not known, what the picture shows elsewhere stands for it: a colour that is everywhere says
    little. `inside` is 1 for the cells of the pictures, 0 for padding. A cell that is neither the background nor has
    any of a cluster's colours says `most_unlike` at most: it may be somebody else.
    """
    unknown = picture_surprise(cells, inside)
    surprise, temper = unknown, jnp.full_like(unknown, TEMPER * UNKNOWN_BACKGROUND)
    if background is not None:
        surprise = jnp.where(background.known, background_surprise(cells, background), unknown)
        temper = jnp.where(background.known, TEMPER, temper)
    bins = color_bins(cells)
    densities = jax.lax.map(lambda table: table[bins], tables)
    own = most_unlike + TEMPER * (densities - math.log(SUBJECT_UNKNOWN))
    odds = jnp.moveaxis(jnp.minimum(temper[None] * (surprise[None] + densities), own), 0, 1)
    return jnp.clip(odds, -LARGEST, LARGEST) * inside[:, None]


def odds_where_told(
    cells: Float[Array, "camera rows columns 3"],
    inside: Float[Array, "camera rows columns"],
    background: BackgroundModel | None,
    tables: Float[Array, "cluster bin bin bin"],
) -> Float[Array, "camera cluster rows columns"]:
    """`cluster_odds`, but where a cluster looks as the background does, nothing is held against it.

    A black shoe on a black floor is the floor's black to a grey level, or is not, for all of its cells and in every
    frame: such cells must not be counted as if each one told. Where the background is known no better than a cluster's
    own colours are (`ALIKE`), what is left speaks against the cluster.
    """
    odds = cluster_odds(cells, inside, background, tables)
    if background is None:
        return odds
    least = cluster_odds(cells, inside, background.blurred(ALIKE), tables)
    return jnp.maximum(odds, jnp.minimum(least, 0.0))


def picture_surprise(
    cells: Float[Array, "camera rows columns 3"], inside: Float[Array, "camera rows columns"]
) -> Float[Array, "camera rows columns"]:
    """Minus the logarithm of the density of each cell's colour among those of its picture."""
    return surprise_of(cells, color_surprise(cells, inside))
