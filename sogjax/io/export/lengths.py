"""Lengths of an actor's segments between markers, for scaling a model, as CSV."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.export.bones import check_frames
from sogjax.io.export.points import OPENSIM_ENDS, OPENSIM_NAMES
from sogjax.io.files import csv_text, write_file
from sogjax.io.motion_data import MotionData

ENDING = ".lengths.csv"
_OF_SIDE = {
    **{"torso": ("Shoulder", "Hip"), "arm": ("Shoulder", "Elbow"), "forearm": ("Elbow", "Wrist")},
    **{"thigh": ("Hip", "Knee"), "shank": ("Knee", "Ankle"), "foot": ("Heel", "BigToe")},
}
MEASUREMENTS: tuple[tuple[str, str, str], ...] = (
    *((name, side + one, side + other) for name, (one, other) in _OF_SIDE.items() for side in "RL"),
    *(("head", "Head", "Nose"), ("head", "Head", "Neck"), ("pelvis", "RHip", "LHip")),
)
"""The measurements and pairs of markers with which Pose2Sim's set-up files scale its model."""
_LANDMARKS = {theirs: ours for ours, theirs in (OPENSIM_NAMES | OPENSIM_ENDS | {"nose": "Nose"}).items()}


def segment_lengths(motion: MotionData) -> dict[tuple[str, str, str], Float[np.ndarray, "frame"]]:
    """Metres in every frame of the measurements whose ends the motion's body has as landmarks."""
    known = [] if motion.landmark_names is None else motion.landmark_names.tolist()
    between = {each: [_LANDMARKS[marker] for marker in each[1:]] for each in MEASUREMENTS}
    return {
        each: np.linalg.norm(motion.joint(one) - motion.joint(other), axis=-1)
        for each, (one, other) in between.items()
        if one in known and other in known
    }


def write_lengths(path: Path, motion: MotionData, up: str = "z") -> None:
    """Write the median length of each measurement, and how far it changes, in metres.

    Raises:
        InputError: no frames, or a body that has none of the measurements; a path that cannot be written.
    """
    check_frames(path, motion)
    rows = [
        (name, one, other, f"{np.median(apart):.4f}", f"{np.ptp(apart):.4f}")
        for (name, one, other), apart in segment_lengths(motion).items()
    ]
    if not rows:
        raise InputError(f"{path}: the motion's body has none of the landmarks that lengths are measured between")
    note = "# unit: m; length: median over the frames, range: how far it changes (bones: 0)\n"
    write_file(path, note + csv_text([("measurement", "from", "to", "length", "range"), *rows]))
