"""A frame of motions as `initial_pose.yaml`: the pose with which tracking can begin anew."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from sogjax.errors import InputError
from sogjax.io.export.bones import bones_of
from sogjax.io.files import atomic_path
from sogjax.io.motion_data import MotionData

DIGITS = 5
"""Of radians and metres."""


def write_initial_pose(path: Path, motions: Sequence[MotionData], frame: int | None = None) -> None:
    """Write the poses of one frame, by the recording's numbers; None: the motions' first.

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
    with atomic_path(path) as temporary:
        temporary.write_text(f"# Frame {_number(motions[0], frame)} of a motion.\n{text}", encoding="utf-8")


def _number(motion: MotionData, frame: int | None) -> int:
    return int(motion.frame[0]) if frame is None else frame


def _pose(path: Path, motion: MotionData, frame: int | None) -> dict[str, Any]:
    if motion.num_frames == 0:
        raise InputError(f"{path}: the motion has no frames")
    wanted = _number(motion, frame)
    rows = np.flatnonzero(motion.frame == wanted)
    if len(rows) == 0:
        raise InputError(f"frame={frame}: the motion has the frames {motion.frame[0]} to {motion.frame[-1]}")
    root = bones_of(motion).chains[0][-1]
    angles = zip(motion.dof_names.tolist(), motion.pose[rows[0]].tolist(), strict=True)
    place = motion.world_from_joint[rows[0], root, :3, 3].tolist()
    return {
        "pose": {name: round(value, DIGITS) for name, value in angles},
        "position": [round(value, DIGITS) for value in place],
    }
