"""Example poses as silhouettes: what Eq. 9 compares a body of unknown shape and pose with."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, UInt8

from sogjax.actor.example_masks import example_masks
from sogjax.energy.views import Views, whole_image_overlap
from sogjax.errors import InputError
from sogjax.io.example_poses import ExamplePose
from sogjax.io.recording import Recording
from sogjax.io.video import read_chosen, read_still
from sogjax.model.camera import Camera, camera_of
from sogjax.model.compiled import compiled_hastily
from sogjax.model.cores import in_threads
from sogjax.model.sog import Sog
from sogjax.scene.background import BackgroundImage
from sogjax.scene.cells import CellGrid, stack_cells
from sogjax.scene.quadtree import Candidates, keep_blobs, quadtree
from sogjax.scene.segmentation import FoundMasks
from sogjax.scene.visual_hull import central_ray, nearest_point
from sogjax.tracking.culling import capacity_for

BACKGROUND_SIMILARITY = -0.15
"""d(c_i, c_j) of the body's colour with the background's. Eq. 7 has 0 there; then a blob could grow without end.
At -0.15 a blob of sigma r / 1.35 fits a disc of radius r best."""
DEPTH, COARSE_DEPTH = 7, 6
"""Depth of the quad-tree of a silhouette, and where poses are only told apart; the edges are fitted to cells of their
own."""
SILHOUETTE_TOLERANCE = 0.15

Progress = Callable[[Iterable[Any], int, str], Iterable[Any]]
"""Wraps items, of which there are so many, to show the progress under a label."""


def silently(items: Iterable[Any], total: int, label: str) -> Iterable[Any]:
    """The `Progress` that nobody sees."""
    return items


@dataclass(frozen=True)
class PosedPictures:
    """The pictures of one example pose by camera (its index in the rig), with their masks."""

    name: str
    images: dict[int, UInt8[np.ndarray, "_h _w 3"]]
    """BGR."""
    masks: dict[int, Bool[np.ndarray, "_h _w"]]
    untold: dict[int, Bool[np.ndarray, "_h _w"]] = field(default_factory=dict)
    """Where masks say nothing; none where a camera's says something everywhere."""
    warnings: tuple[str, ...] = ()
    """What was noticed about the masks, one sentence each."""
    undecided: bool = False
    """Whether the masks say nothing where the background is unknown."""

    def mask_share(self) -> float:
        """Share of the pictures that the masks take."""
        return float(np.mean([mask.mean() for mask in self.masks.values()]))


@dataclass
class SharedFrames:
    """What example poses share that are the same frames of the videos: each is read and told from the room once."""

    images: dict[int, dict[int, UInt8[np.ndarray, "_h _w 3"]]] = field(default_factory=dict)
    """All pictures (BGR) of each frame, by camera."""
    masks: dict[int, dict[bool, FoundMasks]] = field(default_factory=dict)
    """What `example_masks` keeps of each frame."""

    def read(self, recording: Recording, examples: Sequence[ExamplePose]) -> None:
        """Read the frames of example poses that are not known yet, each video in one pass."""
        frames = {example.frame for example in examples if example.frame is not None}
        self.images |= _images_of_frames(recording, frames - {*self.images})

    def of(
        self, recording: Recording, example: ExamplePose
    ) -> tuple[dict[int, UInt8[np.ndarray, "_h _w 3"]], dict[bool, FoundMasks]]:
        """The pictures of an example pose, and what is kept of its masks: nothing where they are files."""
        if example.frame is None:
            return load_images(recording, example), {}
        self.read(recording, [example])
        return self.images[example.frame], self.masks.setdefault(example.frame, {})


def load_pictures(
    recording: Recording,
    example: ExamplePose,
    learnt: Sequence[BackgroundImage] | None = None,
    shared: SharedFrames | None = None,
) -> PosedPictures:
    """The pictures of an example pose that have masks, or for which masks can be made (`example_masks`).

    Raises:
        InputError: fewer than two cameras have a picture and a mask, or one of the empty scene; a mask that is empty
            or full; a picture of another size.
    """
    images, known = (shared or SharedFrames()).of(recording, example)
    masks = example_masks(recording, example, images, learnt, known)
    shown = {k: images[k] for k in masks.masks}
    return PosedPictures(example.name, shown, masks.masks, masks.untold, masks.warnings, masks.undecided)


def load_all_pictures(
    recording: Recording,
    examples: Sequence[ExamplePose],
    learnt: Sequence[BackgroundImage] | None = None,
    shared: SharedFrames | None = None,
    progress: Progress = silently,
) -> list[PosedPictures]:
    """`load_pictures` of each example pose; those in one frame of the videos in one thread.

    Raises:
        InputError: as `load_pictures`.
    """
    shared = shared or SharedFrames()
    shared.read(recording, examples)
    together: dict[str | int, list[int]] = {}
    for place, example in enumerate(examples):
        together.setdefault(example.name if example.frame is None else example.frame, []).append(place)
    load = lambda places: {k: load_pictures(recording, examples[k], learnt, shared) for k in places}
    watched = lambda loaded: progress(loaded, len(together), "masks")
    found = in_threads(load, together.values(), watched=watched)
    pictures = {place: posed for loaded in found for place, posed in loaded.items()}
    return [pictures[k] for k in range(len(examples))]


def load_images(recording: Recording, example: ExamplePose) -> dict[int, UInt8[np.ndarray, "_h _w 3"]]:
    """All pictures (BGR) of an example pose, by camera (its index in the rig).

    Raises:
        InputError: a picture of another size than the calibration's, or a video that cannot be read.
    """
    if example.frame is not None:
        return _images_of_frames(recording, [example.frame])[example.frame]
    cameras = [(k, name) for k, name in enumerate(recording.rig.names) if name in example.images]
    images = in_threads(lambda camera: read_still(recording, camera[1], example.images[camera[1]]), cameras)
    for (_, name), image in zip(cameras, images, strict=True):
        _check_picture(example.images[name], image, recording.rig.image_size(name))
    return {k: image for (k, _), image in zip(cameras, images, strict=True)}


def _images_of_frames(
    recording: Recording, frames: Iterable[int]
) -> dict[int, dict[int, UInt8[np.ndarray, "_h _w 3"]]]:
    """The pictures (BGR) of frames, by camera."""
    shown = read_chosen(recording, frames)
    return {frame: {k: image for k, image in enumerate(images) if image is not None} for frame, images in shown}


def _check_picture(path: Path, image: UInt8[np.ndarray, "_h _w 3"], size: tuple[int, int]) -> None:
    height, width = image.shape[:2]
    if (width, height) != size:
        raise InputError(
            f"{path}: is {width}x{height} pixels, the calibration is for {size[0]}x{size[1]}; "
            "use pictures of the calibrated size"
        )


def silhouette_views(pictures: Sequence[PosedPictures], rig: Camera, num_blobs: int, depth: int = DEPTH) -> list[Views]:
    """The masks of each example pose as Sogs: blobs of the subject match the body, others repel it a little.

    Where a mask says nothing, and in a camera without a picture, blobs do neither. All have one shape, so that one
    program serves them.
    """
    sizes = np.asarray(rig.image_size).astype(int)
    grids = tuple(CellGrid.from_depth(int(width), int(height), depth) for width, height in sizes)
    candidates, normalizers = Candidates.from_grids(grids, rig), whole_image_overlap(rig.image_size)
    cells = [jnp.asarray(_mask_cells(posed, sizes, grids)) for posed in pictures]
    leaves = [_leaves(of_pose, candidates) for of_pose in cells]
    capacity = capacity_for(max(int(np.asarray(chosen).sum(axis=1).max()) for _, chosen in leaves))
    views = []
    for posed, of_pose in zip(pictures, leaves, strict=True):
        present = jnp.asarray(np.array([k in posed.masks for k in range(len(grids))]))
        images, similarities = _silhouette_sogs(*of_pose, candidates, present, capacity, num_blobs)
        views.append(Views(rig, images, similarities, normalizers))
    return views


def _mask_cells(
    pictures: PosedPictures, sizes: Int[np.ndarray, "camera 2"], grids: tuple[CellGrid, ...]
) -> UInt8[np.ndarray, "camera rows columns 3"]:
    """Cells of pictures that are white where the masks are, and blue where they say nothing."""
    nothing = {k: np.zeros((height, width), bool) for k, (width, height) in enumerate(sizes)}
    white = {k: pictures.masks.get(k, nothing[k]) for k in nothing}
    drawn = [np.dstack([white[k] | pictures.untold.get(k, nothing[k]), white[k], white[k]]) for k in nothing]
    return stack_cells([picture.astype(np.uint8) * 255 for picture in drawn], grids)


@compiled_hastily
def _leaves(
    cells: UInt8[Array, "camera rows columns 3"], candidates: Candidates
) -> tuple[Float[Array, "camera candidate 3"], Bool[Array, "camera candidate"]]:
    """The mean colours of all candidates for a blob, and which of them are chosen."""
    tolerance = jnp.asarray(SILHOUETTE_TOLERANCE, candidates.sigmas.dtype)
    return jax.vmap(quadtree, in_axes=(0, 0, None))(cells.astype(tolerance.dtype) / 255.0, candidates, tolerance)


@compiled_hastily
def _silhouette_sogs(
    colors: Float[Array, "camera candidate 3"],
    leaves: Bool[Array, "camera candidate"],
    candidates: Candidates,
    present: Bool[Array, "camera"],
    capacity: int,
    num_blobs: int,
) -> tuple[Sog, Float[Array, "camera body image"]]:
    """The image blobs and how each matches the colour of the body's blobs."""
    leaves = leaves & present[:, None]
    select = jax.vmap(keep_blobs, in_axes=(0, 0, 0, 0, None))
    images, _, _ = select(candidates.means, candidates.sigmas, colors, leaves, capacity)
    coverage, told = images.colors[..., 0], 1.0 - (images.colors[..., 2] - images.colors[..., 0])
    match = coverage + (told - coverage) * BACKGROUND_SIMILARITY
    match = jnp.where(images.mask, match, 0.0)
    return images, jnp.repeat(match[:, None, :], num_blobs, axis=1)


def subject_centre(pictures: PosedPictures, rig: Camera) -> Float[np.ndarray, "3"]:
    """The point nearest to the rays through the centres of all masks: about the subject's centre (metres, world)."""
    rays = [central_ray(mask, camera_of(rig, camera)) for camera, mask in pictures.masks.items()]
    eyes, directions, _ = (np.array(part) for part in zip(*rays, strict=True))
    return nearest_point(eyes, directions)


def stack_views(views: Sequence[Views]) -> Views:
    """Views of several poses, of one shape, with a leading axis for the poses."""
    return jax.tree.map(lambda *leaves: jnp.asarray(np.stack([np.asarray(leaf) for leaf in leaves])), *views)
