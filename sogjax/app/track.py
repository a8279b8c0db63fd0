"""`sogjax track`: from the videos of a recording to the motion of its actors."""

import time
from dataclasses import dataclass, field
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from omegaconf import OmegaConf

from sogjax.app import build
from sogjax.app.cells import cell_frames
from sogjax.app.configs import TrackConfig
from sogjax.app.first_pose import first_poses, initial_pose_file
from sogjax.app.outputs import results_folder, write_results
from sogjax.app.progress import progress
from sogjax.app.recordings import actors_of, opened, say, upright
from sogjax.app.timing import StageTimes
from sogjax.data.motion import Motion, motion_from_poses
from sogjax.data.recording import Recording
from sogjax.errors import InputError
from sogjax.evaluate import GroupEvaluation
from sogjax.model.body import Body, concatenate, dof_slices
from sogjax.track.tracker import TrackedFrame, track


@dataclass
class Run:
    """A recording that was tracked, and what came of it."""

    recording: Recording
    bodies: list[Body]
    """The actors, upright in the recording's world."""
    motions: dict[str, Motion]
    frames: list[TrackedFrame]
    times: StageTimes
    evaluation: GroupEvaluation | None = None
    files: list[Path] = field(default_factory=list)


def run(config: TrackConfig) -> Run:
    """Track, evaluate where there is ground truth, and write the results.

    Raises:
        InputError: anything wrong with the recording, the actors or the config.
    """
    build.check(config)
    recording = opened(config.recording, config.cameras)
    frame_range(recording, config)
    initial_pose_file(recording, config)
    with results_folder(Path(config.out or f"outputs/{recording.name}")) as out:
        bodies, made = actors_of(recording, config.actor, config.body, config.color)
        result = track_recording(recording, bodies, config)
        write_results(result, out, config.outputs, OmegaConf.structured(config), bodies if made else [])
    say_results(result)
    return result


def track_recording(recording: Recording, bodies: list[Body], config: TrackConfig) -> Run:
    """The motion of actors (in their own upright frames) in a recording."""
    bodies = [upright(body, recording) for body in bodies]
    first, last = frame_range(recording, config)
    start = jnp.concatenate(first_poses(recording, bodies, config, first))
    grids = build.cell_grids(recording, config.images.depth)
    tracker = build.tracker(recording, concatenate(bodies), grids, config)
    times = StageTimes()

    cells = cell_frames(recording, grids, config.images, (first, last), times)
    frames = []
    begin = time.perf_counter()
    for frame in track(tracker, start, progress(cells, last - first, "tracking")):
        frames.append(frame)
        times.add("whole", time.perf_counter() - begin)
        times.add("step", frame.seconds)
        begin = time.perf_counter()
    motions = _motions(recording, bodies, frames, recording.first_frame + first)
    return Run(recording, bodies, motions, frames, times)


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


def _motions(
    recording: Recording, bodies: list[Body], frames: list[TrackedFrame], first_frame: int
) -> dict[str, Motion]:
    """One motion an actor; similarity, energy and iterations are those of all actors together."""
    poses = np.stack([np.asarray(frame.result.pose) for frame in frames])
    of_frames = lambda choose, dtype: np.array([choose(frame.result) for frame in frames], dtype)
    return {
        body.name: motion_from_poses(
            body,
            jnp.asarray(poses[:, part]),
            recording.fps,
            frame=first_frame + np.arange(len(frames)),
            similarity=of_frames(lambda r: r.terms.similarity, float),
            energy=of_frames(lambda r: r.terms.energy, float),
            iterations=of_frames(lambda r: r.iterations, int),
            converged=of_frames(lambda r: r.converged, bool),
        )
        for body, part in zip(bodies, dof_slices(bodies), strict=True)
    }


STAGES = {
    "decode": "waiting for decoded pictures",
    "cells": "averaging pictures to cells",
    "step": "tracking step",
    "whole": "decoding to pose, together",
}


def say_results(result: Run) -> None:
    """The tables on standard output, then the files."""
    if result.evaluation is not None:
        print(result.evaluation.table(details=False), end="\n\n")
    for stage, text in STAGES.items():
        if stage not in result.times.seconds:  # pictures that were kept are not decoded
            continue
        print(f"{text:<32}{result.times.frames_per_second(stage):10.1f} frames/s")
    iterations = np.mean([int(frame.result.iterations) for frame in result.frames])
    print(f"first frame, with compilation   {result.times.first('whole'):10.1f} s")
    print(f"iterations                      {iterations:10.1f} a frame", end="\n\n")
    for path in result.files:
        print(path)
    not_converged = sum(not bool(frame.result.converged) for frame in result.frames)
    if not_converged:
        say(
            f"warning: {not_converged} of {len(result.frames)} frames did not converge within "
            "solver.max_iterations; look at them in the overlay"
        )
