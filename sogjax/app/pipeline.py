"""The stages of tracking beside each other: decoding and averaging, the tracking step, writing."""

import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float, UInt8

from sogjax.app.progress import progress
from sogjax.app.timing import StageTimes
from sogjax.data.recording import Recording
from sogjax.data.stages import ahead
from sogjax.images.cells import CellGrid, padded_cells, stack_shape
from sogjax.track.tracker import TrackedFrame, Tracker, track

FRAMES_AHEAD = 3
"""Frames that wait for the tracking step, beside the one that is being decoded."""

PictureMaker = Callable[[int, np.ndarray], np.ndarray | bytes | None]
"""Of the number of a camera and its picture (BGR)."""


class Picture(NamedTuple):
    """What is kept of one camera's picture."""

    cells: UInt8[np.ndarray, "rows columns 3"]
    tile: np.ndarray | bytes | None
    """For the overlay."""
    jpeg: np.ndarray | bytes | None
    """For the Rerun file."""
    seconds: float
    """That the cells took."""


class FrameDone(NamedTuple):
    """A tracked frame and the pictures it was tracked in."""

    tracked: TrackedFrame
    pictures: list[Picture]


PictureReader = Callable[[Recording, "Preparation", int, int], Iterator[list[Picture]]]
"""Of a recording, what to make of each picture, the first frame and the one after the last."""


FrameTracker = Callable[
    [Tracker, Float[Array, "dof"], Iterable[UInt8[np.ndarray, "_c _h _w 3"]]], Iterator[TrackedFrame]
]
"""What finds the poses of frames from their cells, one after the other, as `sogjax.track.tracker.track` does."""


def nothing(camera: int, image: np.ndarray) -> None:
    """Made of a picture that no output shows."""


@dataclass(frozen=True)
class Preparation:
    """What the decoding threads make of each picture before they drop it."""

    grids: tuple[CellGrid, ...]
    tile: PictureMaker = nothing
    jpeg: PictureMaker = nothing

    @property
    def cells_only(self) -> bool:
        """Whether cells are all that is needed."""
        return self.tile is nothing and self.jpeg is nothing

    def __call__(self, camera: int, image: np.ndarray) -> Picture:
        """The cells of a picture, and what outputs need of it."""
        begin = time.perf_counter()
        cells = padded_cells(image, self.grids[camera], stack_shape(self.grids))
        seconds = time.perf_counter() - begin
        return Picture(cells, self.tile(camera, image), self.jpeg(camera, image), seconds)


def tracked_frames(
    pictures: Iterator[list[Picture]],
    count: int,
    tracker: Tracker,
    start: Float[Array, "dof"],
    times: StageTimes,
    follow: FrameTracker = track,
) -> Generator[FrameDone, None, None]:
    """Track `count` frames, while a thread takes the pictures of those that follow.

    Raises:
        InputError: a video ends early, or a picture has too many image blobs.
    """
    waiting: deque[list[Picture]] = deque()
    with closing(ahead(pictures, FRAMES_AHEAD)) as ready:

        def cells() -> Iterator[UInt8[np.ndarray, "camera rows columns 3"]]:
            for frame in progress(times.timed("decode", ready), count, "tracking"):
                waiting.append(frame)
                times.add("cells", sum(picture.seconds for picture in frame))
                yield np.stack([picture.cells for picture in frame])

        begin = time.perf_counter()
        for tracked in follow(tracker, start, cells()):
            times.add("step", tracked.seconds)
            times.add("whole", time.perf_counter() - begin)
            begin = time.perf_counter()
            yield FrameDone(tracked, waiting.popleft())
