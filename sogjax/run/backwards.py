"""Tracking backwards: from a frame in the middle of a clip, whose pose is known, to its first one."""

from collections.abc import Iterable, Iterator

from jaxtyping import Array, Float

from sogjax.io.cell_cache import cell_cache
from sogjax.io.recording import Recording
from sogjax.run.clock import StageTimes
from sogjax.run.pipeline import Preparation, frame_input, read_pictures
from sogjax.run.prefix import Prefix
from sogjax.run.terminal import progress, say
from sogjax.scene.cells import CellGrid
from sogjax.settings.method import ImagesConfig
from sogjax.tracking.frame import FrameInput, TrackedFrame
from sogjax.tracking.frame_by_frame import track
from sogjax.tracking.tracker import Tracker

BLOCK = 48
"""Frames that are decoded at once, since videos are read forwards only."""


def tracked_backwards(
    tracker: Tracker, start: Float[Array, "dof"], frames: Iterable[FrameInput], count: int, times: StageTimes
) -> Prefix:
    """`count` frames that come backwards, tracked from a rough pose of the first to come; in the order of the clip.

    Raises:
        InputError: a video cannot be read, or a picture has too many image blobs.
    """

    def timed() -> Iterator[TrackedFrame]:
        for tracked in track(tracker, start, progress(frames, count, "tracking backwards")):
            times.add("step", tracked.seconds)
            yield tracked

    return Prefix.from_frames(timed())


def frames_backwards(
    recording: Recording, grids: tuple[CellGrid, ...], images: ImagesConfig, first: int, last: int
) -> Iterator[FrameInput]:
    """The cells of the frames from `first` to before `last`, the last one first.

    Raises:
        InputError: a video cannot be read.
    """
    kept = None
    if images.cache is not None and recording.complete:
        kept = cell_cache(images.cache, recording, images.depth, say).find(first, last)
    if kept is not None:
        yield from kept[::-1]
        return
    for stop in range(last, first, -BLOCK):
        block = list(read_pictures(recording, Preparation(grids), max(first, stop - BLOCK), stop))
        for pictures in reversed(block):
            yield frame_input([picture.cells for picture in pictures])
