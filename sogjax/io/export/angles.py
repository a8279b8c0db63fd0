"""Joint angles in degrees, by the names and conventions of OpenSim's full-body models, as CSV and `.mot`.

Each angle is that of a bone relative to the one above it, both straight in the body's rest pose. With OpenSim's axes (X
forward, Y up, Z to the right) the relative rotation is R = Rz Rx Ry; the hand's is R = Rx Rz Ry.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.export.bones import euler_angles, frame_time, world_turn
from sogjax.io.export.points import write_columns
from sogjax.io.files import write_file
from sogjax.io.motion_data import MotionData
from sogjax.model.rotation import world_from_upright

_OPENSIM_FROM_BODY = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""A body's axes are x forward, y to its left, z up."""


@dataclass(frozen=True)
class _Pair:
    """A bone relative to the one above it, named by the joints whose frames they are."""

    above: str | None
    """The upper bone; None: the ground."""
    below: str
    order: str
    """The axes about which it turns, one after the other."""
    names: tuple[tuple[str, str, float], ...]
    """Name, axis and sign of each angle."""


def _of_side(side: str) -> list[_Pair]:
    end, mirrored = f"_{side[0]}", 1.0 if side == "right" else -1.0
    joint = lambda name: f"{side}_{name}"
    pair = lambda above, below, order, *names: _Pair(
        above, joint(below), order, tuple((name + end, axis, sign) for name, axis, sign in names)
    )
    return [
        pair("root_roll", "hip_twist", "ZXY", *_three("hip_flexion", "hip_adduction", "hip_rotation", mirrored)),
        pair(joint("hip_twist"), "knee", "ZXY", ("knee_angle", "Z", -1.0)),
        pair(joint("knee"), "ankle_roll", "ZXY", ("ankle_angle", "Z", 1.0), ("subtalar_angle", "X", mirrored)),
        pair("spine5_twist", "upper_arm_roll", "ZXY", *_three("arm_flex", "arm_add", "arm_rot", mirrored)),
        pair(joint("upper_arm_roll"), "elbow", "ZXY", ("elbow_flex", "Z", 1.0)),
        pair(joint("elbow"), "forearm_roll2", "ZXY", ("pro_sup", "Y", mirrored)),
        pair(joint("forearm_roll2"), "wrist_side", "XZY", ("wrist_flex", "X", mirrored), ("wrist_dev", "Z", 1.0)),
    ]


def _three(about_z: str, about_x: str, about_y: str, mirrored: float = 1.0) -> tuple[tuple[str, str, float], ...]:
    return (about_z, "Z", 1.0), (about_x, "X", mirrored), (about_y, "Y", mirrored)


_PAIRS = (
    _Pair(None, "root_roll", "ZXY", _three("pelvis_tilt", "pelvis_list", "pelvis_rotation")),
    *_of_side("right"),
    *_of_side("left"),
    _Pair("root_roll", "spine5_twist", "ZXY", _three("lumbar_extension", "lumbar_bending", "lumbar_rotation")),
    _Pair("spine5_twist", "head_twist", "ZXY", _three("neck_extension", "neck_bending", "neck_rotation")),
)


def joint_angles(motion: MotionData, up: str = "z") -> dict[str, Float[np.ndarray, "frame"]]:
    """Angles (degrees) and the pelvis' place (metres, Y up as in TRC) by OpenSim's names.

    Angles lie within half a turn; those of the pelvis go on from frame to frame.

    Raises:
        InputError: the body has none of the joints that they are angles of.
    """
    joints = motion.joint_names.tolist()
    pairs = [pair for pair in _PAIRS if {pair.above or pair.below, pair.below} <= set(joints)]
    if not pairs or pairs[0].above is not None:
        raise InputError(
            "joint angles are known of bodies with the joints of the default one (root_roll, left_knee, ...)"
        )
    place = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
    columns: dict[str, np.ndarray] = {}
    for pair in pairs:
        frames = motion.world_from_joint[:, joints.index(pair.below)].astype(float)
        turned = _turned(motion, joints, pair, up)
        angles = euler_angles(turned, pair.order)
        if pair.above is None:  # a person who turns round and round; others would stay a turn off after 90 degrees
            angles = np.unwrap(angles, axis=0, period=360.0)
        columns |= {name: sign * angles[:, pair.order.index(axis)] for name, axis, sign in pair.names}
        if pair.above is None:
            columns |= dict(zip(place, world_turn(up, "y") @ frames[:, :3, 3].T, strict=True))
    return columns


def _turned(motion: MotionData, joints: list[str], pair: _Pair, up: str) -> Float[np.ndarray, "frame 3 3"]:
    """The lower bone's axes in the upper one's, or in the ground's, all with OpenSim's axes."""
    opensim_from_bone = _OPENSIM_FROM_BODY @ world_from_upright(up).T
    rotation = lambda name: motion.world_from_joint[:, joints.index(name), :3, :3].astype(float)
    if pair.above is None:
        return world_turn(up, "y") @ rotation(pair.below) @ opensim_from_bone.T
    relative = np.swapaxes(rotation(pair.above), -1, -2) @ rotation(pair.below)
    return opensim_from_bone @ relative @ opensim_from_bone.T


def write_angles_csv(path: Path, motion: MotionData, up: str = "z") -> None:
    """Write one row per frame, after a line starting with `#` that gives the units, and the columns' names.

    Raises:
        InputError: as `joint_angles`; a path that cannot be written.
    """
    note = "angles: degrees, pelvis_tx pelvis_ty pelvis_tz: m with y up, time: s"
    write_columns(path, motion, note, joint_angles(motion, up))


def write_mot(path: Path, motion: MotionData, up: str = "z") -> None:
    """Write OpenSim's motion file."""
    frame_time(path, motion)
    columns = {"time": motion.time, **joint_angles(motion, up)}
    header = [path.stem, "version=1", f"nRows={motion.num_frames}", f"nColumns={len(columns)}", "inDegrees=yes"]
    header += [f"filter={motion.filtered_by}"] if motion.filtered_by else []
    rows = zip(*columns.values(), strict=True)
    lines = [*header, "endheader", "\t".join(columns), *("\t".join(f"{value:.6f}" for value in row) for row in rows)]
    write_file(path, "\n".join(lines) + "\n")
