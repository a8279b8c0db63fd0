"""Pairs of body and image blobs in memory: all of them, or blocks of those that are near each other.

Either way the arrays of a pair layout broadcast to the shape of all its pairs, so that a formula over pairs is written
once; what differs is how a quantity of body blobs is spread over the pairs, and how pairs are summed.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from sogjax.model.sog import Sog
from sogjax.model.stages import computed_once

BLOCK = 8
"""Image blobs that follow each other in a Sog and are near a body blob, or not, together."""

Slots = Float[Array, "slot block"]


class Moments(NamedTuple):
    """For each body blob the sums over its pairs of w (mu_i - mu_j), of w, and of w sigma_i^2."""

    away: Float[Array, "*camera body 2"]
    weight: Float[Array, "*camera body"]
    variance: Float[Array, "*camera body"]


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
        """For each image blob the sum over its pairs."""
        return jnp.sum(values, axis=0)

    def sum_over_image(self, values: Float[Array, "body image"]) -> Float[Array, "body"]:
        """For each body blob the sum over its pairs."""
        return jnp.sum(values, axis=1)

    def moments(self, weights: Float[Array, "body image"], means: Float[Array, "body 2"]) -> Moments:
        """Weighted sums over the pairs of each body blob: one matrix product, quicker than sums along rows."""
        origin = means[:1]
        x, y = self.x[0] - origin[:, 0], self.y[0] - origin[:, 1]
        columns = jnp.stack([x, y, jnp.ones_like(x), self.variances[0]], axis=1)
        sums = jnp.matmul(weights, columns, precision="highest")
        return Moments(sums[:, :2] - (means - origin) * sums[:, 2:3], sums[:, 2], sums[:, 3])

    def live_pairs(self, live: Array, values: Float[Array, "body image"]) -> Float[Array, "body image"]:
        """The values of the pairs whose image blob is live, 0 elsewhere."""
        return jnp.where(live[None, :], values, 0.0)


class SparsePairs(eqx.Module):
    """Blocks of pairs near each other, of all cameras together: each is one body blob with `BLOCK` image blobs.

    Slots are the leading axis, so that every operation runs along the blocks. Blocks of padding have amplitude 0.
    """

    x: Slots
    y: Slots
    variances: Slots
    amplitudes: Slots
    image_index: Int[Array, "slot block"]
    """Into the image blobs of all cameras."""
    body_index: Int[Array, "block"]
    """Into the projected body blobs of all cameras."""
    image_shape: tuple[int, int] = eqx.field(static=True)
    body_shape: tuple[int, int] = eqx.field(static=True)

    def of_body(self, values: Float[Array, "camera body"]) -> Float[Array, "1 block"]:
        """A quantity of the projected body blobs, spread over the pairs."""
        return values.reshape(-1).at[self.body_index].get(mode="promise_in_bounds")[None, :]

    def sum_over_body(self, values: Slots) -> Float[Array, "camera image"]:
        """For each image blob the sum over its pairs."""
        zeros = jnp.zeros(self.image_shape[0] * self.image_shape[1], values.dtype)
        sums = zeros.at[self.image_index.reshape(-1)].add(values.reshape(-1), mode="promise_in_bounds")
        return sums.reshape(self.image_shape)

    def sum_over_image(self, values: Slots) -> Float[Array, "camera body"]:
        """For each projected body blob the sum over its pairs."""
        zeros = jnp.zeros(self.body_shape[0] * self.body_shape[1], values.dtype)
        block_sums = sum((values[slot] for slot in range(1, BLOCK)), values[0])  # quicker than a sum over an axis
        sums = zeros.at[self.body_index].add(block_sums, mode="promise_in_bounds")
        return sums.reshape(self.body_shape)

    def moments(self, weights: Slots, means: Float[Array, "camera body 2"]) -> Moments:
        """Weighted sums over the pairs of each body blob."""
        away = [self.x - self.of_body(means[..., 0]), self.y - self.of_body(means[..., 1])]
        away = jnp.stack([self.sum_over_image(weights * part) for part in away], axis=-1)
        return Moments(away, self.sum_over_image(weights), self.sum_over_image(weights * self.variances))

    def live_pairs(self, live: Array, values: Slots) -> Slots:
        """The values of the pairs whose image blob is live, 0 elsewhere."""
        chosen = lambda live, values: jnp.where(
            live.reshape(-1).at[self.image_index].get(mode="promise_in_bounds"), values, 0.0
        )
        really = self.variances[0, 0] > 0.0  # it always is
        return computed_once(really, chosen, live, values)


Pairs = DensePairs | SparsePairs


def image_quantities(image: Sog) -> tuple[Array, Array, Array, Array]:
    """X, y, variances (1 in the padding) and 2 pi sigma^2 (0 in the padding) of image blobs, in any batch."""
    variances = jnp.where(image.mask, image.sigmas, 1.0) ** 2
    return image.means[..., 0], image.means[..., 1], variances, jnp.where(image.mask, 2.0 * jnp.pi * variances, 0.0)
