"""Which pairs can matter while a pose is being found: blobs of alike colours that are near each other.

The lists are made at one pose and hold for every pose whose blobs are seen at most a margin away from there. Whoever
uses them looks at how far the blobs have moved (`displacement`) and rebuilds them if that was too far.
"""

from functools import partial, reduce

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.coloring import Coloring
from sogjax.energy.pairs import CHUNK, MEMBERS, TILE, SparsePairs, image_quantities
from sogjax.model.camera import Camera, project
from sogjax.model.color import distance_from_box
from sogjax.model.compiled import chosen_indices, stage_barrier
from sogjax.model.sog import Sog

NEGLIGIBLE = 1e-4
"""Pairs are left out where the exponential of Eq. 6 is below this, even after a motion by the margin."""
MARGIN = 0.015
"""Share of the image's width that a blob may move before the lists are rebuilt. Predictions of a walk are 1 to 15
pixels off where a picture is 1296 wide; 0.02 takes 13 % more blocks than 0.01."""


def margins(cameras: Camera) -> Float[Array, "camera"]:
    """How far blobs may move in the image of each camera, pixels."""
    return MARGIN * cameras.image_size[:, 0]


def displacement(cameras: Camera, before: Sog, after: Sog) -> Float[Array, ""]:
    """How far the blobs of a body (world) have moved in any image, in units of its margin.

    A blob that has become visible, or no longer is, has moved infinitely far.
    """
    seen = jax.vmap(project, in_axes=(0, None))
    return displaced(seen(cameras, before), seen(cameras, after), margins(cameras))


def displaced(before: Sog, after: Sog, margin: Float[Array, "camera"]) -> Float[Array, ""]:
    """How far projected blobs have moved in any image between what the cameras saw and see, in units of its margin."""
    moved = jnp.linalg.norm(after.means - before.means, axis=-1) / margin[:, None]
    return jnp.max(jnp.where(before.mask == after.mask, jnp.where(before.mask, moved, 0.0), jnp.inf))


def near_pairs(
    images: Sog,
    coloring: Coloring,
    seen: Sog,
    margin: Float[Array, "camera"],
    exponent: Float[Array, ""],
    capacity: int,
) -> tuple[SparsePairs, Int[Array, ""]]:
    """The blocks of pairs that matter to blobs `seen` by the cameras (projected), and how many there are.

    A count above `capacity` means that blocks were cut off: the caller must look at it and try a larger capacity.
    """
    images, capacity = _whole_tiles(images), -(-capacity // CHUNK) * CHUNK
    (num_cameras, num_bodies), num_images = seen.sigmas.shape, images.capacity
    running = margin[0] > 0.0
    flags = stage_barrier(running, _flags, images, coloring, seen, margin, exponent)
    chosen, count = stage_barrier(running, partial(chosen_indices, capacity=capacity * MEMBERS), flags.reshape(-1))
    tile, body_index, real = stage_barrier(
        running, partial(_blocks_of, tiles=flags.shape[1], members=flags.shape[2], num_bodies=num_bodies), chosen, count
    )
    slots = jnp.arange(TILE, dtype=chosen.dtype)[:, None]
    of_image = lambda values: _taken(values, tile[None, :] * TILE + slots)
    x, y, variances, scale = map(of_image, image_quantities(images))
    # Their derivatives by colours come from `colored_pairs`.
    similarities = jax.lax.stop_gradient(stage_barrier(running, coloring.of_listed, images, tile, body_index))
    amplitudes = jnp.where(real[:, None, :], similarities * scale[None], 0.0)
    image_shape, body_shape = (num_cameras, num_images), (num_cameras, num_bodies)
    count = count // MEMBERS
    pairs = SparsePairs(x[None], y[None], variances[None], amplitudes, tile, body_index, count, image_shape, body_shape)
    return pairs, count


def _blocks_of(
    chosen: Int[Array, "n"], count: Int[Array, ""], tiles: int, members: int, num_bodies: int
) -> tuple[Int[Array, "block"], Int[Array, "member block"], Bool[Array, "member block"]]:
    """The tile of every block and its body blobs, both counted over all cameras, and which members are no padding."""
    real = jnp.arange(chosen.shape[0], dtype=chosen.dtype) < count
    # Padding is spread over all places: sums into one and the same place would wait for each other.
    chosen = jnp.where(real, chosen, jnp.arange(chosen.shape[0], dtype=chosen.dtype) % (tiles * members))
    chosen, real = chosen.reshape(-1, MEMBERS).T, real.reshape(-1, MEMBERS).T
    tile = chosen[0] // members
    body = chosen - tile[None, :] * members
    real, body = real & (body < num_bodies), jnp.where(body < num_bodies, body, (tile[None, :] + body) % num_bodies)
    return tile, (tile // tiles)[None, :] * num_bodies + body, real


def _flags(images: Sog, coloring: Coloring, seen: Sog, margin: Array, exponent: Array) -> Array:
    """What `_near` and `_whole_blocks` say for all cameras."""
    near = jax.vmap(_near, in_axes=(0, None, 0, 0, None))(images, coloring, seen, margin, exponent)
    return _whole_blocks(near)


def _near(
    image: Sog,
    coloring: Coloring,
    seen: Sog,
    margin: Float[Array, ""],
    exponent: Float[Array, ""],
) -> Bool[Array, "tile body"]:
    """Tiles and body blobs of alike colours, of which a pair's exponential may exceed `NEGLIGIBLE` within the margin.

    A tile is taken for the box around its blobs, of pixels and of colours, with the size of its largest: so it counts
    too often, never too rarely, and no pair of single blobs is looked at.
    """
    by_slot = lambda values: [values[slot::TILE, None] for slot in range(TILE)]
    real = by_slot(image.mask)
    extreme = lambda values, choose, empty: reduce(
        choose, [jnp.where(r, v, empty) for r, v in zip(real, by_slot(values), strict=True)]
    )
    x, y = image.means[:, 0], image.means[:, 1]
    beyond = lambda axis, seen: jnp.maximum(
        jnp.maximum(extreme(axis, jnp.minimum, jnp.inf) - seen, seen - extreme(axis, jnp.maximum, -jnp.inf)), 0.0
    )
    dx, dy = beyond(x, seen.means[None, :, 0]), beyond(y, seen.means[None, :, 1])
    sigmas = extreme(image.sigmas, jnp.maximum, 0.0)
    reach = jnp.sqrt((sigmas**2 + (seen.sigmas**2)[None, :]) * (-jnp.log(NEGLIGIBLE) / exponent))
    channels = [image.colors[:, k] for k in range(3)]
    low = [extreme(channel, jnp.minimum, jnp.inf) for channel in channels]
    high = [extreme(channel, jnp.maximum, -jnp.inf) for channel in channels]
    of_body = [coloring.known_body_colors[None, :, k] for k in range(3)]
    alike = distance_from_box(of_body, low, high, coloring.space) < coloring.radius
    return alike & seen.mask[None, :] & (dx * dx + dy * dy < (reach + margin) ** 2)


def _whole_blocks(near: Bool[Array, "camera tile body"]) -> Bool[Array, "camera tile member"]:
    """The flags with as many members of padding behind the body blobs of each tile as fill its last block."""
    missing = -jnp.sum(near, axis=-1, dtype=jnp.int32)[..., None] % MEMBERS
    padding = jnp.arange(MEMBERS - 1, dtype=jnp.int32)[None, None, :] < missing
    return jnp.concatenate([near, padding], axis=-1)


def _taken(values: Array, index: Int[Array, "*slots block"]) -> Float[Array, "*slots block"]:
    return values.reshape(-1).at[index].get(mode="promise_in_bounds")


def _whole_tiles(images: Sog) -> Sog:
    """Images padded so that their blobs fill whole tiles."""
    extra = -images.capacity % TILE
    at_end = lambda leaf: jnp.pad(leaf, [(0, extra if k == 1 else 0) for k in range(leaf.ndim)])
    return images if extra == 0 else jax.tree.map(at_end, images)
