"""Which pairs can matter while a pose is being found: blobs of alike colours that are near each other.

The lists are made at one pose and hold for every pose whose blobs are seen at most a margin away from there. Whoever
uses them looks at how far the blobs have moved (`displacement`) and makes them anew where that was too far.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.pairs import BLOCK, SparsePairs, image_quantities
from sogjax.model.camera import Camera, project
from sogjax.model.compaction import chosen_indices
from sogjax.model.sog import Sog

NEGLIGIBLE = 1e-4
"""Pairs are left out where the exponential of Eq. 6 is below this, even after a motion by the margin."""
MARGIN = 0.015
"""Of the image's width: how far a blob may move before the lists are made anew. Predictions of a walk are 1 to 15
pixels off where a picture is 1296 wide; 0.02 takes 13 % more blocks than 0.01."""


def margins(cameras: Camera) -> Float[Array, "camera"]:
    """How far blobs may move in the image of each camera, pixels."""
    return MARGIN * cameras.image_size[:, 0]


def displacement(cameras: Camera, before: Sog, after: Sog) -> Float[Array, ""]:
    """How far the blobs of a body (world) have moved in any image, in units of its margin.

    A blob that has become visible, or no longer is, has moved infinitely far.
    """

    def one_camera(camera: Camera, margin: Float[Array, ""]) -> Float[Array, ""]:
        old, new = project(camera, before), project(camera, after)
        moved = jnp.linalg.norm(new.means - old.means, axis=-1) / margin
        return jnp.max(jnp.where(old.mask == new.mask, jnp.where(old.mask, moved, 0.0), jnp.inf))

    return jnp.max(jax.vmap(one_camera)(cameras, margins(cameras)))


def near_pairs(
    images: Sog,
    color_similarities: Float[Array, "camera body image"],
    seen: Sog,
    margin: Float[Array, "camera"],
    exponent: Float[Array, ""],
    capacity: int,
) -> tuple[SparsePairs, Int[Array, ""]]:
    """The blocks of pairs that matter to blobs `seen` by the cameras (projected), and how many there are.

    A count above `capacity` means that blocks were cut off: the caller must look at it and try a larger capacity.
    """
    images, color_similarities = _whole_blocks(images, color_similarities)
    num_cameras, num_bodies, num_images = color_similarities.shape
    near = jax.vmap(_near, in_axes=(0, 0, 0, 0, None))(images, color_similarities, seen, margin, exponent)
    in_block = near.reshape(-1, BLOCK).any(axis=1)
    chosen, count = chosen_indices(in_block, capacity)
    real = jnp.arange(capacity, dtype=count.dtype) < count
    # Padding is spread over all places: sums into one and the same place would wait for each other.
    chosen = jnp.where(real, chosen, jnp.arange(capacity, dtype=chosen.dtype) % in_block.shape[0])
    blocks_per_image = num_images // BLOCK
    body_index = chosen // blocks_per_image  # counts the blobs of all cameras
    camera = body_index // num_bodies
    first = camera * num_images + (chosen % blocks_per_image) * BLOCK
    slots = jnp.arange(BLOCK, dtype=chosen.dtype)[:, None]
    image_index = first[None, :] + slots
    x, y, variances, scale = (_taken(values, image_index) for values in image_quantities(images))
    similarities = _taken(color_similarities, chosen[None, :] * BLOCK + slots)
    amplitudes = jnp.where(real[None, :], similarities * scale, 0.0)
    image_shape, body_shape = (num_cameras, num_images), (num_cameras, num_bodies)
    return SparsePairs(x, y, variances, amplitudes, image_index, body_index, image_shape, body_shape), count


def _near(
    image: Sog,
    color_similarities: Float[Array, "body image"],
    seen: Sog,
    margin: Float[Array, ""],
    exponent: Float[Array, ""],
) -> Bool[Array, "body image"]:
    """Pairs of alike colours whose exponential may exceed `NEGLIGIBLE` within the margin."""
    dx = image.means[None, :, 0] - seen.means[:, None, 0]
    dy = image.means[None, :, 1] - seen.means[:, None, 1]
    reach = jnp.sqrt((image.sigmas**2)[None, :] + (seen.sigmas**2)[:, None]) * jnp.sqrt(-jnp.log(NEGLIGIBLE) / exponent)
    alike = (color_similarities != 0.0) & seen.mask[:, None]
    return alike & (dx * dx + dy * dy < (reach + margin) ** 2)


def _taken(values: Array, index: Int[Array, "slot block"]) -> Float[Array, "slot block"]:
    return values.reshape(-1).at[index].get(mode="promise_in_bounds")


def _whole_blocks(
    images: Sog, color_similarities: Float[Array, "camera body image"]
) -> tuple[Sog, Float[Array, "camera body image2"]]:
    """Padded so that the image blobs fill whole blocks."""
    extra = -images.capacity % BLOCK
    if extra == 0:
        return images, color_similarities
    at_end = lambda leaf, axis: jnp.pad(leaf, [(0, extra if k == axis else 0) for k in range(leaf.ndim)])
    return jax.tree.map(lambda leaf: at_end(leaf, 1), images), at_end(color_similarities, 2)
