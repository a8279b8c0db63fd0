"""One run of a study: from a source and a row of an experiment to a record."""

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.motion import Motion, motion_from_poses
from sogjax.model.body import Body, dof_slices
from sogjax.quality.evaluation import Evaluation, GroupEvaluation, evaluate_motions
from sogjax.quality.markers import PointErrors
from sogjax.quality.metrics import mean_per_frame
from sogjax.run import build
from sogjax.run.memory import forget_programs_if_many
from sogjax.run.result import RunResult
from sogjax.run.terminal import say
from sogjax.run.track import track_recording
from sogjax.settings.compose import track_config
from sogjax.settings.run import TrackConfig
from sogjax.study.experiment import Experiment
from sogjax.study.record import RunFolder, RunPlan, RunRecord
from sogjax.study.script import machine_facts
from sogjax.study.source import Source

STAGES = ("decode", "step", "whole")
ALL = "all"
"""Frames by the time of the whole run: initial pose, backward passes and adjusting included."""


def run_row(
    experiment: Experiment,
    row: str,
    source: Source,
    runs: RunFolder,
    common: Sequence[str] = (),
    do: bool = True,
    method: str = "",
) -> RunRecord | None:
    """The record of a row on a recording, with one of the experiment's methods.

    It is read where the run was done before; else, if `do`, the run is made now and its record kept.

    A run that fails is kept as failed, and done again the next time; the others go on. None, too, where the recording
    has not as many cameras as the row asks for.

    Raises:
        InputError: an override that cannot be.
    """
    entry = experiment.config.rows[row]
    judged = experiment.config.measure == "accuracy"  # limbs in doubt are tracked both ways
    config = track_config(
        experiment.overrides(row, common, method), recording=source.path, outputs={"confidence": judged}
    )
    build.check(config)
    if entry.cameras is not None and entry.cameras > len(source.recording.rig.names):
        return None
    cameras = source.cameras(entry.cameras)
    measure = experiment.config.measure
    plan = RunPlan.of(source.identity, source.num_frames, cameras, measure, config)
    found = runs.find(plan)
    if (found is not None and not found.failed) or not do:
        return found
    say(f"{experiment.name} {row!r}{method and f', {method}'}: {source.name}")
    forget_programs_if_many()
    record, begin = RunRecord(plan=asdict(plan), machine=machine_facts()), time.perf_counter()
    try:
        measured = _accuracy if measure == "accuracy" else _speed
        record = measured(record, source, config, cameras)
    except Exception as error:
        reason = str(error) if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
        record = replace(record, failed=reason.splitlines()[0])
        say(f"failed: {record.failed}")
    record = replace(record, seconds=time.perf_counter() - begin)
    runs.keep(plan, record)
    return record


def motions_of(record: RunRecord, bodies: Sequence[Body], fps: float) -> dict[str, Motion]:
    """The motions of a run's actors, from the poses and the solver's account in its record."""
    poses = np.asarray(record.pose, float)
    iterations = np.asarray(record.iterations, int)
    return {
        body.name: motion_from_poses(body, poses[:, part], fps, frame=record.frames, iterations=iterations)
        for body, part in zip(bodies, dof_slices(bodies), strict=True)
    }


def _accuracy(record: RunRecord, source: Source, config: TrackConfig, cameras: tuple[str, ...]) -> RunRecord:
    """Track from kept cells, from the initial pose that all runs share."""
    images = replace(config.images, cache=str(source.cell_folder))
    config = replace(config, images=images, stop=source.num_frames)
    own = lambda request: source.initial_pose
    run = track_recording(source.seen_by(cameras), source.actors, config, pose_sources=(own,))
    table = run.frames
    record = replace(
        record,
        frame=table.frame.tolist(),
        milliseconds=[round(1000.0 * seconds, 3) for seconds in run.times.seconds["step"]],
        image_blobs=float(np.mean(table.num_matching)),
        iterations=table.iterations.tolist(),
        evaluations=table.evaluations.tolist(),
        converged=table.converged.tolist(),
        pose=np.round(np.asarray(table.pose, float), 6).tolist(),
    )
    return _evaluated(record, source)


def _speed(record: RunRecord, source: Source, config: TrackConfig, cameras: tuple[str, ...]) -> RunRecord:
    """Track from the videos, all stages beside each other, as `sogjax track` does; twice, the faster one counts."""
    config = replace(config, stop=source.num_frames)
    runs = [_timed(source, cameras, config) for _ in range(2)]
    best, seconds = max(runs, key=lambda run: run[0].times.frames_per_second("whole"))
    motion = next(iter(best.motions.values()))
    record = replace(
        record,
        frame=motion.frame.tolist(),
        iterations=motion.iterations.tolist(),
        converged=motion.converged.tolist(),
        milliseconds=[1000.0 * seconds for seconds in best.times.seconds["step"]],
        image_blobs=best.image_blobs,
        rates={stage: best.times.frames_per_second(stage) for stage in STAGES} | {ALL: motion.num_frames / seconds},
        pose=np.concatenate([motion.pose for motion in best.motions.values()], axis=1).tolist(),
    )
    return _evaluated(record, source)


def _timed(source: Source, cameras: tuple[str, ...], config: TrackConfig) -> tuple[RunResult, float]:
    """A run, and its seconds on the clock."""
    begin = time.perf_counter()
    return track_recording(source.seen_by(cameras), source.actors, config).result_so_far, time.perf_counter() - begin


def _evaluated(record: RunRecord, source: Source) -> RunRecord:
    """The record with its distances to the truth."""
    motions = motions_of(record, source.bodies, source.recording.fps)
    evaluation = evaluate_motions(motions, source.truth)
    joints = _distances(evaluation, lambda part: part.joints, record.frame)
    markers = _distances(evaluation, lambda part: part.markers, record.frame)
    closest = _distances(evaluation, lambda part: part.markers_by_rule.get("closest"), record.frame)
    errors = markers if markers.shape[1] else joints
    return replace(
        record,
        error_mm=_rounded_means(errors),
        joint_error_mm=_rounded_means(joints),
        std_mm=_deviation(errors),
        closest_mm=_rounded_means(closest),
        closest_std_mm=_deviation(closest),
        angles=[asdict(error) for part in evaluation.evaluations.values() for error in part.angles],
        lost=sum(len(part.lost) for part in evaluation.evaluations.values()),
        swaps=len(evaluation.swaps),
    )


def _distances(
    evaluation: GroupEvaluation, points_of: Callable[[Evaluation], PointErrors | None], frames: Sequence[int]
) -> Float[np.ndarray, "frame point"]:
    """Distances of the points of all actors in every tracked frame, mm; NaN where there is no truth."""
    columns = [np.zeros((len(frames), 0))]
    for part in evaluation.evaluations.values():
        points = points_of(part)
        if points is not None:
            column = np.full((len(frames), points.errors.shape[1]), np.nan)
            column[np.searchsorted(frames, part.frames)] = 1000.0 * points.errors
            columns.append(column)
    return np.concatenate(columns, axis=1)


def _deviation(distances: Float[np.ndarray, "frame point"]) -> float:
    return float(np.nanstd(distances)) if np.isfinite(distances).any() else float("nan")


def _rounded_means(distances: Float[np.ndarray, "frame point"]) -> list[float]:
    return np.round(mean_per_frame(distances), 4).tolist()
