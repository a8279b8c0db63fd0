"""The pictures that the checks look at, each read once: a stretch of the videos, the empty scene, example poses."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from sogjax.io.example_poses import ExamplePose
from sogjax.io.image_file import read_mask
from sogjax.io.recording import Recording
from sogjax.io.video import read_prepared, read_still
from sogjax.scene.background_difference import background_difference, reduced_mask, working_size
from sogjax.scene.plates import FittedPlate, fitted_plate
from sogjax.scene.segmentation import first_guess, is_subject

Mask = Bool[np.ndarray, "_h _w"]
Picture = UInt8[np.ndarray, "_h _w 3"]
"""BGR, at the working size of masks."""
SCENE_FRAMES = 9
"""Frames of a camera whose median is taken."""
Progress = Callable[[Iterable[Any], int, str], Iterator[Any]]
"""Wraps an iterable, given its length and a label, and yields the same."""


@dataclass(frozen=True)
class Clip:
    """Consecutive frames of all cameras, in the order of the rig."""

    recording: Recording
    first: int
    """The recording's frame that is the first one here, counted from the recording's first."""
    grey: tuple[UInt8[np.ndarray, "frame _h _w"], ...]
    """Small pictures by camera, black where it is missing."""
    present: Bool[np.ndarray, "camera frame"]
    """Where a camera is not missing, so that there is something to check."""
    stills: dict[int, dict[int, Picture]]
    """A few pictures by frame of this clip and by camera that is present."""
    scene: dict[int, Picture]
    """The median of some frames of each camera that is present in any: who moves about is not in it."""

    @property
    def num_frames(self) -> int:
        """Frames that were read."""
        return len(self.grey[0])

    def frame_number(self, index: int) -> int:
        """The recording's number of a frame of this clip."""
        return self.first + index


@dataclass(frozen=True)
class Moment:
    """One moment as all cameras show it."""

    pictures: dict[int, Picture]
    """The pictures of the cameras (index in the rig) that are present."""
    masks: dict[int, Mask]
    """The subject's masks by camera; absent where none was found."""


def read_clip(recording: Recording, start: int, frames: int, progress: Progress) -> Clip:
    """A clip of at most `frames` frames from the frame `start` on.

    Raises:
        InputError: a video that ends early or changes its size.
    """
    stop = min(start + frames, recording.frames.stop)
    count = stop - start
    wanted = {int(k) for k in np.linspace(0, count - 1, 4)[1:-1]}
    for_scene = {int(k) for k in np.linspace(0, count - 1, min(SCENE_FRAMES, count))}
    sizes = [_small_size(*recording.rig.image_size(name)) for name in recording.rig.names]
    grey = tuple(np.zeros((count, height, width), np.uint8) for width, height in sizes)
    present = np.zeros((len(sizes), count), bool)
    stills: dict[int, dict[int, Picture]] = {}
    shown: dict[int, list[Picture]] = {}
    for index, pictures in enumerate(progress(read_prepared(recording, _reduced, start, stop), count, "reading")):
        found = {camera: both for camera, both in enumerate(pictures) if both is not None}
        for camera, (small, _) in found.items():
            grey[camera][index], present[camera, index] = small, True
        if index in wanted:
            stills[index] = {camera: still for camera, (_, still) in found.items()}
        if index in for_scene:
            for camera, (_, still) in found.items():
                shown.setdefault(camera, []).append(still)
    scene = {camera: np.median(several, axis=0).astype(np.uint8) for camera, several in shown.items()}
    return Clip(recording, start, grey, present, stills, scene)


def _small_size(width: int, height: int) -> tuple[int, int]:
    """Width and height of the grey pictures, the longer side 320 pixels."""
    factor = min(1.0, 320 / max(width, height))
    return max(1, round(factor * width)), max(1, round(factor * height))


def _reduced(camera: int, frame: int, image: UInt8[np.ndarray, "_h _w 3"] | None) -> tuple[np.ndarray, Picture] | None:
    """A picture small and grey, and in colour at the working size; None where the camera is missing."""
    if image is None:
        return None
    still = working_picture(image)
    small = cv2.resize(still, _small_size(image.shape[1], image.shape[0]), interpolation=cv2.INTER_AREA)
    return cv2.cvtColor(small, cv2.COLOR_BGR2GRAY), still


def working_picture(image: UInt8[np.ndarray, "_h _w 3"]) -> Picture:
    """A picture at the working size of masks."""
    return cv2.resize(image, working_size(image.shape[1], image.shape[0]), interpolation=cv2.INTER_AREA)


def stills_in_step(clip: Clip, offsets: Sequence[int]) -> list[dict[int, Picture]]:
    """The stills with each camera `offsets` frames later; which frames these are is known too late to keep them.

    Raises:
        InputError: a video that ends early.
    """
    if not any(offsets):
        return [*clip.stills.values()]
    names = clip.recording.rig.names
    moved = {name: clip.recording.frame_offset[name] + int(more) for name, more in zip(names, offsets, strict=True)}
    recording = replace(clip.recording, frame_offset=moved)
    border = int(np.abs(offsets).max())
    as_still = lambda camera, frame, image: None if image is None else working_picture(image)
    stills = []
    for index in sorted({int(np.clip(k, border, max(clip.num_frames - 1 - border, border))) for k in clip.stills}):
        frame = clip.first + index
        shown = next(read_prepared(recording, as_still, frame, frame + 1))
        stills.append({camera: picture for camera, picture in enumerate(shown) if picture is not None})
    return stills


@dataclass(frozen=True)
class Plates:
    """The pictures of the empty scene by camera (its index in the rig), at the working size."""

    given: dict[int, Picture]
    """As they are."""
    fitted: dict[int, FittedPlate]
    """As the videos would show them, of cameras whose videos show anything."""

    @property
    def in_place(self) -> dict[int, Picture]:
        """As they are, but moved to the place of the videos: in their own light."""
        moved = {k: plate.picture for k, plate in self.fitted.items() if plate.fits and plate.pixels}
        return {k: moved.get(k, picture) for k, picture in self.given.items()}

    @property
    def usable(self) -> dict[int, Picture]:
        """As the videos would show them, without those that do not fit, or in which something stands."""
        unseen = {camera: FittedPlate.unseen(picture) for camera, picture in self.given.items()}
        return {k: plate.picture for k, plate in (unseen | self.fitted).items() if plate.fits and not plate.other}


def read_plates(clip: Clip) -> Plates:
    """The pictures of the empty scene, held against what the videos show."""
    recording = clip.recording
    given = {
        camera: working_picture(read_still(recording, name, recording.background[name]))
        for camera, name in enumerate(recording.rig.names)
        if name in recording.background
    }
    shown = [camera for camera in given if camera in clip.scene]
    with ThreadPoolExecutor() as pool:
        fitted = pool.map(lambda camera: fitted_plate(given[camera], clip.scene[camera]), shown)
        return Plates(given, dict(zip(shown, fitted, strict=True)))


def video_moment(pictures: dict[int, Picture], backgrounds: Mapping[int, Picture]) -> Moment:
    """One moment of the videos, with masks where there are backgrounds."""
    with ThreadPoolExecutor() as pool:
        masks = pool.map(lambda camera: _from_background(pictures[camera], backgrounds.get(camera)), pictures)
        return Moment(
            pictures, {camera: mask for camera, mask in zip(pictures, masks, strict=True) if mask is not None}
        )


def example_moments(recording: Recording, backgrounds: Mapping[int, Picture]) -> list[Moment]:
    """The first two example poses, with their masks, or masks made from backgrounds, moved to their place."""
    pictured = [example for example in recording.example_poses if example.frame is None]
    return [_example_moment(recording, example, backgrounds) for example in pictured[:2]]


def _example_moment(recording: Recording, example: ExamplePose, backgrounds: Mapping[int, Picture]) -> Moment:
    names = recording.rig.names
    shown = [camera for camera, name in enumerate(names) if name in example.images]

    def look(camera: int) -> tuple[Picture, Mask | None]:
        name = names[camera]
        picture = working_picture(read_still(recording, name, example.images[name]))
        if name not in example.masks:
            plate = backgrounds.get(camera)
            return picture, _from_background(picture, None if plate is None else _moved_to(plate, picture))
        mask = reduced_mask(read_mask(example.masks[name]))
        return picture, mask if mask.any() and not mask.all() else None

    with ThreadPoolExecutor() as pool:
        found = dict(zip(shown, pool.map(look, shown), strict=True))
    masks = {camera: mask for camera, (_, mask) in found.items() if mask is not None}
    return Moment({camera: picture for camera, (picture, _) in found.items()}, masks)


def _moved_to(plate: Picture, picture: Picture) -> Picture:
    """A picture of the empty scene at the place of a photograph of the subject."""
    found = fitted_plate(plate, picture, same_light=True) if plate.shape == picture.shape else FittedPlate.unseen(plate)
    return found.picture if found.pixels else plate


def _from_background(picture: Picture, background: Picture | None) -> Mask | None:
    """What differs from the empty scene; None where there is no background or no subject."""
    if background is None:
        return None
    guess = first_guess(background_difference(picture, background))
    return guess if is_subject(guess) else None
