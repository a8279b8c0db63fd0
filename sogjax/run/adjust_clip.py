"""Adjusting a tracked clip as a whole: its pictures read again, poses and shape climbed together, what came of it."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from sogjax.energy.keypoints import keypoint_term_among
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.motion import Motion, motion_from_poses
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.model.bones import bone_lengths
from sogjax.model.rotation import axis_vector, world_from_upright
from sogjax.quality.markers import joint_errors
from sogjax.refine.adjustment import Adjusted, adjusted
from sogjax.refine.clip_priors import floor_height, standing, undersides
from sogjax.refine.pictures import ClipPictures, Reader
from sogjax.run import build
from sogjax.run.adjust_cameras import camera_numbers, moved_rig, moves_of
from sogjax.run.adjust_checks import WINDOW, check_length
from sogjax.run.adjust_colors import color_rows, mean_similarity, measured_colors
from sogjax.run.adjust_judged import judged_with_colors
from sogjax.run.cells import picture_reader
from sogjax.run.clip_keypoints import clip_keypoints, keypoint_terms
from sogjax.run.job import Job
from sogjax.run.keypoint_offsets import FRAMES, knowing_offsets
from sogjax.run.pipeline import PictureReader, Preparation, frame_input
from sogjax.run.prefix import Prefix
from sogjax.run.recordings import upright
from sogjax.run.second_background import learnt_again
from sogjax.run.terminal import progress, say
from sogjax.scene.cells import stack_shape
from sogjax.settings.run import TrackConfig
from sogjax.tracking.frame import FrameInput

CLEARLY = 1.01
"""By which factor new colours must explain more to be taken: those of example poses were measured within masks."""


@dataclass(frozen=True)
class AdjustedClip:
    """An adjusted clip, ready to be written as a run is."""

    job: Job
    """Of the adjusted body."""
    prefix: Prefix
    """Its frames, as if they had been tracked."""
    actor: Body
    """Adjusted, in its own upright frame."""
    motion: Motion
    numbers: dict[str, Any]
    """Before and after, for JSON."""
    moves: Float[np.ndarray, "camera 7"]
    """Of the job's cameras, which stand there already."""


def adjusted_clip(
    recording: Recording,
    actor: Body,
    motion: Motion,
    config: TrackConfig,
    window: int = WINDOW,
    with_shape: bool = True,
    in_question: tuple[str, ...] = (),
) -> AdjustedClip:
    """Poses of all frames and the shape of the actor, adjusted together; then cameras, where they are in question.

    Args:
        recording: in which was tracked.
        actor: that was tracked, in its own upright frame.
        motion: as it was tracked.
        config: with which it was.
        window: frames that are adjusted together.
        with_shape: whether the shape is adjusted.
        in_question: parts of the cameras' moves (`parts_in_question`).

    Raises:
        InputError: the clip is too short, or a video cannot be read.
    """
    check_length(motion)
    read = picture_reader(config.images)
    job = _job(recording, actor, motion, config, read)
    source = _Source(job, read, motion)
    found = adjusted(
        job.tracker,
        source.pictures,
        motion.pose,
        motion.frame,
        motion.similarity,
        motion.fps,
        motion.up,
        window,
        with_shape=with_shape,
        report=lambda stage: say(f"adjusting: {stage}"),
        moves=moves_of(recording),
        in_question=in_question,
    )
    job = _found_job(job, found)
    after = _motion(found, job, motion)
    numbers, prefix = _numbers(job, motion, after, found, actor), _prefix(found, job, motion)
    if in_question:
        numbers["cameras"] = camera_numbers(recording, found)
    body, numbers["similarity_of_new_colors"] = _recolored(job, source, found, after, config)
    say("adjusting: what the cameras say of it")
    cells = source.coming(np.arange(after.num_frames))
    job, prefix, after = judged_with_colors(job, body, cells, prefix, after)
    numbers["new_colors"] = job.bodies[0] is not found.body
    turn = jnp.asarray(world_from_upright(recording.up).T, actor.blob_sigmas.dtype)
    return AdjustedClip(job, prefix, job.bodies[0].rotated(turn), after, numbers, found.moves)


def _job(recording: Recording, actor: Body, motion: Motion, config: TrackConfig, read: PictureReader) -> Job:
    """What tracking would have been with, from the poses that are known."""
    body = upright(actor, recording)
    grids = build.cell_grids(recording, config.images.depth)
    first = int(motion.frame[0]) - recording.first_frame
    frames = (first, int(motion.frame[-1]) - recording.first_frame + 1)
    keypoints = clip_keypoints(recording, config)
    tracker = build.tracker(recording, body, grids, config, keypoint_terms(keypoints, body, config))
    if keypoints is not None and keypoint_term_among(tracker.terms) is not None:
        rows = np.unique(np.linspace(0, motion.num_frames - 1, FRAMES).astype(int))
        told = motion.frame[rows] - recording.first_frame
        tracker = knowing_offsets(tracker, keypoints, told, motion.pose[rows])
    job = Job(recording, [body], frames, grids, tracker, jnp.asarray(motion.pose[0]), first, keypoints)
    poses = {
        int(frame) - recording.first_frame: jnp.asarray(pose)
        for frame, pose in zip(motion.frame, motion.pose, strict=True)
    }
    return replace(job, tracker=learnt_again(job, config.images, read, poses))


def _found_job(job: Job, found: Adjusted) -> Job:
    """With the body and the cameras that were found."""
    tracker = replace(job.tracker, body=found.body)
    if found.told:
        rig = moved_rig(job.recording.rig, found.moves)
        job = replace(job, recording=replace(job.recording, rig=rig))
        cameras = replace(tracker.cameras, camera_from_world=rig.cameras.camera_from_world)
        tracker = replace(tracker, cameras=cameras)
    return replace(job, bodies=[found.body], tracker=tracker)


@dataclass(frozen=True)
class _Source:
    """Reads the pictures of rows of a motion."""

    job: Job
    read: PictureReader
    motion: Motion

    def pictures(self, rows: Int[np.ndarray, "row"], poses: Float[np.ndarray, "row dof"]) -> ClipPictures:
        """Near given poses."""
        reader = Reader.from_tracker(self.job.tracker, stack_shape(self.job.grids))
        return reader.pictures(self.cells(rows), poses)

    def cells(self, rows: Int[np.ndarray, "row"]) -> list[FrameInput]:
        """Of the rows."""
        return list(self.coming(rows))

    def coming(self, rows: Int[np.ndarray, "row"]) -> Iterator[FrameInput]:
        """Of the rows, one after the other."""
        frames = (self.motion.frame[rows] - self.job.recording.first_frame).tolist()
        wanted, first, last = set(frames), min(frames), max(frames) + 1
        coming = self.read(self.job.recording, Preparation(self.job.grids), first, last)
        shown = progress(coming, last - first, "reading")
        cells = (frame_input([picture.cells for picture in pictures]) for pictures in shown)
        known = self.job.with_keypoints(cells, range(first, last))
        yield from (frame for number, frame in enumerate(known, first) if number in wanted)


def _recolored(job: Job, source: _Source, found: Adjusted, motion: Motion, config: TrackConfig) -> tuple[Body, float]:
    """The adjusted body with the colours that the clip shows, if it is more similar so; and by which factor it is."""
    say("adjusting: colours")
    rows = color_rows(found.body, found.poses, motion.similarity)
    poses, cells = found.poses[rows], source.cells(rows)
    frames = (motion.frame[rows] - job.recording.first_frame).tolist()
    space, _ = build.color_space_and_radius(config.color)
    body = measured_colors(job.recording, found.body, frames, poses, space)
    before, after = (mean_similarity(replace(job.tracker, body=each), cells, poses) for each in (found.body, body))
    return (body if after > CLEARLY * before else found.body), after / before


def _energies(found: Adjusted, job: Job) -> Float[np.ndarray, "frame"]:
    """Of Eq. 10 without a history."""
    parts = [float(term.signed_weight) * found.values[term.name] for term in job.tracker.terms]
    return np.sum(parts, axis=0)


def _motion(found: Adjusted, job: Job, before: Motion) -> Motion:
    return motion_from_poses(
        found.body,
        found.poses,
        before.fps,
        frame=before.frame,
        similarity=found.values["similarity"],
        energy=_energies(found, job),
        iterations=before.iterations,
        converged=before.converged,
        up=before.up,
    )


def _prefix(found: Adjusted, job: Job, before: Motion) -> Prefix:
    """The adjusted frames as a run keeps them."""
    count, cameras = len(found.poses), len(job.grids)
    none = np.zeros((count, cameras), int)
    return Prefix(
        {
            "pose": np.asarray(found.poses, np.float32),
            "energy": _energies(found, job).astype(np.float32),
            "iterations": before.iterations,
            "evaluations": before.iterations,
            "converged": before.converged,
            "num_near": none,
            "num_matching": none,
            "num_blocks": np.zeros(count, int),
            **{f"term_{name}": value.astype(np.float32) for name, value in found.values.items()},
            "capacity_near": np.full(count, found.room),
            "capacity_matching": np.full(count, found.room),
            "capacity_blocks": np.zeros(count, int),
        }
    )


def _numbers(job: Job, before: Motion, after: Motion, found: Adjusted, actor: Body) -> dict[str, Any]:
    """What was changed, and what it was good for."""
    was, now = bone_lengths(upright(actor, job.recording)), bone_lengths(found.body)
    numbers: dict[str, Any] = {
        "frames": before.num_frames,
        "frames_for_shape": len(found.shape_frames),
        "iterations": found.iterations,
        "energy_before": found.before,
        "energy_after": found.after,
        "bone_lengths_changed": {name: now[name] / was[name] - 1.0 for name in was if was[name] > 0.0},
    }
    numbers |= _feet(before, after)
    if job.recording.ground_truth is not None:
        truth = load_ground_truth(job.recording.ground_truth)
        truth = truth.subject(actor.name) if actor.name in truth.subjects else truth
        for key, motion in (("joints_before_mm", before), ("joints_after_mm", after)):
            errors = joint_errors(motion, truth)
            numbers[key] = None if errors is None else 1e3 * float(np.nanmean(errors.errors))
    return numbers


def _feet(before: Motion, after: Motion) -> dict[str, float | None]:
    """How far feet that stand move from frame to frame, on average: those that stand in the adjusted motion."""
    heights = undersides(after.blob_means, after.blob_sigma, axis_vector(after.up))
    stand = standing(after.blob_means, heights - floor_height(heights), after.frame, after.fps)[:-1]
    moved = lambda motion: 1e3 * float(np.linalg.norm(np.diff(motion.blob_means, axis=0), axis=-1)[stand].mean())
    found = [moved(motion) if stand.any() else None for motion in (before, after)]
    return {"standing_foot_before_mm": found[0], "standing_foot_after_mm": found[1]}


def sentence(numbers: dict[str, Any]) -> str:
    """The numbers in up to three lines."""
    changes = numbers["bone_lengths_changed"]
    most = max(changes, key=lambda name: abs(changes[name]))
    mean = float(np.mean(np.abs(list(changes.values()))))
    lines = (
        f"adjusted: energy {numbers['energy_before']:.5f} to {numbers['energy_after']:.5f} a frame; bones changed by "
        f"{mean:.1%} on average (most: {most} {changes[most]:+.1%})"
    )
    if numbers.get("joints_before_mm") is not None:
        lines += f"\njoints {numbers['joints_before_mm']:.1f} mm to {numbers['joints_after_mm']:.1f} mm from the truth"
    return lines + _of_colors(numbers["similarity_of_new_colors"], numbers["new_colors"])


def _of_colors(similarity: float, taken: bool) -> str:
    """A line on colours that are clearly more similar, by which factor, and were taken or not; else nothing."""
    if taken:
        return f"\ncolours measured anew: {similarity - 1.0:.1%} more similar"
    if similarity > CLEARLY:
        return f"\ncolours stay: new ones would be {similarity - 1.0:.1%} more similar, but put a limb in doubt"
    return ""
