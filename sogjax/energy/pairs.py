"""Pairs of body and image blobs in memory: all of them, or blocks of those that are near each other.

Either way the arrays of a pair layout broadcast to the shape of all its pairs, so that a formula over pairs is written
once; what differs is how a quantity of body blobs is spread over the pairs, and how pairs are summed.
"""

from collections.abc import Callable
from typing import Any, NamedTuple, TypeVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from sogjax.model.compiled import stage_barrier
from sogjax.model.sog import Sog

TILE = 8
"""Image blobs that follow each other in a Sog and are compared with the same body blobs."""
MEMBERS = 8
"""Body blobs that are compared with a tile together."""

Results = TypeVar("Results")
Slots = Float[Array, "member slot block"]


class Disks(NamedTuple):
    """Where projected body blobs lie and how wide they are: pixels, pixels^2."""

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

    def sum_over_body(self, values: Float[Array, "body image"]) -> Float[Array, "image"]:
        """The sum for each image blob over its pairs."""
        return jnp.sum(values, axis=0)

    def staged(self, function: Callable[..., Results], *arguments: Any) -> Results:
        """The results of a function over pairs, as the compiler likes it best."""
        return function(*arguments)

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
    since XLA does not vectorise what it sums over an axis. Members of padding have amplitude 0.
    """

    x: Float[Array, "1 slot block"]
    y: Float[Array, "1 slot block"]
    variances: Float[Array, "1 slot block"]
    amplitudes: Slots
    tile_index: Int[Array, "block"]
    """The number of each block's tile among those of all cameras."""
    body_index: Int[Array, "member block"]
    """The numbers of each block's body blobs among those of all cameras."""
    image_shape: tuple[int, int] = eqx.field(static=True)
    body_shape: tuple[int, int] = eqx.field(static=True)

    def of_body(self, values: Float[Array, "camera body"]) -> Float[Array, "member 1 block"]:
        """A quantity of the projected body blobs, spread over the pairs."""
        return values.reshape(-1).at[self.body_index].get(mode="promise_in_bounds")[:, None, :]

    def staged(self, function: Callable[..., Results], *arguments: Any) -> Results:
        """The results of a function over pairs, finished before they are used."""
        return stage_barrier(self.variances[0, 0, 0] > 0.0, function, *arguments)

    def sum_over_body(self, values: Slots) -> Float[Array, "camera image"]:
        """The sum for each image blob over its pairs."""
        zeros = jnp.zeros((TILE, self.image_shape[0] * self.image_shape[1] // TILE), values.dtype)
        added = self.staged(lambda values: _added(list(values)), values)
        sums = zeros.at[:, self.tile_index].add(added, mode="promise_in_bounds")
        return sums.T.reshape(self.image_shape)

    def moments(self, live: Bool[Array, "camera image"], weights: Slots, body: Disks) -> Moments:
        """Sums over the live pairs of each body blob."""
        counted = live.astype(weights.dtype).reshape(-1, TILE).T.at[:, self.tile_index].get(mode="promise_in_bounds")
        sums = self.staged(_block_moments, self, counted, weights, body)
        away_x, away_y, weight, variance, spread = map(self._sum_over_blocks, sums)
        return Moments(jnp.stack([away_x, away_y], axis=-1), weight, variance, spread)

    def _sum_over_blocks(self, values: Float[Array, "member block"]) -> Float[Array, "camera body"]:
        """Sums for each projected body blob over its members of blocks."""
        zeros = jnp.zeros(self.body_shape[0] * self.body_shape[1], values.dtype)
        return zeros.at[self.body_index].add(values, mode="promise_in_bounds").reshape(self.body_shape)


Pairs = DensePairs | SparsePairs


def separations(pairs: Pairs, body: Disks) -> Separations:
    """How far the blobs of each pair are apart, and how wide they are together."""
    dx = pairs.x - pairs.of_body(body.means[..., 0])
    dy = pairs.y - pairs.of_body(body.means[..., 1])
    return Separations(dx, dy, dx * dx + dy * dy, pairs.variances + pairs.of_body(body.variances))


def _block_moments(
    pairs: SparsePairs, counted: Float[Array, "slot block"], weights: Slots, body: Disks
) -> list[Float[Array, "member block"]]:
    """The summands of `Moments` in each block, summed over its tile."""
    gaps = separations(pairs, body)
    weights = weights * counted[None, :, :]
    relative = gaps.squared_distance / gaps.variance_sum
    parts = (weights * gaps.dx, weights * gaps.dy, weights, weights * pairs.variances, weights * relative)
    return [_added([part[:, slot] for slot in range(TILE)]) for part in parts]


def _added(parts: list[Array]) -> Array:
    return sum(parts[1:], parts[0])


def image_quantities(image: Sog) -> tuple[Array, Array, Array, Array]:
    """X, y, variances (1 in the padding) and 2 pi sigma^2 (0 in the padding) of image blobs, in any batch."""
    variances = jnp.where(image.mask, image.sigmas, 1.0) ** 2
    return image.means[..., 0], image.means[..., 1], variances, jnp.where(image.mask, 2.0 * jnp.pi * variances, 0.0)
