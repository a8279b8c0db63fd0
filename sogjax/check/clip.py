"""A short stretch of a recording, read once at reduced size, for the checks of pictures."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from sogjax.io.recording import Recording
from sogjax.io.video import read_prepared
from sogjax.scene.plate_difference import working_size

SMALL = 320
"""Pixels of the longer side of the grey pictures."""
NUM_STILLS = 2

Progress = Callable[[Iterable[Any], int, str], Iterator[Any]]
"""Wraps an iterable, given its length and a label, and yields the same."""


@dataclass(frozen=True)
class Clip:
    """Consecutive frames of all cameras, in the order of the rig."""

    recording: Recording
    first: int
    """The recording's frame that is the first one here, counted from the recording's first."""
    grey: tuple[UInt8[np.ndarray, "frame _h _w"], ...]
    """By camera, the longer side `SMALL` pixels; black where the camera is missing."""
    present: Bool[np.ndarray, "camera frame"]
    """Where it is not missing, so that there is something to check."""
    stills: dict[int, dict[int, UInt8[np.ndarray, "_y _x 3"]]]
    """By frame of this clip and by camera that is present, a few pictures (BGR) at the working size of masks."""

    @property
    def num_frames(self) -> int:
        """Frames that were read."""
        return len(self.grey[0])

    def frame_number(self, index: int) -> int:
        """The recording's number of a frame of this clip."""
        return self.recording.first_frame + self.first + index


def small_size(width: int, height: int) -> tuple[int, int]:
    """Width and height of the grey pictures."""
    factor = min(1.0, SMALL / max(width, height))
    return max(1, round(factor * width)), max(1, round(factor * height))


def working_picture(image: UInt8[np.ndarray, "_h _w 3"]) -> UInt8[np.ndarray, "_y _x 3"]:
    """A picture at the working size of masks."""
    return cv2.resize(image, working_size(image.shape[1], image.shape[0]), interpolation=cv2.INTER_AREA)


def black_picture(recording: Recording, camera: int) -> UInt8[np.ndarray, "_y _x 3"]:
    """What stands for the picture of a camera that is missing, at the working size of masks."""
    width, height = recording.rig.image_size(recording.rig.names[camera])
    return working_picture(np.zeros((height, width, 3), np.uint8))


def read_clip(recording: Recording, start: int, frames: int, progress: Progress) -> Clip:
    """At most `frames` frames from `start` on, which counts from the recording's first frame.

    Raises:
        InputError: a video that ends early or changes its size.
    """
    stop = min(start + frames, recording.num_frames)
    count = stop - start
    wanted = {int(k) for k in np.linspace(0, count - 1, NUM_STILLS + 2)[1:-1]}
    sizes = [small_size(*recording.rig.image_size(name)) for name in recording.rig.names]
    grey = tuple(np.zeros((count, height, width), np.uint8) for width, height in sizes)
    present = np.zeros((len(sizes), count), bool)
    stills: dict[int, dict[int, np.ndarray]] = {}
    for index, pictures in enumerate(progress(read_prepared(recording, _reduced, start, stop), count, "reading")):
        found = {camera: both for camera, both in enumerate(pictures) if both is not None}
        for camera, (small, _) in found.items():
            grey[camera][index], present[camera, index] = small, True
        if index in wanted:
            stills[index] = {camera: still for camera, (_, still) in found.items()}
    return Clip(recording, start, grey, present, stills)


def _reduced(camera: int, image: UInt8[np.ndarray, "_h _w 3"] | None) -> tuple[np.ndarray, np.ndarray] | None:
    """A picture small and grey, and in colour at the working size of masks; None where the camera is missing."""
    if image is None:
        return None
    still = working_picture(image)
    small = cv2.resize(still, small_size(image.shape[1], image.shape[0]), interpolation=cv2.INTER_AREA)
    return cv2.cvtColor(small, cv2.COLOR_BGR2GRAY), still
