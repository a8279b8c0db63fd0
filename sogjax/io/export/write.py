"""Motions in the formats of other programs, by the file's ending, and one frame of them as `initial_pose.yaml`."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sogjax.errors import InputError
from sogjax.io.export.angles import write_mot
from sogjax.io.export.bones import bones_of
from sogjax.io.export.bvh import write_bvh
from sogjax.io.export.glb import write_glb
from sogjax.io.export.points import write_c3d, write_csv, write_trc
from sogjax.io.files import write_file
from sogjax.io.motion_data import MotionData, save_motion

WRITERS: dict[str, Callable[[Path, MotionData, str], None]] = {
    ".bvh": write_bvh,
    ".c3d": write_c3d,
    ".csv": write_csv,
    ".glb": write_glb,
    ".mot": write_mot,
    ".npz": lambda path, motion, up: save_motion(path, replace(motion, up=up)),
    ".trc": write_trc,
}
"""What writes a motion, by the file's ending; the last argument is the vertical of the motion's world."""


def export_motion(motion: MotionData, path: Path, up: str | None = None) -> None:
    """Write `motion` in the format that the ending of `path` names.

    `up` is the vertical of the motion's world, where it is not what the motion says.

    Raises:
        InputError: an ending that no writer knows, or what the writer refuses.
    """
    writer = WRITERS.get(path.suffix.lower())
    if writer is None:
        known = " ".join(sorted(WRITERS))
        raise InputError(f"{path}: no writer for the extension {path.suffix!r}; use one of: {known}")
    writer(path, motion, up or motion.up)


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
