"""Motions in the formats of other programs, by the file's ending, and one frame of them as `initial_pose.yaml`."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sogjax.errors import InputError
from sogjax.io.export.angles import joint_angles, write_mot
from sogjax.io.export.bones import bones_of
from sogjax.io.export.bvh import write_bvh
from sogjax.io.export.glb import write_glb
from sogjax.io.export.lafan1 import figure_of, write_lafan1
from sogjax.io.export.points import LENGTHS, segment_lengths, write_c3d, write_csv, write_lengths, write_trc
from sogjax.io.files import write_file
from sogjax.io.motion_data import MotionData, save_motion

WRITERS: dict[str, Callable[[Path, MotionData, str], str | None]] = {
    ".bvh": write_bvh,
    ".lafan1.bvh": write_lafan1,
    ".c3d": write_c3d,
    ".csv": write_csv,
    LENGTHS: write_lengths,
    ".glb": write_glb,
    ".mot": write_mot,
    ".npz": lambda path, motion, up: save_motion(path, replace(motion, up=up)),
    ".trc": write_trc,
}
"""What writes a motion, by the file's ending, the longest that fits; the last argument is the vertical of the motion's
world. A sentence that a writer returns is for the user."""
DIALECTS = {"lafan1": ".lafan1.bvh"}
"""The endings of dialects, by their names: the first word of the ending."""
WITH_LENGTHS = (".trc", ".mot")
"""The formats beside which the lengths of segments are written, where the body has them."""
NEEDS: dict[str, Callable[[MotionData], object]] = {
    ".lafan1.bvh": lambda motion: figure_of("the format lafan1.bvh", motion, motion.up),
    ".mot": lambda motion: joint_angles(motion, motion.up),
}
"""What refuses a body that a format cannot hold, by the file's ending."""


def export_motion(motion: MotionData, path: Path, up: str | None = None, dialect: str | None = None) -> str | None:
    """Write `motion` in the format that the ending of `path` names.

    Args:
        motion: what to write.
        path: the file; `.lafan1.bvh` is a `.bvh` of that dialect.
        up: the vertical of the motion's world, where it is not what the motion says.
        dialect: one of `DIALECTS`, of a file whose ending does not say it.

    Returns:
        What is to be said of the file, if anything.

    Raises:
        InputError: an ending that no writer knows, or what the writer refuses.
    """
    ending = ending_of(path) if dialect is None else DIALECTS[dialect]
    if ending is None:
        known = " ".join(sorted(WRITERS))
        raise InputError(f"{path}: no writer for the extension {path.suffix!r}; use one of: {known}")
    return WRITERS[ending](path, motion, up or motion.up)


def endings_beside(ending: str, motion: MotionData) -> list[str]:
    """The formats that are written with that of an ending."""
    return [LENGTHS] if ending in WITH_LENGTHS and segment_lengths(motion) else []


def ending_of(path: Path) -> str | None:
    """The ending of a file by which its writer is found; None where there is none."""
    fitting = [ending for ending in WRITERS if path.name.lower().endswith(ending)]
    return max(fitting, key=len, default=None)


def write_initial_pose(path: Path, motions: Sequence[MotionData], frame: int | None = None) -> None:
    """Write the poses of one frame, by the recording's numbers (None: the motions' first), to begin tracking with.

    With several motions the file is a mapping of their actors to poses.

    Raises:
        InputError: a motion without that frame, several motions of which one does not say whose it is, or a path that
            cannot be written.
    """
    poses = [_pose(path, motion, frame) for motion in motions]
    names = [motion.actor for motion in motions]
    if len(motions) > 1 and (not all(names) or len(set(names)) < len(names)):
        raise InputError(f"{path}: motions of several actors must each say whose they are, but they say {names}")
    content = poses[0] if len(poses) == 1 else dict(zip(names, poses, strict=True))
    text = yaml.safe_dump(content, sort_keys=False, default_flow_style=None)
    write_file(path, f"# Frame {_frame(motions[0], frame)} of a motion.\n{text}")


def _frame(motion: MotionData, frame: int | None) -> int:
    return int(motion.frame[0]) if frame is None else frame


def _pose(path: Path, motion: MotionData, frame: int | None) -> dict[str, Any]:
    if motion.num_frames == 0:
        raise InputError(f"{path}: the motion has no frames")
    wanted = _frame(motion, frame)
    rows = np.flatnonzero(motion.frame == wanted)
    if len(rows) == 0:
        raise InputError(f"frame={frame}: the motion has the frames {motion.frame[0]} to {motion.frame[-1]}")
    digits = 5  # of radians and metres
    root = bones_of(motion).chains[0][-1]
    angles = zip(motion.dof_names.tolist(), motion.pose[rows[0]].tolist(), strict=True)
    place = motion.world_from_joint[rows[0], root, :3, 3].tolist()
    return {
        "pose": {name: round(value, digits) for name, value in angles},
        "position": [round(value, digits) for value in place],
    }
