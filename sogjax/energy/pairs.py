"""Pairs of body and image blobs in memory: all of them, or blocks of those that are near each other.

Either way the arrays of a pair layout broadcast to the shape of all its pairs, so that a formula over pairs is written
once; what differs is how a quantity of body blobs is spread over the pairs, and how pairs are summed.
"""

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from sogjax.model.compiled import stage_barrier
from sogjax.model.sog import Sog

TILE = 8
"""Image blobs that follow each other in a Sog and are compared with the same body blobs."""
MEMBERS = 8
"""Body blobs that are compared with a tile together."""

CHUNK = 512
"""Blocks whose pairs are looked at together: 128 KiB for each number of them."""

Results = TypeVar("Results")
Slots = Float[Array, "member slot block"]
ChunkedSlots = Float[Array, "chunk member slot block"]


class Disks(NamedTuple):
    """Where projected body blobs lie and how wide they are: pixels, pixels^2; 0 wide in the padding."""

    means: Float[Array, "*camera body 2"]
    variances: Float[Array, "*camera body"]


class Separations(NamedTuple):
    """The way mu_i - mu_j between the blobs of each pair, its squared length, and sigma_i^2 + sigma_j^2."""

    dx: Array
    dy: Array
    squared_distance: Array
    variance_sum: Array


class Moments(NamedTuple):
    """Sums for each body blob over its pairs: of w (mu_i - mu_j), of w, of w sigma_i^2, and `spread`.

    The spread is the sum of `w |mu_i - mu_j|^2 / (sigma_i^2 + sigma_j^2)`.
    """

    away: Float[Array, "*camera body 2"]
    weight: Float[Array, "*camera body"]
    variance: Float[Array, "*camera body"]
    spread: Float[Array, "*camera body"]


class DensePairs(eqx.Module):
    """All pairs of one image and a body, in the layout (body blob, image blob)."""

    x: Float[Array, "1 image"]
    """Centres of the image blobs, pixels."""
    y: Float[Array, "1 image"]
    variances: Float[Array, "1 image"]
    """Squared sigmas of the image blobs, pixels^2; 1 in the padding."""
    amplitudes: Float[Array, "body image"]
    """2 pi d(c_i, c_j) sigma_i^2, the factors of Eq. 6 that no pose changes; 0 in the padding."""

    @classmethod
    def from_image(cls, image: Sog, color_similarities: Float[Array, "body image"]) -> "DensePairs":
        """The pairs of one image."""
        x, y, variances, scale = image_quantities(image)
        return cls(x[None, :], y[None, :], variances[None, :], color_similarities * scale[None, :])

    def of_body(self, values: Float[Array, "body"]) -> Float[Array, "body 1"]:
        """A quantity of the body blobs, spread over the pairs."""
        return values[:, None]

    def totals(
        self, function: Callable[..., tuple[Array, Array]], *arguments: Any
    ) -> tuple[Float[Array, "image"], Float[Array, "body image"]]:
        """The first result of `function(pairs, *arguments)` summed for each image blob over its pairs, and the second.

        Each is a number for every pair.
        """
        values, others = function(self, *arguments)
        return jnp.sum(values, axis=0), others

    def moments(self, live: Bool[Array, "image"], weights: Float[Array, "body image"], body: Disks) -> Moments:
        """Sums over the live pairs of each body blob: one matrix product where it can be, quicker than along rows."""
        weights = jnp.where(live[None, :], weights, 0.0)
        origin = body.means[:1]
        x, y = self.x[0] - origin[:, 0], self.y[0] - origin[:, 1]
        columns = jnp.stack([x, y, jnp.ones_like(x), self.variances[0]], axis=1)
        sums = jnp.matmul(weights, columns, precision="highest")
        gaps = separations(self, body)
        spread = jnp.sum(weights * (gaps.squared_distance / gaps.variance_sum), axis=1)
        return Moments(sums[:, :2] - (body.means - origin) * sums[:, 2:3], sums[:, 2], sums[:, 3], spread)


class SparsePairs(eqx.Module):
    """Blocks of pairs near each other, of all cameras: each is `MEMBERS` body blobs with one tile of image blobs.

    Blocks are the last axis, so that every operation runs along them; sums over members and slots are written out,
    since XLA does not vectorise what it sums over an axis. Members of padding have amplitude 0. Blocks fill whole
    chunks, which are looked at one after the other, but for those without a block: what is computed of a chunk stays
    in the processor's cache until it is summed.
    """

    x: Float[Array, "1 slot block"]
    y: Float[Array, "1 slot block"]
    variances: Float[Array, "1 slot block"]
    amplitudes: Slots
    tile_index: Int[Array, "block"]
    """The number of each block's tile among those of all cameras."""
    body_index: Int[Array, "member block"]
    """The numbers of each block's body blobs among those of all cameras."""
    num_blocks: Int[Array, ""]
    """How many blocks are no padding; they come first."""
    image_shape: tuple[int, int] = eqx.field(static=True)
    body_shape: tuple[int, int] = eqx.field(static=True)

    def of_body(self, values: Float[Array, "camera body"]) -> Float[Array, "member 1 block"]:
        """A quantity of the projected body blobs, spread over the pairs."""
        return values.reshape(-1).at[self.body_index].get(mode="promise_in_bounds")[:, None, :]

    def totals(
        self, function: Callable[..., tuple[Slots, Slots]], *arguments: Any
    ) -> tuple[Float[Array, "camera image"], ChunkedSlots]:
        """As of `DensePairs`; the second result chunk by chunk."""

        def of_chunk(chunk: SparsePairs) -> tuple[Float[Array, "block slot"], Slots]:
            values, others = function(chunk, *arguments)
            return _added(list(values)).T, others

        added, others = self._in_chunks(of_chunk)
        zeros = jnp.zeros((self.image_shape[0] * self.image_shape[1] // TILE, TILE), added.dtype)
        sums = zeros.at[self.tile_index].add(added.reshape(-1, TILE), mode="promise_in_bounds")
        return sums.reshape(self.image_shape), others

    def moments(self, live: Bool[Array, "camera image"], weights: ChunkedSlots, body: Disks) -> Moments:
        """Sums over the live pairs of each body blob; the weights are those of `totals`."""
        counted = live.astype(weights.dtype).reshape(-1, TILE).T

        def of_chunk(chunk: SparsePairs, weights: Slots) -> list[Float[Array, "member block"]]:
            counts = counted.at[:, chunk.tile_index].get(mode="promise_in_bounds")
            return _block_moments(chunk, weights * counts[None, :, :], body)

        away_x, away_y, weight, variance, spread = map(self._sum_over_blocks, self._in_chunks(of_chunk, weights))
        return Moments(jnp.stack([away_x, away_y], axis=-1), weight, variance, spread)

    def _in_chunks(self, function: Callable[..., Results], *values: ChunkedSlots) -> Results:
        """What a function gives of every chunk and its values, along a first axis; zeros where there is no block."""
        chunks = jnp.arange(self.tile_index.shape[0] // CHUNK, dtype=self.num_blocks.dtype)

        def of_chunk(chunk: Int[Array, ""], pairs: SparsePairs, *values: ChunkedSlots) -> Results:
            taken = partial(jax.lax.dynamic_index_in_dim, index=chunk, keepdims=False, allow_negative_indices=False)
            return function(pairs._chunk(chunk), *map(taken, values))

        def one(_: None, chunk: Int[Array, ""]) -> tuple[None, Results]:
            return None, stage_barrier(chunk * CHUNK < self.num_blocks, of_chunk, chunk, self, *values)

        return jax.lax.scan(one, None, chunks)[1]

    def _chunk(self, chunk: Int[Array, ""]) -> "SparsePairs":
        """The blocks of a chunk."""
        part = lambda leaf: jax.lax.dynamic_slice_in_dim(
            leaf, chunk * CHUNK, CHUNK, axis=-1, allow_negative_indices=False
        )
        return jax.tree.map(lambda leaf: part(leaf) if leaf.ndim else leaf, self)

    def _sum_over_blocks(self, values: Float[Array, "chunk member block"]) -> Float[Array, "camera body"]:
        """Sums for each projected body blob over its members of blocks."""
        zeros = jnp.zeros(self.body_shape[0] * self.body_shape[1], values.dtype)
        index = jnp.moveaxis(self.body_index.reshape(MEMBERS, -1, CHUNK), 1, 0)
        return zeros.at[index].add(values, mode="promise_in_bounds").reshape(self.body_shape)


Pairs = DensePairs | SparsePairs


def separations(pairs: Pairs, body: Disks) -> Separations:
    """How far the blobs of each pair are apart, and how wide they are together."""
    dx = pairs.x - pairs.of_body(body.means[..., 0])
    dy = pairs.y - pairs.of_body(body.means[..., 1])
    return Separations(dx, dy, dx * dx + dy * dy, pairs.variances + pairs.of_body(body.variances))


def _block_moments(pairs: SparsePairs, weights: Slots, body: Disks) -> list[Float[Array, "member block"]]:
    """The summands of `Moments` in each block, summed over its tile."""
    gaps = separations(pairs, body)
    relative = gaps.squared_distance / gaps.variance_sum
    parts = (weights * gaps.dx, weights * gaps.dy, weights, weights * pairs.variances, weights * relative)
    return [_added([part[:, slot] for slot in range(TILE)]) for part in parts]


def _added(parts: list[Array]) -> Array:
    return sum(parts[1:], parts[0])


def image_quantities(image: Sog) -> tuple[Array, Array, Array, Array]:
    """X, y, variances (1 in the padding) and 2 pi sigma^2 (0 in the padding) of image blobs, in any batch."""
    variances = jnp.where(image.mask, image.sigmas, 1.0) ** 2
    return image.means[..., 0], image.means[..., 1], variances, jnp.where(image.mask, 2.0 * jnp.pi * variances, 0.0)
