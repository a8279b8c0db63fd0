"""What the cameras see of a body in one frame at a chosen coarseness, without knowing where it is."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, UInt8

from sogjax.energy.overlap import EXACT_EXPONENT, overlaps, pair_color_similarities, self_overlaps
from sogjax.energy.views import Views, whole_image_overlap
from sogjax.model.body import Body
from sogjax.model.camera import Camera, project
from sogjax.model.color import from_rgb
from sogjax.model.sog import Sog
from sogjax.tracking.culling import CAPACITIES, ImageReader, actor_of_blobs, body_boxes, capacity_for, union_boxes

SMALLEST_CAPACITY = 512
Cells = UInt8[Array, "camera _rows _columns 3"]


class FrameViews(eqx.Module):
    """The pictures of one frame from coarse to fine, and the actors in them that were found already."""

    cameras: Camera
    readers: tuple[ImageReader, ...]
    cells: tuple[Cells, ...]
    found: tuple[Sog, ...] = ()
    """Blobs in the world of actors that were found: what they cover is theirs."""

    def with_found(self, body: Body, pose: Float[Array, "dof"]) -> "FrameViews":
        """The same frame, with one more actor found."""
        return FrameViews(self.cameras, self.readers, self.cells, (*self.found, body.posed_blobs(pose)))

    def views(self, level: int, body: Body, poses: Float[Array, "start dof"] | None = None) -> Views:
        """What is seen around some poses, or (None) anywhere.

        Colour similarities are those above chance: less the mean similarity of the body blob's colour with the whole
        frame. So a body gains nothing from covering pictures at random, however large it is in them, and a blob of the
        background's colour has little say.
        """
        reader, cells = self.readers[level], self.cells[level]
        boxes = _everywhere(self.cameras) if poses is None else _boxes(body, poses, self.cameras, reader)
        capacity = min(CAPACITIES[-1], reader.candidates.sigmas.shape[-1])
        capacity = _capacity_for(int(_near(reader, cells, boxes, capacity)[1].max()))
        chance = _chance(self.cameras, self.readers[0], self.cells[0], body)
        images, similarities = _compared(reader, cells, boxes, body, chance, capacity)
        for blobs in self.found:
            similarities = similarities * _left_over(self.cameras, images, blobs)[:, None, :]
        return Views(self.cameras, images, similarities, whole_image_overlap(self.cameras.image_size))


def _capacity_for(count: int) -> int:
    """A power of two: few sizes, so that the levels of a search share their programs."""
    return max(SMALLEST_CAPACITY, 1 << (capacity_for(count) - 1).bit_length())


def _everywhere(cameras: Camera) -> Float[Array, "camera 1 2 2"]:
    far = 10.0 * jnp.max(cameras.image_size)
    box = jnp.stack([jnp.stack([-far, -far]), jnp.stack([far, far])])
    return jnp.broadcast_to(box, (cameras.image_size.shape[0], 1, 2, 2))


@eqx.filter_jit
def _boxes(
    body: Body, poses: Float[Array, "start dof"], cameras: Camera, reader: ImageReader
) -> Float[Array, "camera actor 2 2"]:
    """Boxes around all the poses."""
    actors = actor_of_blobs(body.skeleton, body.blobs.joints)

    def around(pose: Float[Array, "dof"]) -> Float[Array, "camera actor 2 2"]:
        over_cameras = jax.vmap(body_boxes, in_axes=(None, 0, None, None))
        return over_cameras(body.posed_blobs(pose), cameras, actors, reader.box_enlargement)

    boxes = jax.lax.map(around, poses)
    whole = boxes[0]
    for k in range(1, poses.shape[0]):
        whole = union_boxes(whole, boxes[k])
    return whole


@eqx.filter_jit
def _near(reader: ImageReader, cells: Cells, boxes: Array, capacity: int) -> tuple[Sog, Int[Array, "camera"]]:
    rgb = cells.astype(boxes.dtype) / 255.0
    return reader.near_blobs(rgb, boxes, capacity)


@eqx.filter_jit
def _chance(cameras: Camera, reader: ImageReader, cells: Cells, body: Body) -> Float[Array, "blob"]:
    """Mean similarity of each body blob's colour with the pictures, by area."""
    images, _ = _near(reader, cells, _everywhere(cameras), reader.candidates.sigmas.shape[-1])
    areas = jnp.where(images.mask, (2.0 * images.sigmas) ** 2, 0.0)
    resembled = jnp.einsum("cbi,ci->b", _similarities(reader, images, body), areas, precision="highest")
    # Of the whole pictures: what equals an empty plate resembles nothing.
    return resembled / jnp.sum(jnp.prod(cameras.image_size, axis=-1))


@eqx.filter_jit
def _compared(
    reader: ImageReader, cells: Cells, boxes: Array, body: Body, chance: Float[Array, "blob"], capacity: int
) -> tuple[Sog, Float[Array, "camera body image"]]:
    images, _ = _near(reader, cells, boxes, capacity)
    above_chance = _similarities(reader, images, body) - chance[None, :, None]
    return images, jnp.where(images.mask[:, None, :], above_chance, 0.0)


def _similarities(reader: ImageReader, images: Sog, body: Body) -> Float[Array, "camera body image"]:
    blobs = body.posed_blobs(body.poses["rest"])
    colored = eqx.tree_at(lambda sog: sog.colors, blobs, from_rgb(body.blob_colors, reader.color_space))
    compare = lambda image: pair_color_similarities(image, colored, reader.color_space, reader.color_radius)
    return jax.lax.map(compare, images)


@eqx.filter_jit
def _left_over(cameras: Camera, images: Sog, blobs: Sog) -> Float[Array, "camera image"]:
    """The part of every image blob that blobs in the world do not cover."""

    def one_camera(camera: Camera, image: Sog) -> Float[Array, "image"]:
        same = jnp.ones((blobs.sigmas.shape[0], image.sigmas.shape[0]), image.sigmas.dtype)
        covered = overlaps(image, project(camera, blobs), same, jnp.asarray(EXACT_EXPONENT, image.sigmas.dtype))
        return jnp.maximum(1.0 - jnp.sum(covered, axis=0) / self_overlaps(image), 0.0)

    return jax.vmap(one_camera)(cameras, images)


def levels(depth: int) -> Sequence[int]:
    """Depths of the quad-trees of a search, from coarse to fine."""
    return (max(depth - 2, 1), max(depth - 1, 1), depth)
