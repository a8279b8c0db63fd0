"""Which image blobs can matter to a body: those near it and of its colours (Section 6)."""

import math
from dataclasses import replace
from functools import partial
from typing import Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.overlap import pair_color_similarities
from sogjax.energy.pairs import CHUNK
from sogjax.energy.views import Windows, windows_around
from sogjax.errors import InputError
from sogjax.model.camera import Camera, project
from sogjax.model.color import averaging_space, convert, from_rgb, squared_distance
from sogjax.model.compiled import stage_barrier
from sogjax.model.sog import Sog
from sogjax.scene.foreground import BackgroundModel, SubjectColors, foreground_weights, log_odds
from sogjax.scene.occluders import HiddenFrom, Occluders
from sogjax.scene.quadtree import Candidates, keep_blobs, keep_blobs_of_planes, quadtree_of_planes

CAPACITIES = (256, 512, 768, 1024, 1536, 2048, 3072, 4096, 6144, 8192, 16384, 32768, 65536)
"""The sizes of padded image Sogs. Few, so that few programs are compiled."""

BLOB_RADIUS = 3.0
"""Sigmas around a blob's centre that belong to the box of a body."""


FOREGROUND_CONTRAST = 0.3
"""What the whole range of weights counts beside colours (0 to 1) when a quad-tree decides on a node: blobs do not cross
the edge between foreground and background."""
NEGLIGIBLE_WEIGHT = 0.05
"""Image blobs of less weight are left out: what is certainly background."""

BoxAround = Literal["last", "predicted"]

BLOCK_STEP = CHUNK
"""Room for blocks of pairs comes in multiples of this; what is not used is passed over, so large steps cost little."""


class Capacities(eqx.Module):
    """Slots for the image blobs of one camera that pass the first test (leaf, in the box) and both tests.

    `blocks` are those of near pairs, for all cameras together, where not all pairs are compared.
    """

    near: int = eqx.field(static=True)
    matching: int = eqx.field(static=True)
    blocks: int = eqx.field(static=True, default=0)

    def hold(self, near: int, matching: int, blocks: int = 0) -> bool:
        """Whether there is room for so many image blobs and blocks of pairs."""
        return near <= self.near and matching <= self.matching and blocks <= self.blocks

    def times(self, factor: int) -> "Capacities":
        """So many times the room.

        Raises:
            InputError: more image blobs than the largest capacity.
        """
        return Capacities(capacity_for(factor * self.near), capacity_for(factor * self.matching), factor * self.blocks)


def capacity_for(count: int, headroom: float = 1.0) -> int:
    """The smallest of `CAPACITIES` that holds `headroom` times `count` blobs, or at least `count`.

    Raises:
        InputError: none holds `count`.
    """
    if count > CAPACITIES[-1]:
        raise InputError(
            f"{count} image blobs in one picture: the largest capacity is {CAPACITIES[-1]}; lower images.depth"
        )
    return next((capacity for capacity in CAPACITIES if capacity >= headroom * count), CAPACITIES[-1])


def block_capacity(count: int, headroom: float = 1.0) -> int:
    """Room for `headroom` times `count` blocks of pairs, at least for one step of them; up to a quarter more.

    So few capacities are asked for, and few programs compiled.
    """
    steps = max(math.ceil(headroom * count / BLOCK_STEP), 1)
    coarser = 1 << max(steps.bit_length() - 3, 0)
    return BLOCK_STEP * coarser * math.ceil(steps / coarser)


class BlobWeights(NamedTuple):
    """What image blobs count, and for whom."""

    foreground: Float[Array, "*camera image"] | None
    """Weights of `foreground_weights`; None where no background is known: all count fully."""
    hidden_from: Float[Array, "*camera image"] | None
    """Depth (metres) from which on a body's blobs are hidden there; None: none are."""

    def where_shown(
        self, similarities: Float[Array, "body image"], depths: Float[Array, "body"] | None
    ) -> Float[Array, "body image"]:
        """Similarities of one camera, 0 for body blobs at depths at which they are hidden."""
        if self.hidden_from is None or depths is None:
            return similarities
        return jnp.where(depths[:, None] < self.hidden_from[None, :], similarities, 0.0)


class ImageReader(eqx.Module):
    """Turns the cells of one frame into Sogs: how colours are read and which blobs are kept."""

    candidates: Candidates
    color_radius: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    """eps_sim of Eq. 7."""
    color_tolerance: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    """eps_col of Section 4.1."""
    color_space: str = eqx.field(static=True)
    box_enlargement: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=0.15)
    """Part of the box's size that is added on each side."""
    box_around: BoxAround = eqx.field(static=True, default="predicted")
    """Whether boxes hold the last pose only, or the predicted one too."""
    background: BackgroundModel | None = None
    """The empty scene, so that image blobs count by how little they look like it; None: all count fully."""
    subject: SubjectColors | None = None
    """The colours that the actors have; None: any."""
    occluders: Occluders | None = None
    """What stands in front; None: nothing."""

    def behind(self, hidden: HiddenFrom) -> "ImageReader":
        """The same with cells that are hidden from some depth on, beside those that it knows."""
        if self.occluders is not None:
            hidden = np.minimum(hidden, np.asarray(self.occluders.cells))
        if not np.isfinite(hidden).any():
            return self
        occluders, candidates = Occluders.of_cells(hidden, self.candidates)
        return replace(self, occluders=occluders, candidates=candidates)

    def leaves(
        self, cells: Float[Array, "camera rows columns 3"]
    ) -> tuple[Float[Array, "camera candidate 3"], Bool[Array, "camera candidate"]]:
        """Colours (averaging space) and leaves of the quad-trees of all cameras, from sRGB cells in 0..1."""
        planes, leaves = self._leaf_planes(cells, self.odds(cells))
        return jnp.stack(planes[:3], axis=-1), leaves

    def odds(self, cells: Float[Array, "camera rows columns 3"]) -> Float[Array, "camera rows columns"] | None:
        """Log odds of foreground against background of all cells; None where no background is known."""
        if self.background is None:
            return None
        return stage_barrier(self.true_at_run_time, log_odds, cells, self.background, self.subject)

    def windows(
        self, odds: Float[Array, "camera rows columns"], cameras: Camera, boxes: Float[Array, "camera actor 2 2"]
    ) -> Windows:
        """The log odds of cells in the boxes."""
        return stage_barrier(self.true_at_run_time, windows_around, odds, self.cell_sizes, cameras, boxes)

    @property
    def cell_sizes(self) -> Float[Array, "camera"]:
        """The sides of cells, pixels."""
        return jnp.asarray([grid.cell_size for grid in self.candidates.grids], self.color_radius.dtype)

    @property
    def true_at_run_time(self) -> Bool[Array, ""]:
        """True, which the compiler cannot know (see `stage_barrier`)."""
        return ~jnp.isnan(self.color_tolerance)

    def _leaf_planes(
        self, cells: Float[Array, "camera rows columns 3"], odds: Float[Array, "camera rows columns"] | None
    ) -> tuple[list[Float[Array, "camera candidate"]], Bool[Array, "camera candidate"]]:
        """The same, the colours channel by channel, then the weights of `foreground_weights`, if there are odds."""
        space = averaging_space(self.color_space)
        planes = stage_barrier(self.true_at_run_time, partial(_color_planes, space=space), cells)
        if odds is not None:
            planes = [*planes, FOREGROUND_CONTRAST * foreground_weights(odds)]
        means, leaves = jax.vmap(quadtree_of_planes, in_axes=(0, 0, None))(
            planes, self.candidates, self.color_tolerance
        )
        if odds is not None:
            means[3] = means[3] / FOREGROUND_CONTRAST
            leaves = leaves & (means[3] > NEGLIGIBLE_WEIGHT)
        return means, leaves

    def near_blobs(
        self,
        cells: Float[Array, "camera rows columns 3"],
        odds: Float[Array, "camera rows columns"] | None,
        boxes: Float[Array, "camera actor 2 2"],
        capacity: int,
    ) -> tuple[Sog, BlobWeights, Int[Array, "camera"]]:
        """Image blobs inside the boxes, coloured in the working space, what they count, how many for each camera."""
        planes, leaves = self._leaf_planes(cells, odds)
        keep = leaves & jax.vmap(_in_boxes)(self.candidates.means, self.candidates.sigmas, boxes)
        select = jax.vmap(keep_blobs_of_planes, in_axes=(0, 0, 0, 0, None))
        near, chosen, counts = select(self.candidates.means, self.candidates.sigmas, planes[:3], keep, capacity)
        working = convert(near.colors, averaging_space(self.color_space), self.color_space)
        taken = lambda table: None if table is None else jnp.take_along_axis(table, chosen, axis=1)
        weights = BlobWeights(
            taken(None if odds is None else planes[3]), taken(None if self.occluders is None else self.occluders.nodes)
        )
        return eqx.tree_at(lambda sog: sog.colors, near, working), weights, counts

    def matching_blobs(
        self, near: Sog, weights: BlobWeights, body: Sog, depths: Float[Array, "camera body"] | None, capacity: int
    ) -> tuple[Sog, Float[Array, "camera body image"], Float[Array, "camera image"] | None, Int[Array, "camera"]]:
        """The near blobs whose colour resembles some blob of the body, with all colour similarities and weights.

        `depths` are those of the body's blobs (metres), of which some may be hidden; None: nothing stands in front.
        """

        def one_camera(image: Sog, weights: BlobWeights, depths: Float[Array, "body"] | None):
            similarities = weights.where_shown(
                pair_color_similarities(image, body, self.color_space, self.color_radius), depths
            )
            keep = jnp.any(similarities > 0.0, axis=0) & image.mask
            kept, chosen, count = keep_blobs(image.means, image.sigmas, image.colors, keep, capacity)
            similarities = jnp.where(kept.mask[None, :], similarities[:, chosen], 0.0)
            if weights.foreground is None:
                return kept, similarities, None, count
            of_kept = weights.foreground[chosen]
            return kept, similarities * of_kept[None, :], of_kept, count

        return jax.vmap(one_camera)(near, weights, depths)

    def compared_blobs(
        self, near: Sog, weights: BlobWeights, body: Sog, depths: Float[Array, "camera body"] | None
    ) -> tuple[Sog, Float[Array, "camera body image"], Int[Array, "camera"]]:
        """The near blobs in their places, those masked out that resemble no blob of the body; the same otherwise.

        A program that only lists near pairs never computes the similarities: nothing else here needs them.
        """

        def compare(
            image: Sog, weights: BlobWeights, depths: Float[Array, "body"] | None
        ) -> Float[Array, "body image"]:
            similarities = pair_color_similarities(image, body, self.color_space, self.color_radius)
            similarities = weights.where_shown(similarities, depths)
            return similarities if weights.foreground is None else similarities * weights.foreground[None, :]

        similarities = stage_barrier(self.true_at_run_time, jax.vmap(compare), near, weights, depths)
        alike = jax.vmap(self._alike, in_axes=(0, None, 0, 0))
        mask = near.mask & stage_barrier(self.true_at_run_time, alike, near, body, weights, depths)
        return eqx.tree_at(lambda sog: sog.mask, near, mask), similarities, jnp.sum(mask, axis=1)

    def _alike(
        self, image: Sog, body: Sog, weights: BlobWeights, depths: Float[Array, "body"] | None
    ) -> Bool[Array, "image"]:
        """Which image blobs resemble a blob of the body that is not hidden there, blob by blob of the body."""

        def nearer(blob: Int[Array, ""], state: tuple[Array, ...]) -> tuple[Array, ...]:
            least, *planes = state
            apart = [plane - body.colors[blob, k] for k, plane in enumerate(planes)]
            squared = squared_distance(apart, self.color_space)
            if weights.hidden_from is not None and depths is not None:
                squared = jnp.where(depths[blob] < weights.hidden_from, squared, jnp.inf)
            return jnp.minimum(least, squared), *planes

        # In the state, planes lie apart; a loop reads what it closes over as it is, colour by colour.
        planes = [image.colors[:, k] for k in range(3)]
        nowhere = jnp.full_like(image.sigmas, jnp.inf)
        squared = jax.lax.fori_loop(0, body.capacity, nearer, (nowhere, *planes))[0]
        alike = jnp.sqrt(squared) < self.color_radius
        return alike if weights.foreground is None else alike & (weights.foreground > 0.0)


def _color_planes(
    cells: Float[Array, "camera rows columns 3"], space: str
) -> list[Float[Array, "camera rows columns"]]:
    """SRGB cells in a colour space, channel by channel."""
    colors = from_rgb(cells, space)
    return [colors[..., k] for k in range(3)]


def body_boxes(
    blobs: Sog, camera: Camera, actors: Int[np.ndarray, "blob"], enlargement: Float[Array, ""]
) -> Float[Array, "actor 2 2"]:
    """For one camera the enlarged box (lowest and highest x, y in pixels) of every actor; empty when not seen."""
    seen = project(camera, blobs)
    radius = BLOB_RADIUS * seen.sigmas[:, None]
    boxes = []
    for actor in range(int(actors.max()) + 1):
        mine = (seen.mask & jnp.asarray(actors == actor))[:, None]
        low = jnp.min(jnp.where(mine, seen.means - radius, jnp.inf), axis=0)
        high = jnp.max(jnp.where(mine, seen.means + radius, -jnp.inf), axis=0)
        border = enlargement * jnp.maximum(high - low, 0.0)
        boxes.append(jnp.stack([low - border, high + border]))
    return jnp.stack(boxes)


def union_boxes(a: Float[Array, "*batch 2 2"], b: Float[Array, "*batch 2 2"]) -> Float[Array, "*batch 2 2"]:
    """The smallest boxes that hold the boxes of both."""
    low = jnp.minimum(a[..., 0, :], b[..., 0, :])
    return jnp.stack([low, jnp.maximum(a[..., 1, :], b[..., 1, :])], axis=-2)


def _in_boxes(
    means: Float[Array, "n 2"], sigmas: Float[Array, "n"], boxes: Float[Array, "actor 2 2"]
) -> Bool[Array, "n"]:
    """Image blobs whose square touches one of the boxes."""
    above = means[:, None, :] + sigmas[:, None, None] >= boxes[None, :, 0, :]
    below = means[:, None, :] - sigmas[:, None, None] <= boxes[None, :, 1, :]
    return jnp.any(jnp.all(above & below, axis=-1), axis=-1)
