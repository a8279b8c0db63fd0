"""Other systems' motions: readers of their files, chosen by the ending."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from sogjax.errors import InputError
from sogjax.io.bvh_bones import MAX_BYTES, BvhBone, read_bones
from sogjax.io.calibration.rig import METRES
from sogjax.io.export.angles import PLACE, unwrapped
from sogjax.io.export.bones import world_turn
from sogjax.io.export.points import require_ezc3d
from sogjax.io.files import read_text
from sogjax.io.reference.reference_motion import ReferenceMotion, checked


def read_mot(path: Path) -> ReferenceMotion:
    """Joint angles in degrees, by the last word of their names, and the place of the pelvis as the point `pelvis`.

    Raises:
        InputError: the file is none of OpenSim's, or damaged.
    """
    lines = read_text(path, MAX_BYTES).splitlines()
    end = next((k for k, line in enumerate(lines) if line.strip().lower() == "endheader"), None)
    if end is None or end + 2 >= len(lines):
        raise InputError(f"{path}: has no 'endheader' with rows after it; is this a motion file of OpenSim?")
    header = {key.strip().lower(): value.strip() for key, _, value in (line.partition("=") for line in lines[:end])}
    in_degrees = header.get("indegrees", "yes").lower() == "yes"
    names = [_last_word(name) for name in lines[end + 1].split()]
    if names[:1] != ["time"]:
        raise InputError(f"{path}: its first column is {names[:1]}, not time; is this a motion file of OpenSim?")
    table = _numbers(path, [line.split() for line in lines[end + 2 :]], len(names), end + 3)
    columns = dict(zip(names[1:], table[:, 1:].T, strict=True))
    points = {}
    if all(name in columns for name in PLACE):
        points["pelvis"] = np.stack([columns[name] for name in PLACE], axis=-1)
    turns = {name: values for name, values in columns.items() if not name.endswith(("_tx", "_ty", "_tz"))}
    angles = {name: unwrapped(values if in_degrees else np.degrees(values)) for name, values in turns.items()}
    time = table[:, 0]
    return checked(ReferenceMotion(path, _rate(time), time, points, angles))


def read_trc(path: Path) -> ReferenceMotion:
    """Markers, whose vertical is y, as in all files of this format that OpenSim reads.

    Raises:
        InputError: the file is no TRC, or damaged.
    """
    lines = read_text(path, MAX_BYTES).splitlines()
    keys = lines[1].split() if len(lines) > 5 else []
    facts = dict(zip(keys, lines[2].split(), strict=False)) if keys else {}
    if "Units" not in facts or not lines[3].startswith("Frame#"):
        raise InputError(f"{path}: has not the five lines of header of a TRC; is this a marker file of OpenSim?")
    unit = METRES.get(facts["Units"].lower())
    if unit is None:
        raise InputError(f"{path}: Units is {facts['Units']!r}; it should be one of {', '.join(METRES)}")
    names = [name.strip() for name in lines[3].split("\t")[2:] if name.strip()]
    cells = [line.split("\t") for line in lines[5:] if line.strip()]
    width = 2 + 3 * len(names)
    table = _numbers(path, [(row + [""] * width)[:width] for row in cells], width, 6)
    points = {name: unit * table[:, 2 + 3 * k : 5 + 3 * k] for k, name in enumerate(names)}
    return checked(ReferenceMotion(path, _rate(table[:, 1]), table[:, 1], points))


def _last_word(name: str) -> str:
    """`/jointset/knee_r/knee_angle_r/value` is `knee_angle_r`."""
    return name.removesuffix("/value").rsplit("/", 1)[-1]


def _numbers(path: Path, rows: list[list[str]], width: int, first_line: int) -> Float[np.ndarray, "row {width}"]:
    """The rows as numbers; an empty cell is NaN."""
    values = []
    for number, row in enumerate(rows, first_line):
        if not row:
            continue
        try:
            values.append([float(cell) if cell.strip() else np.nan for cell in row])
        except ValueError:
            raise InputError(f"{path}: line {number} holds something that is no number; export it again") from None
        if len(row) != width:
            raise InputError(f"{path}: line {number} has {len(row)} columns of {width}; is the file whole?")
    return np.array(values, float).reshape(-1, width)


def _rate(time: Float[np.ndarray, "frame"]) -> float:
    """Frames per second; times are rounded in the files, so all of them are taken together."""
    span = float(time[-1] - time[0]) if len(time) > 1 else 0.0
    return (len(time) - 1) / span if span > 0 else 1.0


_LARGEST_PERSON = 4.0
"""A skeleton that is more across at rest is not in metres but in centimetres."""


def read_bvh(path: Path) -> ReferenceMotion:
    """World positions of the joints; y is up, lengths are metres, or centimetres where a body is larger than 4 m.

    Raises:
        InputError: the file is no BVH, or damaged.
    """
    joints = read_bones(path)
    rest = read_text(path, MAX_BYTES).partition("\nMOTION")[2]
    numbers = re.match(r"\s*Frames:\s*(\d+)\s*Frame Time:\s*(\S+)", rest)
    if numbers is None or not joints:
        raise InputError(f"{path}: has no ROOT, 'Frames:' and 'Frame Time:'; is this a whole BVH?")
    width = sum(len(joint.channels) for joint in joints)
    try:
        step = float(numbers[2])
        values = np.array(rest[numbers.end() :].split(), float).reshape(int(numbers[1]), width)
    except ValueError:
        raise InputError(f"{path}: does not hold {numbers[1]} rows of {width} numbers; is the file whole?") from None
    if not step > 0:
        raise InputError(f"{path}: Frame Time is {numbers[2]}; it should be seconds, more than 0")
    turns, positions = _frames(joints, values)
    unit = 0.01 if _across(joints) > _LARGEST_PERSON else 1.0
    points = {joint.name: unit * positions[:, k] for k, joint in enumerate(joints)}
    notes = ("lengths were taken for centimetres",) if unit != 1.0 else ()
    return checked(ReferenceMotion(path, 1.0 / step, step * np.arange(len(values)), points, turns=turns, notes=notes))


def _frames(
    joints: Sequence[BvhBone], values: Float[np.ndarray, "frame channel"]
) -> tuple[dict[str, Float[np.ndarray, "frame 3 3"]], Float[np.ndarray, "frame joint 3"]]:
    """World rotations by joint and positions, by forward kinematics.

    Channels of position take the place of the offset, those of rotation act in their order.
    """
    turns: list[Float[np.ndarray, "frame 3 3"]] = []
    places: list[Float[np.ndarray, "frame 3"]] = []
    first = 0
    for joint in joints:
        own = values[:, first : first + len(joint.channels)]
        first += len(joint.channels)
        offset = np.tile(joint.offset, (len(values), 1))
        axes = [k for k, name in enumerate(joint.channels) if name.endswith("rotation")]
        for k, name in enumerate(joint.channels):
            if name.endswith("position"):
                offset[:, "XYZ".index(name[0])] = own[:, k]
        turn = np.tile(np.eye(3), (len(values), 1, 1))
        if axes:
            order = "".join(joint.channels[k][0] for k in axes)
            turn = Rotation.from_euler(order, own[:, axes], degrees=True).as_matrix()
        if joint.parent >= 0:
            above = turns[joint.parent]
            offset = places[joint.parent] + np.einsum("tij,tj->ti", above, offset)
            turn = above @ turn
        turns.append(turn)
        places.append(offset)
    names = [joint.name for joint in joints]
    return dict(zip(names, turns, strict=True)), np.stack(places, axis=1)


def _across(joints: Sequence[BvhBone]) -> float:
    """How far apart a skeleton's joints are at most, in the file's unit, without turning any."""
    places: list[np.ndarray] = []
    for joint in joints:
        places.append((places[joint.parent] + joint.offset) if joint.parent >= 0 else np.zeros(3))
    return float(np.ptp(np.stack(places), axis=0).max())


def read_c3d(path: Path) -> ReferenceMotion:
    """Points of the file; its vertical is what POINT:Y_SCREEN says, else z.

    Raises:
        InputError: ezc3d is not installed, the file is no C3D, or its lengths have a unit that is not known.
    """
    ezc3d = require_ezc3d(str(path))
    try:
        file = ezc3d.c3d(str(path))
    except (OSError, RuntimeError, ValueError, IndexError) as error:
        raise InputError(f"{path}: is not readable as C3D ({' '.join(str(error).split())}); export it again") from error
    point = file["parameters"]["POINT"]
    written = str(_first(point, "UNITS", "mm")).strip().lower() or "mm"
    if written not in METRES:
        raise InputError(f"{path}: POINT:UNITS is {written!r}; it should be one of {', '.join(METRES)}")
    screen = str(_first(point, "Y_SCREEN", "")).strip().lower()
    up = screen.removeprefix("+") if screen.lstrip("+-") in ("x", "y", "z") else "z"
    rate = float(_first(point, "RATE", 0.0))
    if rate <= 0:
        raise InputError(f"{path}: POINT:RATE is {rate:g}, not a frame rate; correct it")
    first = int(file["header"]["points"]["first_frame"])
    points = METRES[written] * np.asarray(file["data"]["points"], float)[:3].transpose(2, 1, 0)
    missing = np.asarray(file["data"]["meta_points"]["residuals"], float)[0].T < 0
    points[missing] = np.nan
    points = points @ world_turn(up, "y").T
    names = [str(name).strip().rsplit(":", 1)[-1] for name in point["LABELS"]["value"]]
    time = (first + np.arange(len(points))) / rate
    notes = () if screen else ("the file does not say its vertical: z was taken",)
    by_name = {name: points[:, k] for k, name in enumerate(names) if k < points.shape[1]}
    return checked(ReferenceMotion(path, rate, time, by_name, notes=notes))


def _first(group: Any, key: str, default: Any) -> Any:
    """The first value of a parameter."""
    values = group[key]["value"] if key in group else []
    return values[0] if len(values) else default


READERS: dict[str, Callable[[Path], ReferenceMotion]] = {
    **{".mot": read_mot, ".sto": read_mot, ".trc": read_trc, ".c3d": read_c3d, ".bvh": read_bvh},
}
"""What reads another system's motion, by the file's ending."""


def is_reference(path: Path) -> bool:
    """Whether a file is another system's motion, by its ending."""
    return path.suffix.lower() in READERS


def load_reference(path: Path) -> ReferenceMotion:
    """The motion of another system.

    Raises:
        InputError: the file is missing, of another kind than its ending says, or damaged.
    """
    return READERS[path.suffix.lower()](path)
