"""Points of a motion as other programs' marker files and tables hold them: C3D, TRC, CSV; and lengths between them."""

import importlib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.export.bones import bone_frames, bones_of, check_finite, check_frames, frame_time, world_turn
from sogjax.io.files import atomic_path, csv_text, write_file
from sogjax.io.keypoints.scheme import named_scheme
from sogjax.io.motion_data import MotionData
from sogjax.model.rotation import forward_axis

_JOINTS = {"hip": "Hip", "knee": "Knee", "ankle": "Ankle", "shoulder": "Shoulder", "elbow": "Elbow", "wrist": "Wrist"}
_ENDS = {"toe": "BigToe", "small_toe": "SmallToe", "heel": "Heel", "hand": "Hand"}


def _both_sides(names: dict[str, str]) -> dict[str, str]:
    return {f"{side}_{ours}": side[0].upper() + name for side in ("left", "right") for ours, name in names.items()}


OPENSIM_NAMES = {"root": "Hip", "neck": "Neck"} | _both_sides(_JOINTS)
"""The names that OpenSim models for video have (Pose2Sim's), by those of the default body's bones."""
OPENSIM_ENDS = {"head_top": "Head"} | _both_sides(_ENDS)
"""The names that these models have of landmarks where a body ends."""
_EVERY_BONE = "all"


def marker_points(
    motion: MotionData, up: str, to: str, markers: str | None = None
) -> tuple[list[str], Float[np.ndarray, "frame marker 3"]]:
    """Names and positions (metres) of the points, in a world turned from the vertical `up` to `to`.

    Without `markers` they are joint centres, toes, heels, hands and the top of the head; with `all` every bone, too,
    those that only roll as well; else those of a keypoint scheme, by name or file, under its names.

    Raises:
        InputError: no such scheme, or the motion lacks one of its points.
    """
    if markers not in (None, _EVERY_BONE):
        scheme = named_scheme(str(markers))
        points = np.stack([motion.joint(name).astype(float) for name in scheme.landmarks], axis=1)
        return list(scheme.keypoints), points @ world_turn(up, to).T
    bones = bones_of(motion)
    _, positions = bone_frames(motion, bones, up, to)
    # Bones that only turn about the line to the next joint have origins that are no joint centres.
    rolls = lambda name: re.search(r"_roll\d*$", name) is not None
    kept = [k for k, name in enumerate(bones.names) if markers == _EVERY_BONE or not rolls(name)]
    names = [OPENSIM_NAMES.get(bones.names[k], bones.names[k]) for k in kept]
    known = [] if motion.landmark_names is None else motion.landmark_names.tolist()
    ends = [name for name in OPENSIM_ENDS if name in known]
    places = [motion.joint(name).astype(float) @ world_turn(up, to).T for name in ends]
    return names + [OPENSIM_ENDS[name] for name in ends], np.stack([*positions[:, kept].swapaxes(0, 1), *places], 1)


def write_c3d(path: Path, motion: MotionData, up: str = "z", markers: str | None = None) -> None:
    """Write C3D, the format of marker systems: the points of `marker_points` in millimetres, in the motion's world.

    POINT:X_SCREEN and Y_SCREEN say which axes point forward and up.

    Raises:
        InputError: ezc3d is not installed; no frames, too many or uneven ones; or a path that cannot be written.
    """
    most_frames = 65_535  # a C3D header counts no further; more frames would be lost silently
    ezc3d = require_ezc3d(str(path))
    rate = 1.0 / frame_time(path, motion)
    if motion.num_frames > most_frames:
        raise InputError(
            f"{path}: C3D holds at most {most_frames} frames, but the motion has {motion.num_frames}; "
            "write .trc or .csv, or track it in parts"
        )
    names, positions = marker_points(motion, up, up, markers)
    points = np.ones((4, len(names), motion.num_frames))
    points[:3] = 1000.0 * positions.transpose(2, 1, 0)
    file = ezc3d.c3d()
    parameters = file["parameters"]["POINT"]
    parameters["RATE"]["value"] = [rate]
    parameters["LABELS"]["value"] = names
    parameters["UNITS"]["value"] = ["mm"]
    file.add_parameter("POINT", "X_SCREEN", _signed(forward_axis(up)))
    file.add_parameter("POINT", "Y_SCREEN", _signed(up))
    if motion.filtered_by:
        file.add_parameter("PROCESSING", "FILTER", [motion.filtered_by])
    file["data"]["points"] = points
    with atomic_path(path) as temporary:
        file.write(str(temporary))


def require_ezc3d(where: str) -> Any:
    """The module that writes C3D.

    Raises:
        InputError: it is not installed; `where` begins the sentence.
    """
    try:
        return importlib.import_module("ezc3d")
    except ImportError as error:
        raise InputError(f"{where}: C3D needs the package ezc3d; install it: pip install 'sogjax[export]'") from error


def _signed(axis: str) -> str:
    return f"{'-' if axis.startswith('-') else '+'}{axis[-1].upper()}"


def write_csv(path: Path, motion: MotionData, up: str = "z") -> None:
    """Write the origins of all bones, in metres in the motion's own world, whose vertical is stated, as CSV.

    Raises:
        InputError: a path that cannot be written.
    """
    bones = bones_of(motion)
    _, positions = bone_frames(motion, bones, up, up)
    names = [f"{name}.{axis}" for name in bones.names for axis in "xyz"]
    flat = positions.reshape(motion.num_frames, len(names))
    write_columns(path, motion, f"unit: m, time: s, up: {up}", dict(zip(names, flat.T, strict=True)))


def limb_confidence(motion: MotionData) -> dict[str, Float[np.ndarray, "frame"]]:
    """How sure each limb's place is, 0 to 1: how likely within 10 cm, but no more than the part of it that is seen."""
    if motion.limb_names is None or motion.limb_doubt is None:
        return {}
    seen = np.ones_like(motion.limb_doubt) if motion.limb_hidden is None else 1.0 - motion.limb_hidden
    sure = np.nan_to_num(np.clip(np.minimum(1.0 - motion.limb_doubt, seen), 0.0, 1.0))
    return {f"{name}.confidence": sure[:, limb] for limb, name in enumerate(map(str, motion.limb_names))}


def write_columns(path: Path, motion: MotionData, note: str, columns: Mapping[str, Float[np.ndarray, "frame"]]) -> None:
    """Write CSV: after a line starting with `#` with a note, and the columns' names, one row per frame.

    The last columns are the confidence of each limb that was judged.
    """
    check_finite(path, motion)
    columns = {**columns, **limb_confidence(motion)}
    filtered = f", filter: {motion.filtered_by}" if motion.filtered_by else ""
    values = zip(motion.frame.tolist(), motion.time.tolist(), *columns.values(), strict=True)
    rows = ([frame, *(f"{value:.6f}" for value in row)] for frame, *row in values)
    write_file(path, f"# {note}{filtered}\n" + csv_text([["frame", "time", *columns], *rows]))


def write_trc(path: Path, motion: MotionData, up: str = "z", markers: str | None = None) -> None:
    """Write TRC, OpenSim's tab-separated marker file: the points of `marker_points` in metres, Y up.

    X, Y, Z are Y, Z, X of a world with z up, as in Pose2Sim's files.

    Raises:
        InputError: no frames, unevenly spaced frames, or a path that cannot be written; a keypoint scheme that is not
            known, or a motion that lacks one of its points.
    """
    rate = f"{1.0 / frame_time(path, motion):.6f}"
    names, positions = marker_points(motion, up, "y", markers)
    count = str(motion.num_frames)
    facts = {
        **{"DataRate": rate, "CameraRate": rate, "NumFrames": count, "NumMarkers": str(len(names)), "Units": "m"},
        **{"OrigDataRate": rate, "OrigDataStartFrame": str(int(motion.frame[0])), "OrigNumFrames": count},
    }
    header = [
        ["PathFileType", "4", "(X/Y/Z)", path.name, *([f"filter: {motion.filtered_by}"] if motion.filtered_by else [])],
        [*facts],
        [*facts.values()],
        ["Frame#", "Time", *(cell for name in names for cell in (name, "", ""))],
        ["", "", *(f"{axis}{k}" for k in range(1, len(names) + 1) for axis in "XYZ")],
        [],
    ]
    rows = (
        [str(frame), f"{seconds:.6f}", *(f"{value:.6f}" for value in points.ravel())]
        for frame, seconds, points in zip(motion.frame.tolist(), motion.time.tolist(), positions, strict=True)
    )
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines("\t".join(cells) + "\n" for cells in (*header, *rows))


LENGTHS = ".lengths.csv"
"""The ending of files of lengths."""
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
