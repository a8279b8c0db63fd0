"""The pass that tracks: from the initial pose back to the clip's first frame, then forward to its last one."""

import json
import time
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from sogjax.io.files import write_file
from sogjax.io.frame_motions import FRAMES
from sogjax.io.frame_table import FrameLog, FramesRecord, FrameTable, read_frames_log
from sogjax.io.motion import FRAMES_AT_ONCE
from sogjax.io.threads import Writer
from sogjax.model.body import Body
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.verdict import expected_of
from sogjax.run.clip import ReadFrame
from sogjax.run.clock import BEFORE, FIRST_FRAME, TRACKING, WRITING, StageTimes, stage
from sogjax.run.frames import continued, rows_of
from sogjax.run.initial_pose import InitialPose
from sogjax.run.memory import return_freed_memory
from sogjax.run.result_streams import ResultStreams
from sogjax.run.setup import Setup
from sogjax.run.terminal import progress, say
from sogjax.tracking.frame import FrameInput, TrackedFrame
from sogjax.tracking.frame_by_frame import Told, track

FRAMES_BEHIND = 8
"""Tracked frames that wait to be written, at most."""


MARK = "tracked.json"


class Tracked(FramesRecord):
    """The frames of a clip as they were tracked; they lie in the log."""

    def save(self, folder: Path) -> None:
        """Mark the log in a run's folder as whole."""
        write_file(folder / MARK, json.dumps({"frames": len(self.table)}))

    @classmethod
    def load(cls, folder: Path) -> "Tracked | None":
        """What was kept, if all frames were tracked."""
        table = read_frames_log(folder / FRAMES)
        return cls(table) if table is not None and (folder / MARK).is_file() else None


class FrameDone(NamedTuple):
    """A tracked frame, and what was made of its pictures."""

    tracked: TrackedFrame
    pictures: list[Any]


@dataclass
class FramesFound:
    """Takes frames as they come, a block at a time: to the table, its log on disk, and the files that show them."""

    numbers: range
    kept: FrameTable | None
    """Rows that the log holds already."""
    log: FrameLog | None
    streams: ResultStreams | None
    times: StageTimes
    row: int
    """The row of the frame that comes next."""

    def __post_init__(self) -> None:
        self._blocks: list[FrameTable] = [] if self.kept is None else [self.kept]

    @property
    def table(self) -> FrameTable:
        """All rows."""
        return FrameTable.joined(self._blocks)

    @property
    def count(self) -> int:
        """How many frames are known."""
        return max(self.row, sum(len(block) for block in self._blocks))

    def consume(self, frames: Iterator[FrameDone]) -> None:
        """Take the frames as they come."""
        while block := list(islice(frames, FRAMES_AT_ONCE)):
            begin = time.perf_counter()
            self._take(block)
            for _ in block:
                self.times.add("outputs", (time.perf_counter() - begin) / len(block))

    def _take(self, block: Sequence[FrameDone]) -> None:
        numbers = self.numbers[self.row : self.row + len(block)]
        rows = rows_of([done.tracked for done in block], numbers)
        if self.kept is None or self.row >= len(self.kept):
            if self.log is not None:
                self.log.append(rows)
            self._blocks.append(rows)
        self.row += len(block)
        if self.streams is not None:
            self.streams.write(rows, [done.tracked for done in block], [done.pictures for done in block])


def track_back(setup: Setup, start: InitialPose, times: StageTimes) -> FrameTable | None:
    """The frames before the one where tracking begins, and that one, tracked backwards; None: it begins with the first.

    Raises:
        InputError: a video cannot be read, or a picture has too many image blobs.
    """
    numbers = setup.clip.numbers
    back = numbers[numbers.index(start.frame) :: -1]
    if len(back) < 2:
        return None
    found = []
    with stage(BEFORE):
        frames = setup.clip.frames(back.start, back.stop, back.step)
        shown = progress(frames, len(back), "tracking backwards")
        for number, tracked in zip(back, track(setup.tracker, jnp.asarray(start.pose), shown), strict=True):
            times.add("step", tracked.seconds)
            found.append(rows_of([tracked], [number]))
    return FrameTable.joined(found[::-1])


def show_known(setup: Setup, table: FrameTable, streams: ResultStreams) -> None:
    """Write the files that show frames, from rows that are known; pictures are read where a file shows them.

    Raises:
        InputError: a video cannot be read, or a file cannot be written.
    """
    found = FramesFound(setup.clip.numbers, table, None, streams, StageTimes(), 0)  # those of tracking stay
    start = InitialPose(setup.clip.numbers[0], table.pose[0], "known")
    with streams, Writer(found.consume, FRAMES_BEHIND) as writer:
        for done in frames_done(setup, start, table, found, shown=True, label="writing pictures"):
            writer.put(done)


def track_forward(
    setup: Setup,
    start: InitialPose,
    times: StageTimes,
    log: FrameLog | None = None,
    kept: FrameTable | None = None,
    streams: ResultStreams | None = None,
    beforehand: Told = lambda *_: None,
    again: bool = False,
) -> FrameTable:
    """All frames of the clip, tracked from the initial pose.

    Args:
        setup: what is tracked with.
        start: where tracking begins.
        times: where the times of the frames are noted.
        log: where rows are kept as they come.
        kept: rows of an earlier process, in the log already; after them the run is resumed.
        streams: files that show the frames, written as they come.
        beforehand: what is done beside tracking from the first frame on, for later passes.
        again: whether the clip was tracked before, so that somebody else would have been noticed.

    Raises:
        InputError: a video ends early, a picture has too many image blobs, or a file cannot be written.
    """
    known = kept if kept is not None else track_back(setup, start, times)
    first_row = 0 if kept is None or (streams is not None and streams.show_frames) else len(kept)
    found = FramesFound(setup.clip.numbers, kept, log, streams, times, first_row)
    return_freed_memory()
    with (
        stage(FIRST_FRAME) as turn,
        log or nullcontext(),
        streams or nullcontext(),
        ThreadPoolExecutor(1) as beside,
        Writer(found.consume, FRAMES_BEHIND) as writer,
    ):
        shown, told = kept is None or first_row == 0, partial(beside.submit, beforehand)
        for done in frames_done(setup, start, known, found, shown, told):
            writer.put(done)
            if done.tracked.index == first_row:
                turn(TRACKING)
                return_freed_memory()
                limbs = done.tracked.result.limbs
                if limbs is not None and limbs.explained is not None and kept is None and not again:
                    say_if_other_subject(setup.bodies, np.asarray(limbs.explained))
        turn(WRITING)
    return_freed_memory()
    return found.table


def kept_rows(folder: Path, start: InitialPose, numbers: range) -> FrameTable | None:
    """The rows in a run's folder after which tracking goes on; None: it begins anew.

    They are a multiple of the frames written at once, so that the others are written in the same blocks as without a
    stop. Unless they are more than the frames that are tracked backwards, these are tracked again.
    """
    found = read_frames_log(folder / FRAMES)
    if found is None:
        return None
    count = len(found) if len(found) == len(numbers) else len(found) - len(found) % FRAMES_AT_ONCE
    return found[:count] if count > numbers.index(start.frame) else None


def say_if_other_subject(bodies: Sequence[Body], explained: Float[np.ndarray, "actor"]) -> None:
    """Warn at the first frame, so that nobody waits for a whole clip of somebody else."""
    expected = expected_of(bodies)
    for body, share in zip(bodies, explained.tolist(), strict=True):
        if share < fitted_numbers().verdict.other_subject * expected.get(body.name, 0.0):
            say(
                f"WARNING: this seems not to be {body.name}: {share:.1%} explained in the first frame, against "
                f"{expected[body.name]:.1%} in the example poses; Ctrl-C stops, and what is wrong is told at the end"
            )


def frames_done(
    setup: Setup,
    start: InitialPose,
    known: FrameTable | None,
    found: FramesFound,
    shown: bool,
    told: Told = lambda *_: None,
    label: str = "tracking",
) -> Iterator[FrameDone]:
    """The frames from the first one that is shown on, with what is made of their pictures; `times` are noted.

    The bar has the `label`.
    """
    numbers, streams, times = setup.clip.numbers[found.row :], found.streams, found.times
    make = None if streams is None else streams.picture_maker()
    waiting: deque[list[Any]] = deque()

    def inputs(frames: Iterator[ReadFrame]) -> Iterator[FrameInput]:
        for frame in progress(frames, len(numbers), label):
            waiting.append(frame.pictures)
            yield frame.input

    coming = inputs(setup.clip.read(numbers, make, times)) if len(numbers) else iter(())
    with_images = streams is not None and streams.show_blobs
    tracked_frames = continued(setup.tracker, start.pose, known, coming, shown, with_images, told)
    for tracked in times.timed("whole", tracked_frames):
        if tracked.seconds > 0.0:  # not where a frame was tracked before
            times.add("step", tracked.seconds)
        yield FrameDone(tracked, waiting.popleft())
