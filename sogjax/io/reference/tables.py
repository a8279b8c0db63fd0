"""The tab-separated files of OpenSim: joint angles (.mot, .sto) and markers (.trc)."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.calibration.rig import METRES
from sogjax.io.export.angles import PLACE, unwrapped
from sogjax.io.files import read_text
from sogjax.io.reference.reference_motion import ReferenceMotion, checked

MAX_BYTES = 512 * 2**20


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
