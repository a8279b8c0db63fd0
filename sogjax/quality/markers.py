"""Virtual markers on a tracked body (Section 6), and distances of markers and joints to the truth."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from sogjax.errors import InputError
from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import Motion

SAME_ORIGIN = 1e-4
"""Metres. One-axis joints nearer than this to each other in every frame are one anatomical joint."""

MarkerRule = Literal["scaled", "closest"]
"""Which blob of a body is closest to a marker: in the blob's own sigmas, or by plain distance (Section 6)."""
MARKER_RULES: tuple[MarkerRule, ...] = ("scaled", "closest")


@dataclass(frozen=True)
class PointErrors:
    """Distances of tracked points to the truth; NaN where the truth has no value."""

    names: tuple[str, ...]
    """The truth's names of the points."""
    compared_with: tuple[str, ...]
    """The motion's joint that carries, or is, each point."""
    errors: Float[np.ndarray, "frame point"]
    """Metres."""


@dataclass(frozen=True)
class VirtualMarkers:
    """Markers fixed to the joints of a motion; a marker that the truth never has is on joint -1."""

    joints: Int[np.ndarray, "marker"]
    offsets: Float[np.ndarray, "marker 3"]
    """Metres, in the frame of the marker's joint."""

    def positions(self, world_from_joint: Float[np.ndarray, "frame joint 4 4"]) -> Float[np.ndarray, "frame marker 3"]:
        """Where the markers are in the world; NaN for those that are on no joint."""
        frames = world_from_joint[:, self.joints]
        placed = np.einsum("tmij,mj->tmi", frames[..., :3, :3], self.offsets) + frames[..., :3, 3]
        return np.where(self.joints[None, :, None] >= 0, placed, np.nan)


def common_frames(motion: Motion, truth: GroundTruth) -> tuple[Int[np.ndarray, "common"], Int[np.ndarray, "common"]]:
    """Rows of the motion and of the truth that are the same frame of the recording.

    Row i of a truth is frame i; a motion says its frames itself.

    Raises:
        InputError: different frame rates, a motion that is not finite, or no common frame.
    """
    if not np.isclose(float(motion.fps), float(truth.fps), rtol=1e-3):
        raise InputError(
            f"the motion has {float(motion.fps):g} frames per second and the truth {float(truth.fps):g}; "
            "resample the truth to the motion's rate"
        )
    if not np.isfinite(motion.world_from_joint).all():
        raise InputError("the motion has values that are not finite; track it again")
    if truth.markers is None and truth.joints is None:
        raise InputError("the truth has neither markers nor joints; nothing can be compared")
    frames = np.asarray(motion.frame, int)
    rows = np.flatnonzero((frames >= 0) & (frames < truth.num_frames))
    if rows.size == 0:
        raise InputError(
            f"the motion's frames {frames.min()} to {frames.max()} are none of the truth's "
            f"{truth.num_frames}; compare files of the same recording"
        )
    return rows, frames[rows]


def attach_markers(
    motion: Motion, markers: Float[np.ndarray, "frame marker 3"], rule: MarkerRule = "scaled"
) -> VirtualMarkers:
    """Attach each marker to the parent joint of its closest blob, in the first frame that has the marker.

    By plain distance (`closest`, Section 6), a marker on a thigh may go with the hand that hangs in front of it: the
    hand's blob is small and its centre near. In the blob's own sigmas (`scaled`) it goes with the thigh.

    `markers` has one row for each row of `motion`.
    """
    present = ~np.isnan(markers.sum(axis=2))
    first = present.argmax(axis=0)
    points = np.where(present.any(axis=0)[:, None], markers[first, np.arange(len(first))], 0.0)
    distances = np.linalg.norm(motion.blob_means[first] - points[:, None], axis=-1)
    if rule == "scaled":
        distances = distances / np.asarray(motion.blob_sigma, float)
    joints = np.asarray(motion.blob_joint, int)[distances.argmin(axis=1)]
    frames = np.asarray(motion.world_from_joint, float)[first, joints]
    offsets = np.einsum("mji,mj->mi", frames[:, :3, :3], points - frames[:, :3, 3])
    return VirtualMarkers(np.where(present.any(axis=0), joints, -1), offsets)


def marker_errors(motion: Motion, truth: GroundTruth, rule: MarkerRule = "scaled") -> PointErrors | None:
    """Distances of the truth's markers to the virtual ones; None where the truth has no markers.

    A marker's error is 0 by construction in the first frame that has it. That frame counts in every mean of this
    project: the paper's "average distance" excludes none.
    """
    if truth.markers is None:
        return None
    rows, truth_rows = common_frames(motion, truth)
    part = motion.of_rows(rows)
    markers = np.asarray(truth.markers, float)[truth_rows]
    virtual = attach_markers(part, markers, rule)
    names = np.append(np.asarray(motion.joint_names, str), "")
    return PointErrors(
        names=tuple(map(str, truth.marker_names)),
        compared_with=tuple(map(str, names[virtual.joints])),
        errors=np.linalg.norm(virtual.positions(part.world_from_joint) - markers, axis=-1),
    )


def joint_errors(motion: Motion, truth: GroundTruth) -> PointErrors | None:
    """Distances of joint centres to the truth's, for the joints that both have; None where there are none.

    A truth's joint is the motion's joint of the same name, or the one-axis joints whose names start with it
    (`left_shoulder` is `left_shoulder_flexion`) if those share one place; `l_` and `r_` read as `left_` and
    `right_`.
    """
    if truth.joints is None:
        return None
    rows, truth_rows = common_frames(motion, truth)
    names = list(map(str, motion.joint_names))
    found = ((k, _joint_named(motion, names, str(name))) for k, name in enumerate(truth.joint_names))
    pairs = [(k, joint) for k, joint in found if joint is not None]
    if not pairs:
        return None
    theirs = np.asarray(truth.joints, float)[truth_rows][:, [k for k, _ in pairs]]
    ours = motion.world_from_joint[rows][:, [j for _, j in pairs]][..., :3, 3]
    return PointErrors(
        names=tuple(str(truth.joint_names[k]) for k, _ in pairs),
        compared_with=tuple(str(motion.joint_names[j]) for _, j in pairs),
        errors=np.linalg.norm(ours - theirs, axis=-1),
    )


def _joint_named(motion: Motion, names: list[str], truth_name: str) -> int | None:
    name = truth_name.lower()
    for short, long in (("l_", "left_"), ("r_", "right_")):
        name = long + name.removeprefix(short) if name.startswith(short) else name
    if name in names:
        return names.index(name)
    joints = [j for j, joint in enumerate(names) if joint.startswith(name + "_")]
    if not joints:
        return None
    origins = motion.world_from_joint[:, joints][..., :3, 3]
    return joints[0] if np.abs(origins - origins[:, :1]).max() < SAME_ORIGIN else None
