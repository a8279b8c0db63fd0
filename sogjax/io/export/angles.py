"""Joint angles in degrees, by the names and conventions of OpenSim's full-body models, as CSV and `.mot`.

Each angle is that of a bone relative to the one above it, both straight in the body's rest pose. With OpenSim's axes (X
forward, Y up, Z to the right) the relative rotation is R = Rz Rx Ry; the hand's is R = Rx Rz Ry.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.export.bones import euler_angles, frame_time, world_turn
from sogjax.io.export.points import write_columns
from sogjax.io.files import write_file
from sogjax.io.motion_data import MotionData
from sogjax.model.reach import TOLD, reach
from sogjax.model.rotation import world_from_upright
from sogjax.model.skeleton import ancestor_table

_OPENSIM_FROM_BODY = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""A body's axes are x forward, y to its left, z up."""


@dataclass(frozen=True)
class _Pair:
    """A segment relative to the one above it."""

    above: str | None
    """The upper segment; None: the ground."""
    below: str
    order: str
    """The axes about which it turns, one after the other."""
    names: tuple[tuple[str, str, float], ...]
    """Name, axis and sign of each angle."""


def _of_side(side: str) -> list[_Pair]:
    end, mirrored = f"_{side[0]}", 1.0 if side == "right" else -1.0
    own = lambda name: f"{side}_{name}"
    pair = lambda above, below, order, *names: _Pair(
        above, own(below), order, tuple((name + end, axis, sign) for name, axis, sign in names)
    )
    return [
        pair("pelvis", "thigh", "ZXY", *_three("hip_flexion", "hip_adduction", "hip_rotation", mirrored)),
        pair(own("thigh"), "shank", "ZXY", ("knee_angle", "Z", -1.0)),
        pair(own("shank"), "foot", "ZXY", ("ankle_angle", "Z", 1.0), ("subtalar_angle", "X", mirrored)),
        pair("chest", "upper_arm", "ZXY", *_three("arm_flex", "arm_add", "arm_rot", mirrored)),
        pair(own("upper_arm"), "forearm", "ZXY", ("elbow_flex", "Z", 1.0)),
        pair(own("forearm"), "forearm_end", "ZXY", ("pro_sup", "Y", mirrored)),
        pair(own("forearm_end"), "hand", "XZY", ("wrist_flex", "X", mirrored), ("wrist_dev", "Z", 1.0)),
    ]


def _three(about_z: str, about_x: str, about_y: str, mirrored: float = 1.0) -> tuple[tuple[str, str, float], ...]:
    return (about_z, "Z", 1.0), (about_x, "X", mirrored), (about_y, "Y", mirrored)


_PAIRS = (
    _Pair(None, "pelvis", "ZXY", _three("pelvis_tilt", "pelvis_list", "pelvis_rotation")),
    *_of_side("right"),
    *_of_side("left"),
    _Pair("pelvis", "chest", "ZXY", _three("lumbar_extension", "lumbar_bending", "lumbar_rotation")),
    _Pair("chest", "head", "ZXY", _three("neck_extension", "neck_bending", "neck_rotation")),
)
_SIDES_JOINTS = {
    **{"thigh": "hip_twist", "shank": "knee", "foot": "ankle_roll", "upper_arm": "upper_arm_roll"},
    **{"forearm": "elbow", "forearm_end": "forearm_roll2", "hand": "wrist_side"},
}
SEGMENT_JOINTS = {"pelvis": "root_roll", "chest": "spine5_twist", "head": "head_twist"} | {
    f"{side}_{segment}": f"{side}_{joint}" for side in ("left", "right") for segment, joint in _SIDES_JOINTS.items()
}
"""The joints of the default body whose frames its segments are."""
PLACE = ("pelvis_tx", "pelvis_ty", "pelvis_tz")


def has_angles(motion: MotionData) -> bool:
    """Whether angles between the body's segments are known, not only those of its root in the ground."""
    joints = motion.joint_names.tolist()
    has = lambda segment: SEGMENT_JOINTS[segment] in joints
    return has("pelvis") and any(has(pair.above) and has(pair.below) for pair in _PAIRS if pair.above is not None)


def joint_angles(motion: MotionData, up: str = "z") -> dict[str, Float[np.ndarray, "frame"]]:
    """Angles (degrees) and the pelvis' place (metres, Y up as in TRC) by OpenSim's names.

    Raises:
        InputError: the body has none of the joints that they are angles of.
    """
    joints = motion.joint_names.tolist()
    known = {segment: joints.index(joint) for segment, joint in SEGMENT_JOINTS.items() if joint in joints}
    if "pelvis" not in known:
        raise InputError(
            "joint angles are known of bodies with the joints of the default one (root_roll, left_knee, ...)"
        )
    frames = motion.world_from_joint.astype(float)
    angles = segment_angles({segment: frames[:, joint, :3, :3] for segment, joint in known.items()}, up)
    place = world_turn(up, "y") @ frames[:, known["pelvis"], :3, 3].T
    first = [name for name, _, _ in _PAIRS[0].names]
    return {name: angles[name] for name in first} | dict(zip(PLACE, place, strict=True)) | angles


def segment_angles(
    world_from_segment: Mapping[str, Float[np.ndarray, "frame 3 3"]], up: str = "z"
) -> dict[str, Float[np.ndarray, "frame"]]:
    """Angles (degrees) by OpenSim's names, of the segments that are known (the names of `SEGMENT_JOINTS`).

    The segments' axes are the world's where the body stands straight. Angles go on from frame to frame without jumps of
    a turn, most of them within half a turn of 0.
    """
    opensim_from_bone = _OPENSIM_FROM_BODY @ world_from_upright(up).T
    columns: dict[str, np.ndarray] = {}
    for pair in _PAIRS:
        if pair.below not in world_from_segment or (pair.above or pair.below) not in world_from_segment:
            continue
        below = world_from_segment[pair.below]
        if pair.above is None:
            turned = world_turn(up, "y") @ below @ opensim_from_bone.T
        else:
            relative = np.swapaxes(world_from_segment[pair.above], -1, -2) @ below
            turned = opensim_from_bone @ relative @ opensim_from_bone.T
        angles = unwrapped(euler_angles(turned, pair.order))
        columns |= {name: sign * angles[:, pair.order.index(axis)] for name, axis, sign in pair.names}
    return columns


def angle_reaches(motion: MotionData, up: str = "z") -> dict[str, float]:
    """How far each angle moves the body's blobs (`sogjax.model.reach`), the median over the frames, by OpenSim's names.

    It is the turn of the lower segment about its own joint, of a head about the base of its skull. Those of the pelvis,
    which move everything, are left out.
    """
    joints = motion.joint_names.tolist()
    known = {segment: joints.index(joint) for segment, joint in SEGMENT_JOINTS.items() if joint in joints}
    below = ancestor_table(tuple(motion.joint_parents.tolist()))
    bone_axes = (_OPENSIM_FROM_BODY @ world_from_upright(up).T).T
    frames, found = motion.world_from_joint.astype(float), {}
    for pair in _PAIRS:
        if pair.above is None or pair.above not in known or pair.below not in known or not motion.num_frames:
            continue
        joint, carried = known[pair.below], below[motion.blob_joint, known[pair.below]]
        arms = motion.blob_means[:, carried].astype(float) - frames[:, None, joint, :3, 3]
        sigmas = motion.blob_sigma[carried].astype(float)
        for name, axis, _ in pair.names:
            # the first angle turns about an axis of the upper segment, the others about those of the lower one, nearly
            held_by = known[pair.above] if axis == pair.order[0] else joint
            direction = frames[:, held_by, :3, :3] @ bone_axes[:, "XYZ".index(axis)]
            found[name] = float(np.median(reach(np.cross(direction[:, None], arms), sigmas)))
    return found


def angles_not_told(motion: MotionData, up: str = "z") -> tuple[str, ...]:
    """The angles that the body's blobs do not tell in most frames, by OpenSim's names."""
    return tuple(name for name, reaches in angle_reaches(motion, up).items() if reaches < TOLD)


def unwrapped(degrees: Float[np.ndarray, "frame *angle"]) -> Float[np.ndarray, "frame *angle"]:
    """Angles that go on from frame to frame instead of jumping by a turn; their medians lie within half a turn of 0."""
    if len(degrees) == 0:
        return degrees
    whole = np.unwrap(degrees, axis=0, period=360.0)
    return whole - 360.0 * np.round(np.median(whole, axis=0) / 360.0)


def write_angles_csv(path: Path, motion: MotionData, up: str = "z") -> None:
    """Write one row per frame, after a line starting with `#`, and the columns' names.

    That line gives the units, and names the angles that the body does not tell.

    Raises:
        InputError: as `joint_angles`; a path that cannot be written.
    """
    note = "angles: degrees, pelvis_tx pelvis_ty pelvis_tz: m with y up, time: s"
    untold = angles_not_told(motion, up)
    note += f", not told by the body's spheres: {' '.join(untold)}" if untold else ""
    write_columns(path, motion, note, joint_angles(motion, up))


def write_mot(path: Path, motion: MotionData, up: str = "z") -> None:
    """Write OpenSim's motion file."""
    frame_time(path, motion)
    columns = {"time": motion.time, **joint_angles(motion, up)}
    header = [path.stem, "version=1", f"nRows={motion.num_frames}", f"nColumns={len(columns)}", "inDegrees=yes"]
    header += [f"filter={motion.filtered_by}"] if motion.filtered_by else []
    untold = angles_not_told(motion, up)
    header += [f"not_told={' '.join(untold)}"] if untold else []
    rows = zip(*columns.values(), strict=True)
    lines = [*header, "endheader", "\t".join(columns), *("\t".join(f"{value:.6f}" for value in row) for row in rows)]
    write_file(path, "\n".join(lines) + "\n")
