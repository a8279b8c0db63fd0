"""Example poses as silhouettes: what Eq. 9 compares a body of unknown shape and pose with."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, UInt8

from sogjax.data.image_file import read_image, read_mask
from sogjax.data.recording import ExamplePose, Recording
from sogjax.energy.objective import Views, whole_image_overlap
from sogjax.errors import InputError
from sogjax.images.cells import CellGrid, stack_cells
from sogjax.images.quadtree import Candidates, keep_blobs, quadtree
from sogjax.model.camera import Camera
from sogjax.model.sog import Sog
from sogjax.track.culling import capacity_for

BACKGROUND_SIMILARITY = -0.15
"""d(c_i, c_j) of the body's colour with the background's. Eq. 7 has 0 there; then a blob could grow without end.
At -0.15 a blob of sigma r / 1.35 fits a disc of radius r best."""
COARSE_DEPTH, FINE_DEPTH = 7, 8
"""Depths of the quad-tree of a silhouette, for finding a pose and for fitting the shape."""
SILHOUETTE_TOLERANCE = 0.15


@dataclass(frozen=True)
class PosedPictures:
    """The pictures of one example pose, by camera index, with their masks where there are any."""

    name: str
    cameras: tuple[int, ...]
    images: tuple[UInt8[np.ndarray, "_h _w 3"], ...]
    """BGR."""
    masks: tuple[Bool[np.ndarray, "_h _w"], ...]


def load_pictures(recording: Recording, example: ExamplePose) -> PosedPictures:
    """The pictures of an example pose that have masks.

    Raises:
        InputError: fewer than two cameras have a picture with a mask; a mask that is empty or full.
    """
    names = [name for name in recording.rig.names if name in example.images and name in example.masks]
    if len(names) < 2:
        raise InputError(
            f"{recording.path}: the example pose {example.name!r} has {len(names)} pictures with a mask; "
            "give CAMERA.mask.png (white = subject) beside at least two pictures"
        )
    masks = tuple(read_mask(example.masks[name]) for name in names)
    for name, mask in zip(names, masks, strict=True):
        if mask.all() or not mask.any():
            raise InputError(
                f"{example.masks[name]}: the mask is {'full' if mask.all() else 'empty'}; white must mark the subject"
            )
    return PosedPictures(
        example.name,
        tuple(recording.rig.names.index(name) for name in names),
        tuple(read_image(example.images[name]) for name in names),
        masks,
    )


def silhouette_views(pictures: PosedPictures, rig: Camera, num_blobs: int, depth: int) -> Views:
    """The masks of one example pose as Sogs: blobs of the subject match the body, others repel it a little."""
    cameras = jax.tree.map(lambda leaf: jnp.asarray(leaf)[np.array(pictures.cameras)], rig)
    grids = tuple(CellGrid.from_depth(m.shape[1], m.shape[0], depth) for m in pictures.masks)
    white = [np.repeat(mask[..., None], 3, axis=-1).astype(np.uint8) * 255 for mask in pictures.masks]
    cells = jnp.asarray(stack_cells(white, grids), cameras.intrinsics.dtype) / 255.0
    candidates = Candidates.from_grids(grids, cameras)
    tolerance = jnp.asarray(SILHOUETTE_TOLERANCE, cells.dtype)
    colors, leaves = jax.jit(jax.vmap(quadtree, in_axes=(0, 0, None)))(cells, candidates, tolerance)
    capacity = capacity_for(int(leaves.sum(axis=1).max()))
    select = jax.vmap(keep_blobs, in_axes=(0, 0, 0, 0, None))
    images, _, _ = select(candidates.means, candidates.sigmas, colors, leaves, capacity)
    coverage = images.colors[..., 0]
    match = coverage + (1.0 - coverage) * BACKGROUND_SIMILARITY
    match = jnp.where(images.mask, match, 0.0)
    similarities = jnp.repeat(match[:, None, :], num_blobs, axis=1)
    return Views(cameras, images, similarities, whole_image_overlap(cameras.image_size))


def subject_centre(pictures: PosedPictures, rig: Camera) -> Float[np.ndarray, "3"]:
    """The point nearest to the rays through the centres of all masks: about the subject's centre (metres, world)."""
    normal = np.zeros((3, 3))
    target = np.zeros(3)
    for camera, mask in zip(pictures.cameras, pictures.masks, strict=True):
        pixel = np.argwhere(mask)[:, ::-1].mean(axis=0)
        matrix = np.asarray(rig.intrinsics[camera], float)
        world = np.asarray(rig.camera_from_world[camera], float)
        direction = world[:3, :3].T @ np.linalg.solve(matrix, [*pixel, 1.0])
        direction /= np.linalg.norm(direction)
        across = np.eye(3) - np.outer(direction, direction)
        normal += across
        target += across @ (-world[:3, :3].T @ world[:3, 3])
    return np.linalg.solve(normal, target)


def pad_views(views: Views, capacity: int) -> Views:
    """The same views with more padding, so that several pose's views have one shape (and compile once)."""
    extra = capacity - views.images.capacity
    at_end = lambda leaf, fill=0.0: jnp.pad(leaf, ((0, 0), (0, extra)), constant_values=fill)
    images = Sog(
        jnp.pad(views.images.means, ((0, 0), (0, extra), (0, 0))),
        at_end(views.images.sigmas, 1.0),
        jnp.pad(views.images.colors, ((0, 0), (0, extra), (0, 0))),
        at_end(views.images.mask, False),
    )
    similarities = jnp.pad(views.color_similarities, ((0, 0), (0, 0), (0, extra)))
    return Views(views.cameras, images, similarities, views.normalizers)


def body_centre(blobs_means: Float[Array, "blob 3"], sigmas: Float[Array, "blob"]) -> Float[Array, "3"]:
    """The centre of a body's blobs, weighted by the areas they cover in a picture."""
    area = sigmas**2
    return jnp.sum(blobs_means * area[:, None], axis=0) / jnp.sum(area)
