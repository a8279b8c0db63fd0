"""One run of the tracker over a recording: frames in, motions and files out, as far as they were not kept."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from sogjax.energy.term import Term
from sogjax.errors import counted
from sogjax.io.recording import Recording
from sogjax.io.threads import Writer
from sogjax.model.body import Body
from sogjax.run.backwards import frames_backwards, tracked_backwards
from sogjax.run.cells import picture_reader
from sogjax.run.clock import BACKGROUND, BEFORE, BOTH_WAYS, FIRST_FRAME, PREPARING, TRACKING, WRITING, StageTimes, stage
from sogjax.run.job import Job
from sogjax.run.kept_run import KeptRun
from sogjax.run.keypoint_offsets import told_offsets
from sogjax.run.memory import return_freed_memory
from sogjax.run.pipeline import Follow, FrameDone, FrameTracker, PictureReader, tracked_frames
from sogjax.run.prefix import Prefix
from sogjax.run.resume import frames_of, resumed
from sogjax.run.revision import Reviser
from sogjax.run.run import Run
from sogjax.run.second_background import learnt_again
from sogjax.run.streams import Streams, readable_frames
from sogjax.run.terminal import say
from sogjax.run.verdict import say_if_other_subject
from sogjax.settings.method import ImagesConfig
from sogjax.settings.run import OutputsConfig, TrackConfig
from sogjax.tracking.frame_by_frame import track

FRAMES_BEHIND = 8
"""Tracked frames waiting to be written, at most."""

Revise = Callable[[Prefix], Prefix | None]
"""What holds of the frames of a clip once all are known; None: what was found."""


@contextmanager
def tracking(
    recording: Recording,
    bodies: list[Body],
    config: TrackConfig,
    outputs: OutputsConfig,
    out: Path,
    kept: KeptRun | None = None,
    terms: Sequence[Term] = (),
    stays: bool = False,
) -> Iterator[Run]:
    """Track, resuming what was kept, as `run_job`; with `terms` besides those of the settings."""
    with stage(PREPARING):
        job = Job.from_config(recording, bodies, config, kept, terms)
    read = picture_reader(config.images)
    with stage(BACKGROUND):
        job = replace(job, tracker=learnt_again(job, config.images, read, kept=kept))
    with stage(PREPARING):
        job = replace(job, tracker=told_offsets(job, read))
    revise = Reviser(job, config.images) if config.tracking.both_ways else None
    with run_job(job, outputs, out, read, kept=kept, images=config.images, revise=revise, stays=stays) as result:
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
    revise: Revise | None = None,
    stays: bool = False,
) -> Iterator[Run]:
    """Run a job, with a reader of pictures and a tracker of their cells; one whose frames were settled is only written.

    The motions are in files that are removed when the block ends without an error.

    Args:
        job: to run.
        outputs: files to write.
        out: their folder.
        read: reads pictures.
        follow: tracks.
        kept: where results are kept, so that another process can resume.
        images: says how pictures are read backwards.
        revise: is asked once all frames are tracked, if they are kept; what it changes is written again.
        stays: whether the motions and what was kept stay when the block ends, since more is to be made of them.
    """
    total = job.frames[1] - job.frames[0]
    settled = None if kept is None else kept.settled(total)
    if settled is not None:
        say(f"{out}: all of {counted(total, 'frame')} are tracked; going on after them")
        with known_job(job, settled, outputs, out, read, kept, stays) as result:
            yield result
        return
    streams, goes_on = _begun(job, outputs, out, follow, kept, images)
    first = job.frames[0]
    missing = Counter(job.recording.num_missing(range(first, first + streams.num_skipped)))
    return_freed_memory()
    try:
        used = _streamed(job, streams, read, goes_on, missing)
        image_blobs = float(np.mean(used)) if used else float("nan")
        revised = _revised(kept, total, revise, stays)
        if revised is None:
            yield Run(
                job.recording,
                job.bodies,
                streams.motions(mapped=True),
                streams.times,
                image_blobs,
                files=streams.files,
                missing=missing,
            )
            streams.end(stays)
            return
    except BaseException:
        streams.say_what_is_left()
        raise
    with known_job(job, revised, outputs, out, read, kept, stays) as result:
        yield replace(result, times=streams.times, image_blobs=image_blobs, missing=missing)


@contextmanager
def known_job(
    job: Job,
    frames: Prefix,
    outputs: OutputsConfig,
    out: Path,
    read: PictureReader,
    kept: KeptRun | None = None,
    stays: bool = False,
) -> Iterator[Run]:
    """The run of a job whose poses are known; pictures are read only where a file shows them. Else as `run_job`."""
    recording, (first, last) = job.recording, job.frames
    streams = Streams(out, recording, job.bodies, recording.first_frame + first, outputs, StageTimes(), kept)
    try:
        if outputs.overlay or outputs.rerun:
            follow = resumed(frames, shown=True, with_images=outputs.rerun)
            _streamed(job, streams, read, partial(follow, job.tracker, frames.pose(0)), stages=(WRITING, WRITING))
        else:
            with stage(WRITING), streams:
                streams.consume(FrameDone(tracked, []) for tracked in frames_of(frames, job.tracker))
        missing = recording.num_missing(range(first, last))
        motions, used = streams.motions(mapped=True), float(np.mean(frames.rows["num_matching"]))
        yield Run(recording, job.bodies, motions, streams.times, used, files=streams.files, missing=missing)
        streams.end(stays)
    except BaseException:
        streams.say_what_is_left()
        raise


def _revised(kept: KeptRun | None, total: int, revise: Revise | None, stays: bool) -> Prefix | None:
    """What holds of all frames where it is not what was tracked; settled, so that it is not asked for again."""
    tracked = None if kept is None or not (revise or stays) else kept.prefix(total, total)
    if kept is None or tracked is None:
        return None
    with stage(BOTH_WAYS):
        revised = None if revise is None else revise(tracked)
        kept.settle(tracked if revised is None else revised)
    return revised


def _begun(
    job: Job, outputs: OutputsConfig, out: Path, follow: FrameTracker, kept: KeptRun | None, images: ImagesConfig | None
) -> tuple[Streams, Follow]:
    """The files of a run, and what tracks the frames that are left, those before its first pose tracked already."""
    (first, last), times = job.frames, StageTimes()
    prefix = None if kept is None else kept.prefix(readable_frames(out, job.bodies), last - first, job.num_before)
    num_kept = 0 if prefix is None else prefix.num_frames
    streams = Streams(out, job.recording, job.bodies, job.recording.first_frame + first, outputs, times, kept, num_kept)
    if prefix is not None:
        say(f"{out}: {num_kept} of {counted(last - first, 'frame')} are done; resuming after them")
    elif job.num_before:
        frames = frames_backwards(job.recording, job.grids, images or ImagesConfig(), first, job.begin + 1)
        frames = job.with_keypoints(frames, range(job.begin, first - 1, -1))
        with stage(BEFORE):
            prefix = tracked_backwards(job.tracker, job.start, frames, job.num_before + 1, times)
    start = job.start if prefix is None or not job.num_before else prefix.pose(0)
    if prefix is not None:
        follow = resumed(prefix, shown=not streams.num_skipped, with_images=outputs.rerun)
    return streams, partial(follow, job.tracker, start)


def _streamed(
    job: Job,
    streams: Streams,
    read: PictureReader,
    follow: Follow,
    missing: Counter[str] | None = None,
    stages: tuple[str, str] = (FIRST_FRAME, TRACKING),
) -> list[float]:
    """Track the frames that are left, and write them as they come; image blobs used in each.

    The clock counts the first frame and the others as two `stages`.
    """
    first, last = job.frames
    used: list[float] = []
    with stage(stages[0]) as turn, streams:
        count = last - first - streams.num_skipped
        pictures = read(job.recording, streams.preparation(job.grids), last - count, last) if count else iter(())
        known = lambda cells: follow(job.with_keypoints(cells, range(last - count, last)))
        frames = tracked_frames(pictures, count, streams.times, known)
        with closing(frames), Writer(streams.consume, FRAMES_BEHIND) as behind:
            for done in frames:
                used.append(float(np.mean(done.tracked.result.num_matching)))
                if missing is not None:
                    missing.update(
                        name
                        for name, picture in zip(job.recording.rig.names, done.pictures, strict=True)
                        if picture.cells is None
                    )
                behind.put(done)
                if len(used) == 1:
                    turn(stages[1])
                    return_freed_memory()
                    limbs = done.tracked.result.limbs
                    if stages[0] == FIRST_FRAME and limbs is not None and limbs.explained is not None:
                        say_if_other_subject(job.bodies, np.asarray(limbs.explained))
            turn(WRITING)
    return_freed_memory()
    return used
