"""The stages of tracking, running concurrently: decoding and averaging, the tracking step, writing."""

import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float, UInt8

from sogjax.errors import InputError
from sogjax.io.recording import Recording
from sogjax.io.threads import prefetch
from sogjax.io.video import read_prepared
from sogjax.model.yuv_picture import YuvPicture
from sogjax.run.clock import StageTimes
from sogjax.run.terminal import progress
from sogjax.scene.cells import CellGrid, padded_cells, stack_shape
from sogjax.tracking.frame import FrameInput, TrackedFrame
from sogjax.tracking.tracker import Tracker

FRAMES_AHEAD = 3
"""Decoded frames waiting for the tracking step, at most."""

PictureMaker = Callable[[int, np.ndarray], np.ndarray | bytes | None]
"""Called with the index of a camera and its picture (BGR)."""


class Picture(NamedTuple):
    """What is kept of one camera's picture."""

    cells: UInt8[np.ndarray, "rows columns 3"] | None
    """None where the camera is missing."""
    tile: np.ndarray | bytes | None
    """For the overlay."""
    jpeg: np.ndarray | bytes | None
    """For the Rerun file."""
    seconds: float
    """Time taken by the cells."""


class FrameDone(NamedTuple):
    """A tracked frame and the pictures it was tracked in."""

    tracked: TrackedFrame
    pictures: list[Picture]


PictureReader = Callable[[Recording, "Preparation", int, int], Iterator[list[Picture]]]
"""Called with a recording, what to make of each picture, the first frame and the one after the last."""


FrameTracker = Callable[[Tracker, Float[Array, "dof"], Iterable[FrameInput]], Iterator[TrackedFrame]]
"""Finds the poses of frames from their cells in turn, as `sogjax.tracking.frame_by_frame.track` does."""


Follow = Callable[[Iterable[FrameInput]], Iterator[TrackedFrame]]
"""The same with a tracker that knows where it begins."""


def no_picture(camera: int, image: np.ndarray) -> None:
    """Made of a picture that no output needs."""


@dataclass(frozen=True)
class Preparation:
    """What the decoding threads make of each picture before they drop it."""

    grids: tuple[CellGrid, ...]
    tile: PictureMaker = no_picture
    jpeg: PictureMaker = no_picture

    @property
    def cells_only(self) -> bool:
        """Whether only the cells are needed."""
        return self.tile is no_picture and self.jpeg is no_picture

    def __call__(self, camera: int, image: np.ndarray | YuvPicture | None) -> Picture:
        """The cells of a picture and what the outputs need of it; empty if there is no picture."""
        if image is None:
            return Picture(None, None, None, 0.0)
        begin = time.perf_counter()
        cells = padded_cells(image, self.grids[camera], stack_shape(self.grids))
        seconds = time.perf_counter() - begin
        if self.cells_only:
            return Picture(cells, None, None, seconds)
        shown = image.bgr() if isinstance(image, YuvPicture) else image
        return Picture(cells, self.tile(camera, shown), self.jpeg(camera, shown), seconds)


def read_pictures(recording: Recording, preparation: Preparation, first: int, last: int) -> Iterator[list[Picture]]:
    """What is made of the pictures of each frame, with the least work: no picture is converted that nothing shows.

    Raises:
        InputError: a video ends early or changes its size.
    """
    return read_prepared(recording, preparation, first, last, planes=True)


def frame_input(cells: Sequence[UInt8[np.ndarray, "rows columns 3"] | None]) -> FrameInput:
    """The frame with the cells of all cameras; None: a camera has no picture.

    Raises:
        InputError: all cameras are missing.
    """
    some = next((of_camera for of_camera in cells if of_camera is not None), None)
    if some is None:
        raise InputError("a frame has no picture from any camera; track the frames before or after it (start=, stop=)")
    stacked = np.stack([np.zeros_like(some) if of_camera is None else of_camera for of_camera in cells])
    present = np.array([of_camera is not None for of_camera in cells])
    return FrameInput(stacked, None if present.all() else present)


def tracked_frames(
    pictures: Iterator[list[Picture]],
    count: int,
    times: StageTimes,
    follow: Follow,
) -> Generator[FrameDone, None, None]:
    """Track `count` frames, while a thread reads the pictures of later ones.

    Raises:
        InputError: a video ends early, or a picture has too many image blobs.
    """
    waiting: deque[list[Picture]] = deque()
    with closing(prefetch(pictures, FRAMES_AHEAD)) as ready:

        def cells() -> Iterator[FrameInput]:
            for frame in progress(times.timed("decode", ready), count, "tracking"):
                waiting.append(frame)
                times.add("cells", sum(picture.seconds for picture in frame))
                yield frame_input([picture.cells for picture in frame])

        begin = time.perf_counter()
        for tracked in follow(cells()):
            if tracked.seconds > 0.0:  # not where a frame was tracked before
                times.add("step", tracked.seconds)
            times.add("whole", time.perf_counter() - begin)
            begin = time.perf_counter()
            yield FrameDone(tracked, waiting.popleft())
