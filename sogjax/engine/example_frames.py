"""Example poses from the frames of the videos, where a recording has none."""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import cv2
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.actor.frame_choice import Mask, SeenShape, seen_shape, spread_choice, subject_cubes
from sogjax.data.example_settings import frame_name
from sogjax.data.recording import ExamplePose, Recording
from sogjax.data.sampled_frames import camera_samples, spread_frames
from sogjax.engine.background import background_or_reason
from sogjax.engine.build import cell_grids
from sogjax.engine.terminal import say
from sogjax.errors import InputError
from sogjax.images.background import CameraBackground, stack_background
from sogjax.images.cells import CellGrid
from sogjax.images.foreground import EmptyScene, log_odds
from sogjax.images.segmentation import largest_parts
from sogjax.images.visual_hull import resized
from sogjax.model.frames import axis_vector
from sogjax.sentences import counted
from sogjax.settings import ImagesConfig

MOST_LOOKED_AT = 40
NUM_TRIED, NUM_EXAMPLES = 8, 5
"""Frames in which the pose is looked for, and those of them that the actor is made of."""
FEWEST_EXAMPLES = 2
DEPTH = 9
"""Of the quad-tree whose cells are looked at."""
LEAST_KNOWN, MOSTLY_KNOWN = 0.6, 0.95
"""Part of the silhouettes where the background must be, and had better be, known."""
FEW_CAMERAS = 4
"""Fewer of them see too little of a body."""
FOREGROUND = 0.5
"""Log odds above which a cell counts as foreground."""
AGREEING = 0.45
"""Least agreement of hull and silhouettes: below, they are no subject's."""


def with_examples(
    recording: Recording, images: ImagesConfig
) -> tuple[Recording, tuple[CameraBackground, ...] | None, int | None]:
    """The recording with example poses, its own or frames of its videos, and the background that their masks need.

    The number is that of the frames to keep, those in which the pose is found best; None: all, since they were given.

    Raises:
        InputError: as `with_example_frames`.
    """
    if not recording.example_poses:
        return (*with_example_frames(recording, images), NUM_EXAMPLES)
    found = background_or_reason(recording, images) if _need_background(recording) else None
    return recording, None if isinstance(found, str) else found, None


def _need_background(recording: Recording) -> bool:
    """Whether some picture of an example pose has neither a mask nor a picture of the empty scene."""
    without = lambda example: [
        name for name in example.images if name not in example.masks and name not in recording.background
    ]
    return any(example.frame is not None or without(example) for example in recording.example_poses)


def with_example_frames(recording: Recording, images: ImagesConfig) -> tuple[Recording, tuple[CameraBackground, ...]]:
    """The recording with frames of its videos as example poses, and the background that their masks need.

    Raises:
        InputError: no background can be learnt, or no frames show one person whole and apart from it.
    """
    learnt = _background(recording, images)
    shapes = seen_shapes(recording, learnt)
    chosen = spread_choice([shape for shape in shapes if shape.agreement > AGREEING], NUM_TRIED)
    if (problem := unsuitable(shapes)) is not None:
        raise InputError(f"{recording.path}: no example poses can be taken from the videos, since {problem}")
    numbers = [shape.frame + recording.first_frame for shape in chosen]
    shown = ", ".join(map(str, numbers))
    say(f"example poses: frames {shown} of the videos ({counted(len(shapes), 'frame')} looked at)")
    say(f"the actor would gain most from {most_helpful(chosen, len(recording.rig.names))}")
    examples = tuple(
        ExamplePose(frame_name(number), None, {}, {}, None, shape.frame)
        for number, shape in zip(numbers, chosen, strict=True)
    )
    return replace(recording, example_poses=examples), learnt


def _background(recording: Recording, images: ImagesConfig) -> tuple[CameraBackground, ...]:
    found = background_or_reason(recording, images)
    if isinstance(found, str):
        raise InputError(
            f"{recording.path}: there are no example poses (example_poses/POSE/CAMERA.jpg with CAMERA.mask.png), no "
            f"actor=FILE, and none can be taken from the videos: {found}"
        )
    return found


def unsuitable(shapes: Sequence[SeenShape]) -> str | None:
    """Why no example poses can be taken from frames, and the remedy; None: they can."""
    if shapes and np.median([shape.num_bodies for shape in shapes]) > 1.0:
        return (
            "they show more than one person; list frames in which each is alone as example_poses in recording.yaml, "
            "such as [{frame: 12, actor: anna}, {frame: 300, actor: ben}], or give actor files with actor=[...]"
        )
    if shapes and np.median([shape.known for shape in shapes]) < LEAST_KNOWN:
        return (
            "the subject stands in the same place throughout, and what is behind is never seen; give pictures of the "
            "empty scene as background/CAMERA.jpg"
        )
    if sum(shape.agreement > AGREEING for shape in shapes) < FEWEST_EXAMPLES:
        return (
            "nobody is seen in them whole and apart from the background; give pictures of the empty scene as "
            "background/CAMERA.jpg, or example_poses/POSE/CAMERA.jpg with CAMERA.mask.png"
        )
    return None


def most_helpful(chosen: Sequence[SeenShape], num_cameras: int) -> str:
    """What would improve an actor that is made of frames most."""
    if np.mean([shape.known for shape in chosen]) < MOSTLY_KNOWN:
        return "pictures of the empty scene (background/CAMERA.jpg): a part of it is never seen in the videos"
    if num_cameras < FEW_CAMERAS:
        return f"more cameras: there are {num_cameras}"
    return "pictures of a T-pose, of bent elbows and of a squat (example_poses/POSE/CAMERA.jpg)"


def seen_shapes(recording: Recording, learnt: Sequence[CameraBackground]) -> list[SeenShape]:
    """What frames spread over the videos show, where somebody is seen."""
    grids = cell_grids(recording, DEPTH)
    empty = EmptyScene.from_background(stack_background(learnt, grids))
    sampled = _samples(recording, grids)
    frames = sorted(set.intersection(*(set(of_camera) for of_camera in sampled)))
    known = np.asarray(empty.known)
    sides = [(grid.width / grid.cell_size, grid.height / grid.cell_size) for grid in grids]
    cameras = {k: resized(recording.rig.camera(name), sides[k]) for k, name in enumerate(recording.rig.names)}
    masks, unknown = [], {k: ~known[k, : grid.rows, : grid.columns] for k, grid in enumerate(grids)}
    for frame in frames:
        odds = _odds([of_camera[frame] for of_camera in sampled], grids, empty)
        masks.append({k: _mask(odds[k, : grid.rows, : grid.columns]) for k, grid in enumerate(grids)})
    up = axis_vector(recording.up)
    shapes = [
        seen_shape(frame, seen, unknown, cameras, cube, up)
        for frame, seen, cube in zip(frames, masks, subject_cubes(masks, cameras), strict=True)
        if cube is not None
    ]
    return [shape for shape in shapes if shape is not None]


def _samples(recording: Recording, grids: Sequence[CellGrid]) -> list[dict[int, UInt8[np.ndarray, "_rows _columns 3"]]]:
    """The cells (BGR) of frames spread over the videos, camera by camera."""
    names = recording.rig.names
    frames = spread_frames(recording.num_frames, MOST_LOOKED_AT)
    with ThreadPoolExecutor(min(len(names), os.cpu_count() or 1)) as pool:
        read = lambda k: camera_samples(recording, names[k], frames, grids[k].averages)
        return list(pool.map(read, range(len(names))))


def _odds(
    pictures: Sequence[UInt8[np.ndarray, "_rows _columns 3"]], grids: Sequence[CellGrid], empty: EmptyScene
) -> Float[np.ndarray, "camera rows columns"]:
    shape = empty.known.shape
    cells = np.zeros((*shape, 3), np.float32)
    for k, (picture, grid) in enumerate(zip(pictures, grids, strict=True)):
        cells[k, : grid.rows, : grid.columns] = picture[..., ::-1] / 255.0
    return np.asarray(log_odds(jnp.asarray(cells), empty, None))


def _mask(odds: Float[np.ndarray, "rows columns"]) -> Mask:
    found = cv2.morphologyEx((odds > FOREGROUND).astype(np.uint8), cv2.MORPH_OPEN, np.ones((2, 2), np.uint8))
    return largest_parts(found > 0)
