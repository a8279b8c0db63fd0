"""`sogjax track`: from the videos of a recording to the motion of its actors."""

from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from omegaconf import OmegaConf

from sogjax.app import build
from sogjax.app.cells import picture_reader
from sogjax.app.configs import OutputsConfig, TrackConfig
from sogjax.app.first_pose import first_poses, initial_pose_file
from sogjax.app.kept_run import KeptRun
from sogjax.app.made_from import made_from
from sogjax.app.outputs import evaluate, export_endings, write_results
from sogjax.app.pipeline import FrameTracker, PictureReader, tracked_frames
from sogjax.app.recordings import actors_of, file_list, opened, say, upright
from sogjax.app.resumed import resumed
from sogjax.app.run_folder import RunFolder, run_folder
from sogjax.app.streams import Streams, readable_frames
from sogjax.app.timing import StageTimes
from sogjax.data.motion import Motion, arrays_of, load_motion
from sogjax.data.motion_log import PER_FRAME, SOMETIMES_PER_FRAME
from sogjax.data.recording import Recording
from sogjax.data.stages import Behind
from sogjax.errors import InputError
from sogjax.evaluate import GroupEvaluation
from sogjax.images.cells import CellGrid, stack_shape
from sogjax.model.body import Body, concatenate
from sogjax.track.tracker import Tracker, compile_counts, track

FRAMES_BEHIND = 8
"""Tracked frames that wait to be written."""
_ROWS = (*PER_FRAME, *SOMETIMES_PER_FRAME)


@dataclass
class Run:
    """A recording that was tracked, and what came of it."""

    recording: Recording
    bodies: list[Body]
    """The actors, upright in the recording's world; none where the run had ended before."""
    motions: dict[str, Motion]
    times: StageTimes
    image_blobs: float
    """Used in a frame by a camera, on average."""
    evaluation: GroupEvaluation | None = None
    missing: dict[str, int] = field(default_factory=dict)
    """Frames in which a camera had no picture, by camera; those that were tracked now."""
    files: list[Path] = field(default_factory=list)

    @property
    def iterations(self) -> Int[np.ndarray, "frame"]:
        """Of the solver, for all actors together."""
        return next(iter(self.motions.values())).iterations

    @property
    def converged(self) -> Bool[np.ndarray, "frame"]:
        """Whether the solver did, for all actors together."""
        return next(iter(self.motions.values())).converged


def run(config: TrackConfig, command: str = "track") -> Run:
    """Track, evaluate where there is ground truth, and write the results, or go on with a run that was stopped.

    Raises:
        InputError: anything wrong with the recording, the actors or the config; or a folder that another run uses, or
            with results that are to stay.
    """
    build.check(config)
    export_endings(config.outputs)
    recording = opened(config.recording, config.cameras)
    frame_range(recording, config)
    initial_pose_file(recording, config)
    path = Path(config.out or f"outputs/{recording.name}")
    with run_folder(path, config.overwrite, config.resume, command) as folder:
        result = _run_in(folder, recording, config, command)
    say_results(result)
    return result


def _run_in(folder: RunFolder, recording: Recording, config: TrackConfig, command: str) -> Run:
    """Track into a folder that is this run's own, or go on there."""
    actors = partial(actors_of, recording, config.actor, config.body, config.color)
    made = config.actor is None
    bodies = None if made else actors()[0]
    origin = made_from(recording, config, bodies)
    going_on, kept = folder.goes_on(origin), folder.kept
    if folder.ended:
        return _ended(folder, recording)
    if bodies is None and going_on:
        bodies = kept.actors()
    anew = bodies is None
    bodies = actors()[0] if bodies is None else bodies
    if not going_on:
        folder.begin(command, origin, [] if made else file_list(config.actor))
    if anew:
        kept.keep_actors(bodies)
    with tracking(recording, bodies, config, config.outputs, folder.path, kept=kept) as result:
        write_results(result, folder.path, config.outputs, OmegaConf.structured(config), bodies if made else [])
        folder.finish(command, origin, result.files)
    return result


def _ended(folder: RunFolder, recording: Recording) -> Run:
    """A run that ended before."""
    say(f"{folder.path}: the run has ended already; nothing is left to do")
    files = [folder.path / name for name in folder.note["files"]]
    motions = [path for path in files if path.suffix == ".npz"]
    name = lambda path: "actor" if len(motions) == 1 else path.stem.removeprefix("motion_")
    loaded = {name(path): load_motion(path) for path in motions}
    result = Run(recording, [], loaded, StageTimes(), float("nan"), files=files)
    evaluate(result)
    return result


def track_recording(recording: Recording, bodies: list[Body], config: TrackConfig) -> Run:
    """The motion of actors (in their own upright frames) in a recording; no files are written."""
    nothing = OutputsConfig(overlay=False, rerun=False, bvh=False)
    with TemporaryDirectory() as folder, tracking(recording, bodies, config, nothing, Path(folder)) as result:
        motions = {
            name: replace(motion, **{key: np.array(rows) for key, rows in arrays_of(motion).items() if key in _ROWS})
            for name, motion in result.motions.items()
        }
        return replace(result, motions=motions)


@dataclass(frozen=True)
class Job:
    """All that must be known before a recording is tracked."""

    recording: Recording
    bodies: list[Body]
    """The actors, upright in the recording's world."""
    frames: tuple[int, int]
    """First and one after the last, counted from the recording's first."""
    grids: tuple[CellGrid, ...]
    tracker: Tracker
    start: Float[Array, "dof"]
    """The rough pose of the first frame."""

    @classmethod
    def from_config(
        cls, recording: Recording, bodies: list[Body], config: TrackConfig, kept: KeptRun | None = None
    ) -> "Job":
        """To track actors (in their own upright frames) in a recording, from the first pose that was kept, if any."""
        bodies = [upright(body, recording) for body in bodies]
        frames = frame_range(recording, config)
        grids = build.cell_grids(recording, config.images.depth)
        with ThreadPoolExecutor(1) as beside:  # both compile for seconds
            building = beside.submit(_tracker, recording, bodies, grids, config)
            start = None if kept is None else kept.start()
            if start is None:
                start = jnp.concatenate(first_poses(recording, bodies, config, frames[0]))
                if kept is not None:
                    kept.keep_start(start)
            tracker = building.result()
        return cls(recording, bodies, frames, grids, tracker, start)


@contextmanager
def tracking(
    recording: Recording,
    bodies: list[Body],
    config: TrackConfig,
    outputs: OutputsConfig,
    out: Path,
    kept: KeptRun | None = None,
) -> Iterator[Run]:
    """Track, going on with what was kept; within the block the motions are in files that go when it ends well."""
    job = Job.from_config(recording, bodies, config, kept)
    with doing(job, outputs, out, picture_reader(config.images), kept=kept) as result:
        yield result


@contextmanager
def doing(
    job: Job,
    outputs: OutputsConfig,
    out: Path,
    read: PictureReader,
    follow: FrameTracker = track,
    kept: KeptRun | None = None,
) -> Iterator[Run]:
    """The same, with what reads the pictures and what tracks their cells."""
    first, last = job.frames
    times = StageTimes()
    prefix = None if kept is None else kept.prefix(readable_frames(out, job.bodies), last - first)
    num_kept = 0 if prefix is None else prefix.num_frames
    streams = Streams(out, job.recording, job.bodies, job.recording.first_frame + first, outputs, times, kept, num_kept)
    if prefix is not None:
        say(f"{out}: {num_kept} of {last - first} frames are there; the run goes on behind them")
        follow = resumed(prefix, shown=not streams.num_skipped, with_images=outputs.rerun)
    used: list[float] = []
    missing: Counter[str] = Counter()
    try:
        with streams:
            count = last - first - streams.num_skipped
            pictures = read(job.recording, streams.preparation(job.grids), last - count, last) if count else iter(())
            frames = tracked_frames(pictures, count, job.tracker, job.start, times, follow)
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


def _tracker(recording: Recording, bodies: list[Body], grids: tuple[CellGrid, ...], config: TrackConfig) -> Tracker:
    tracker = build.tracker(recording, concatenate(bodies), grids, config)
    compile_counts(tracker, (len(grids), *stack_shape(grids), 3))
    return tracker


def frame_range(recording: Recording, config: TrackConfig) -> tuple[int, int]:
    """First frame to track and the one after the last, counted from the recording's first.

    Raises:
        InputError: nothing lies between them.
    """
    last = recording.num_frames if config.stop is None else config.stop
    if not 0 <= config.start < last <= recording.num_frames:
        raise InputError(
            f"start={config.start} stop={'null' if config.stop is None else config.stop}: {recording.path} has the "
            f"frames 0 to {recording.num_frames - 1}; choose 0 <= start < stop <= {recording.num_frames}"
        )
    return config.start, last


STAGES = {
    "decode": "waiting for decoded pictures",
    "cells": "averaging pictures to cells",
    "step": "tracking step",
    "outputs": "writing results",
    "whole": "decoding to pose, together",
}


def say_results(result: Run) -> None:
    """The tables on standard output, then the files."""
    if result.evaluation is not None:
        print(result.evaluation.table(details=False), end="\n\n")
    for stage, text in STAGES.items():
        rate = result.times.frames_per_second(stage)
        if not np.isnan(rate):  # kept cells take no time
            print(f"{text:<32}{rate:10.1f} frames/s")
    if not np.isnan(first := result.times.first("whole")):
        print(f"first frame, with compilation   {first:10.1f} s")
    print(f"iterations                      {np.mean(result.iterations):10.1f} a frame", end="\n\n")
    for path in result.files:
        print(path)
    for camera, count in result.missing.items():
        say(f"warning: {camera} had no picture in {count} of {len(result.converged)} frames; the others were used")
    not_converged = int(np.sum(~result.converged))
    if not_converged:
        say(
            f"warning: {not_converged} of {len(result.converged)} frames did not converge within "
            "solver.max_iterations; look at them in the overlay"
        )
