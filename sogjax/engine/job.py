"""One run of the tracker over a recording: what it needs, and how its result is made."""

from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.data.recording import Recording
from sogjax.data.stages import Behind
from sogjax.energy import Term
from sogjax.engine import build
from sogjax.engine.backwards import frames_backwards, tracked_backwards
from sogjax.engine.cells import picture_reader
from sogjax.engine.first_pose import first_poses, rough_descriptions
from sogjax.engine.kept_run import KeptRun
from sogjax.engine.pipeline import FrameTracker, PictureReader, tracked_frames
from sogjax.engine.recordings import upright
from sogjax.engine.resume import resumed
from sogjax.engine.run import Run
from sogjax.engine.second_background import learnt_again
from sogjax.engine.streams import Streams, readable_frames
from sogjax.engine.terminal import say
from sogjax.engine.timing import StageTimes
from sogjax.errors import InputError
from sogjax.images.cells import CellGrid, stack_shape
from sogjax.model.body import Body, concatenate
from sogjax.sentences import counted
from sogjax.settings import ImagesConfig, OutputsConfig, TrackConfig
from sogjax.tracking.tracker import Tracker, compile_counts, track

FRAMES_BEHIND = 8
"""Tracked frames waiting to be written, at most."""


@dataclass(frozen=True)
class Job:
    """Everything needed before tracking begins."""

    recording: Recording
    bodies: list[Body]
    """The actors, upright in the recording's world."""
    frames: tuple[int, int]
    """First and one after the last, counted from the recording's first."""
    grids: tuple[CellGrid, ...]
    tracker: Tracker
    start: Float[Array, "dof"]
    """The rough pose of the frame where tracking begins."""
    begin: int = 0
    """That frame, counted from the recording's first; those before it are tracked backwards."""

    @property
    def num_before(self) -> int:
        """Frames that are tracked backwards."""
        return max(self.begin - self.frames[0], 0)

    @classmethod
    def from_config(
        cls,
        recording: Recording,
        bodies: list[Body],
        config: TrackConfig,
        kept: KeptRun | None = None,
        terms: Sequence[Term] = (),
        start: Float[Array, "dof"] | None = None,
    ) -> "Job":
        """The job of tracking actors (in their own upright frames), from the first pose that was kept, if any.

        `terms` are added to those of the settings; a first pose that is given as `start` is neither read nor searched.
        """
        bodies = [upright(body, recording) for body in bodies]
        frames = frame_range(recording, config)
        grids = build.cell_grids(recording, config.images.depth)
        if start is None:
            rough_descriptions(recording, bodies, config)  # what is wrong there is said before anything is learnt
        with ThreadPoolExecutor(1) as beside:  # both compile for seconds
            building = beside.submit(_tracker, recording, bodies, grids, config, terms)
            begin = frames[0]
            if start is None and kept is not None and (opening := kept.start()) is not None:
                start, begin = opening
            if start is None:
                start = jnp.concatenate(first_poses(recording, bodies, config, begin, terms))
                if kept is not None:
                    kept.keep_start(start, begin)
            tracker = building.result()
        return cls(recording, bodies, frames, grids, tracker, start, begin)


@contextmanager
def tracking(
    recording: Recording,
    bodies: list[Body],
    config: TrackConfig,
    outputs: OutputsConfig,
    out: Path,
    kept: KeptRun | None = None,
    terms: Sequence[Term] = (),
) -> Iterator[Run]:
    """Track, resuming what was kept; the motions are in files that are removed when the block ends without an error."""
    job = Job.from_config(recording, bodies, config, kept, terms)
    read = picture_reader(config.images)
    job = replace(job, tracker=learnt_again(job, config.images, read))
    with run_job(job, outputs, out, read, kept=kept, images=config.images) as result:
        yield result


@contextmanager
def run_job(
    job: Job,
    outputs: OutputsConfig,
    out: Path,
    read: PictureReader,
    follow: FrameTracker = track,
    kept: KeptRun | None = None,
    images: ImagesConfig | None = None,
) -> Iterator[Run]:
    """Run a job, with a reader of pictures and a tracker of their cells; `images` says how they are read backwards."""
    first, last = job.frames
    times = StageTimes()
    prefix = None if kept is None else kept.prefix(readable_frames(out, job.bodies), last - first, job.num_before)
    num_kept = 0 if prefix is None else prefix.num_frames
    streams = Streams(out, job.recording, job.bodies, job.recording.first_frame + first, outputs, times, kept, num_kept)
    if prefix is not None:
        say(f"{out}: {num_kept} of {counted(last - first, 'frame')} are done; resuming after them")
    elif job.num_before:
        frames = frames_backwards(job.recording, job.grids, images or ImagesConfig(), first, job.begin + 1)
        prefix = tracked_backwards(job.tracker, job.start, frames, job.num_before + 1, times)
    start = job.start if prefix is None or not job.num_before else prefix.pose(0)
    if prefix is not None:
        follow = resumed(prefix, shown=not streams.num_skipped, with_images=outputs.rerun)
    used: list[float] = []
    missing = Counter(job.recording.num_missing(range(first, first + streams.num_skipped)))
    try:
        with streams:
            count = last - first - streams.num_skipped
            pictures = read(job.recording, streams.preparation(job.grids), last - count, last) if count else iter(())
            frames = tracked_frames(pictures, count, job.tracker, start, times, follow)
            with closing(frames), Behind(streams.consume, FRAMES_BEHIND) as behind:
                for done in frames:
                    used.append(float(np.mean(done.tracked.result.num_matching)))
                    missing.update(
                        name
                        for name, picture in zip(job.recording.rig.names, done.pictures, strict=True)
                        if picture.cells is None
                    )
                    behind.put(done)
        motions = streams.motions(mapped=True)
        image_blobs = float(np.mean(used)) if used else float("nan")
        yield Run(job.recording, job.bodies, motions, times, image_blobs, files=streams.files, missing=missing)
        streams.remove_partial()
    except BaseException:
        streams.say_what_is_left()
        raise


def _tracker(
    recording: Recording, bodies: list[Body], grids: tuple[CellGrid, ...], config: TrackConfig, terms: Sequence[Term]
) -> Tracker:
    tracker = build.tracker(recording, concatenate(bodies), grids, config, terms)
    compile_counts(tracker, (len(grids), *stack_shape(grids), 3))
    return tracker


def frame_range(recording: Recording, config: TrackConfig) -> tuple[int, int]:
    """First frame to track and the one after the last, counted from the recording's first.

    Raises:
        InputError: there is no frame between them.
    """
    last = recording.num_frames if config.stop is None else config.stop
    if not 0 <= config.start < last <= recording.num_frames:
        raise InputError(
            f"start={config.start} stop={'null' if config.stop is None else config.stop}: {recording.path} has the "
            f"frames 0 to {recording.num_frames - 1}; choose 0 <= start < stop <= {recording.num_frames}"
        )
    return config.start, last
