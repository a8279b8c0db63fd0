"""The way that a solver takes within a frame of a recording, and motions side by side in Rerun."""

import jax.numpy as jnp
import numpy as np

from sogjax.errors import InputError
from sogjax.io.motion import Motion, motion_from_poses
from sogjax.settings.compose import track_config
from sogjax.settings.run import TrackConfig
from sogjax.study.experiment import Experiment
from sogjax.study.runner import motions_of, run_row
from sogjax.study.source import Source
from sogjax.study.study import Study
from sogjax.tracking.frame import TrackState
from sogjax.tracking.frame_by_frame import best_after, track


def check_showable(source: Source, frame: int) -> None:
    """Refuse what has no iterations that could be shown.

    Raises:
        InputError: several people, or a frame that the recording has not, or its first, which is no step of tracking.
    """
    if len(source.bodies) > 1:
        raise InputError(
            f"{source.name}: has {len(source.bodies)} people, and the iterations of one can be shown; "
            "choose a recording of one person"
        )
    if not 0 < frame < source.recording.num_frames:
        raise InputError(
            f"frame={frame}: choose one of 1 to {source.recording.num_frames - 1}, frames of {source.name} "
            "after its first"
        )


def watched(source: Source, options: list[str], frame: int) -> tuple[Motion, np.ndarray]:
    """The poses after 0, 1, 2, ... iterations in a frame, as a motion, and their energies."""
    config: TrackConfig = track_config(options, recording=source.path)
    setup = source.setup(config, source.cameras(None))
    tracker, first = setup.tracker, source.recording.first_frame
    frames = [*setup.clip.frames(first, first + frame + 1)]
    state = TrackState.from_pose(jnp.asarray(source.initial_pose.pose))
    tracked = list(track(tracker, state, frames))
    for done in tracked[:-1]:
        state = state.advanced(jnp.asarray(done.result.pose))
    counts = jnp.arange(int(tracked[-1].result.iterations) + 1)
    poses, energies = best_after(tracker, state, jnp.asarray(frames[-1].cells), tracked[-1].capacities, counts)
    return motion_from_poses(source.bodies[0], np.asarray(poses), source.recording.fps), np.asarray(energies)


def of_experiment(
    study: Study, experiment: Experiment, source: Source
) -> tuple[dict[str, list[Motion]], dict[str, np.ndarray]]:
    """The motions on one recording of every row that tracks it and did not fail, and their errors in metres.

    Raises:
        InputError: there is none.
    """
    motions, errors, failed = {}, {}, "all its rows have recordings of their own"
    for row, entry in experiment.config.rows.items():
        if entry.synth is not None:  # tracked on a recording of its own
            continue
        record = run_row(experiment, row, source, study.runs, study.overrides)
        if record is None or record.failed:
            failed = record.failed if record else failed
            continue
        motions[row] = list(motions_of(record, source.bodies, source.recording.fps).values())
        errors[row] = 1e-3 * record.errors
    if not motions:
        raise InputError(
            f"experiment={experiment.name}: no row worked on {source.name} ({failed}); choose another recording or "
            "experiment"
        )
    return motions, errors
