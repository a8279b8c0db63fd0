"""Adjusting a tracked clip as a whole: its pictures read again, poses and shape climbed together, what came of it."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from sogjax.actor.colors import measured_colors
from sogjax.io.files import write_json
from sogjax.io.frame_motions import ClipFacts, motions_of
from sogjax.io.frame_table import FramesRecord, FrameTable
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.motion import Motion
from sogjax.io.npz_file import read_npz, save_npz
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.model.bones import bone_lengths
from sogjax.model.rotation import axis_vector, world_from_upright
from sogjax.quality.markers import joint_errors
from sogjax.refine.adjustment import Adjustment, adjusted
from sogjax.refine.clip_priors import floor_height, standing, step_of, undersides
from sogjax.refine.pictures import ClipPictures, Reader
from sogjax.run import build
from sogjax.run.actors import Actors
from sogjax.run.adjust_cameras import camera_numbers, moved_rig, moves_of
from sogjax.run.adjust_checks import WINDOW, check_length
from sogjax.run.adjust_colors import color_rows, judged_with_colors, mean_similarity
from sogjax.run.background import Background
from sogjax.run.initial_pose import InitialPose
from sogjax.run.keypoint_bias import FRAMES, bias_of_poses
from sogjax.run.recordings import upright
from sogjax.run.relearn_background import relearn_background
from sogjax.run.setup import Setup
from sogjax.run.terminal import progress, say
from sogjax.scene.cells import stack_shape
from sogjax.settings.method import ColorConfig
from sogjax.tracking.frame import FrameInput

CLEARLY = 1.01
"""By which factor new colours must explain more to be taken: those of example poses were measured within masks."""
FOLDER = "adjusted"


@dataclass(frozen=True)
class Adjusted(FramesRecord):
    """An adjusted clip of one actor; its frames are as if they had been tracked."""

    actor: Body
    """The actor in its own upright frame."""
    numbers: dict[str, Any]
    """The numbers before and after, for JSON."""
    moves: Float[np.ndarray, "camera 7"]
    """The moves of the cameras that were found."""

    def setup(self, before: Setup) -> Setup:
        """What the adjusted frames would be tracked with."""
        body = upright(self.actor, before.clip.recording)
        return _found_setup(before, body, self.moves if self.numbers.get("cameras") else None)

    def save(self, folder: Path) -> None:
        """Keep it in a run's folder; the numbers come last."""
        Actors((self.actor,)).save(folder / FOLDER)
        save_npz(folder / FOLDER / "frames.npz", self.table.arrays())
        save_npz(folder / FOLDER / "moves.npz", {"moves": self.moves})
        write_json(folder / FOLDER / "numbers.json", self.numbers)

    @classmethod
    def load(cls, folder: Path) -> "Adjusted | None":
        """What was kept, if all of it was."""
        if not (folder / FOLDER / "numbers.json").is_file():
            return None
        actors = Actors.load(folder / FOLDER)
        assert actors is not None
        numbers = json.loads((folder / FOLDER / "numbers.json").read_text(encoding="utf-8"))
        table = FrameTable.from_arrays(read_npz(folder / FOLDER / "frames.npz"))
        return cls(table, actors.bodies[0], numbers, read_npz(folder / FOLDER / "moves.npz")["moves"])


@dataclass(frozen=True)
class AdjustRequest:
    """What is adjusted."""

    window: int = WINDOW
    """Frames that are adjusted together."""
    with_shape: bool = True
    """Whether the shape of the actor is, too."""
    in_question: tuple[str, ...] = ()
    """Parts of the cameras' moves (`parts_in_question`) that are looked for, too."""


def adjust_clip(
    setup: Setup, background: Background, table: FrameTable, color: ColorConfig, request: AdjustRequest
) -> Adjusted:
    """Poses of all frames and the shape of the actor, adjusted together; then cameras, where they are in question.

    Args:
        setup: what was tracked with, as it was before anything was learnt from the poses.
        background: of the clip.
        table: the frames as they were tracked.
        color: the space in which colours are measured.
        request: what is adjusted.

    Raises:
        InputError: the clip is too short, or a video cannot be read.
    """
    recording, (body,) = setup.clip.recording, setup.bodies
    before = _motion(setup, table)
    check_length(len(table))
    setup = _informed(setup, background, table)
    source = _Source(setup, table.frame)
    found = adjusted(
        setup.tracker,
        source.pictures,
        table.pose,
        table.frame,
        np.asarray(table.terms["similarity"], float),
        recording.fps,
        recording.up,
        request.window,
        with_shape=request.with_shape,
        report=lambda stage: say(f"adjusting: {stage}"),
        moves=moves_of(recording),
        in_question=request.in_question,
    )
    moved = _found_setup(setup, found.body, found.moves if found.told else None)
    after_table = _table(found, moved, table)
    numbers = _numbers(body, before, _motion(moved, after_table), found, recording)
    if request.in_question:
        numbers["cameras"] = camera_numbers(recording, found)
    colored, numbers["similarity_of_new_colors"] = _recolored(moved, source, found, after_table, color)
    say("adjusting: what the cameras say of it")
    final, after_table = judged_with_colors(moved, colored, source.coming(np.arange(len(table))), after_table)
    numbers["new_colors"] = final.bodies[0] is not found.body
    turn = jnp.asarray(world_from_upright(recording.up).T, body.blob_sigmas.dtype)
    return Adjusted(after_table, final.bodies[0].rotated(turn), numbers, found.moves)


def _informed(setup: Setup, background: Background, table: FrameTable) -> Setup:
    """The setup that knows what the poses tell of keypoints and background."""
    rows = np.unique(np.linspace(0, len(table) - 1, FRAMES).astype(int))
    bias = bias_of_poses(setup, table.frame[rows], table.pose[rows])
    setup = bias.in_setup(setup)
    poses = {int(frame): jnp.asarray(pose) for frame, pose in zip(table.frame, table.pose, strict=True)}
    start = InitialPose(int(table.frame[0]), table.pose[0], "tracked")
    known = {int(table.frame[row]): table.pose[row] for row in rows}
    return relearn_background(setup, background, start, known, poses).in_setup(setup)


def _found_setup(setup: Setup, body: Body, moves: Float[np.ndarray, "camera 7"] | None) -> Setup:
    """The setup with the body that was found, and the cameras where they were."""
    tracker, clip = replace(setup.tracker, body=body), setup.clip
    if moves is not None:
        rig = moved_rig(clip.recording.rig, moves)
        clip = replace(clip, recording=replace(clip.recording, rig=rig))
        cameras = replace(tracker.cameras, camera_from_world=rig.cameras.camera_from_world)
        tracker = replace(tracker, cameras=cameras)
    return Setup(clip, (body,), tracker)


@dataclass(frozen=True)
class _Source:
    """Reads the pictures of rows of a table."""

    setup: Setup
    frames: Int[np.ndarray, "frame"]

    def pictures(self, rows: Int[np.ndarray, "row"], poses: Float[np.ndarray, "row dof"]) -> ClipPictures:
        """The pictures of some rows, near given poses."""
        reader = Reader.from_tracker(self.setup.tracker, stack_shape(self.setup.clip.grids))
        return reader.pictures(list(self.coming(rows)), poses)

    def coming(self, rows: Int[np.ndarray, "row"]) -> Iterator[FrameInput]:
        """The frames of some rows, one after the other."""
        wanted = self.frames[rows].tolist()
        numbers = range(min(wanted), max(wanted) + 1, self.setup.clip.numbers.step)
        shown = progress(self.setup.clip.frames(numbers.start, numbers.stop, numbers.step), len(numbers), "reading")
        chosen = set(wanted)
        yield from (frame for number, frame in zip(numbers, shown, strict=True) if number in chosen)


def _motion(setup: Setup, table: FrameTable) -> Motion:
    facts = ClipFacts.of(setup.clip.recording)
    return next(iter(motions_of(table, setup.bodies, facts).values()))


def _recolored(
    setup: Setup, source: _Source, found: Adjustment, table: FrameTable, color: ColorConfig
) -> tuple[Body, float]:
    """The adjusted body with the colours that the clip shows, if it is more similar so; and by which factor it is."""
    say("adjusting: colours")
    rows = color_rows(found.body, found.poses, np.asarray(table.terms["similarity"], float))
    poses, cells = found.poses[rows], list(source.coming(rows))
    space, _ = build.color_space_and_radius(color)
    body = measured_colors(setup.clip.recording, found.body, table.frame[rows].tolist(), poses, space)
    before, after = (mean_similarity(replace(setup.tracker, body=each), cells, poses) for each in (found.body, body))
    return (body if after > CLEARLY * before else found.body), after / before


def _energies(found: Adjustment, setup: Setup) -> Float[np.ndarray, "frame"]:
    """Eq. 10 of each frame, without a history."""
    parts = [float(term.signed_weight) * found.values[term.name] for term in setup.tracker.terms]
    return np.sum(parts, axis=0)


def _table(found: Adjustment, setup: Setup, before: FrameTable) -> FrameTable:
    """The adjusted frames as a run keeps them."""
    count, cameras = len(found.poses), len(setup.clip.grids)
    none = np.zeros((count, cameras), int)
    return FrameTable(
        frame=before.frame,
        pose=np.asarray(found.poses, np.float32),
        energy=_energies(found, setup).astype(np.float32),
        iterations=before.iterations,
        evaluations=before.iterations,
        converged=before.converged,
        num_near=none,
        num_matching=none,
        num_blocks=np.zeros(count, int),
        capacities=np.tile([found.capacity, found.capacity, 0], (count, 1)),
        limb_rival=before.limb_rival,
        terms={name: value.astype(np.float32) for name, value in found.values.items()},
    )


def _numbers(body: Body, before: Motion, after: Motion, found: Adjustment, recording: Recording) -> dict[str, Any]:
    """What was changed, and what it was good for."""
    was, now = bone_lengths(body), bone_lengths(found.body)
    numbers: dict[str, Any] = {
        "frames": before.num_frames,
        "frames_for_shape": len(found.shape_frames),
        "iterations": found.iterations,
        "energy_before": found.before,
        "energy_after": found.after,
        "bone_lengths_changed": {name: now[name] / was[name] - 1.0 for name in was if was[name] > 0.0},
    }
    numbers |= _feet(before, after)
    if recording.ground_truth is not None:
        truth = load_ground_truth(recording.ground_truth)
        truth = truth.subject(body.name) if body.name in truth.subjects else truth
        for key, motion in (("joints_before_mm", before), ("joints_after_mm", after)):
            errors = joint_errors(motion, truth)
            numbers[key] = None if errors is None else 1e3 * float(np.nanmean(errors.errors))
    return numbers


def _feet(before: Motion, after: Motion) -> dict[str, float | None]:
    """How far feet that stand move from frame to frame, on average: those that stand in the adjusted motion."""
    heights, step = undersides(after.blob_means, after.blob_sigma, axis_vector(after.up)), step_of(after.frame)
    stand = standing(after.blob_means, heights - floor_height(heights), after.frame, after.fps, step)[:-1]
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
