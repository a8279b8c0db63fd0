"""Markers of a C3D file, read by ezc3d."""

from pathlib import Path
from typing import Any

import numpy as np

from sogjax.errors import InputError
from sogjax.io.calibration.rig import METRES
from sogjax.io.export.bones import world_turn
from sogjax.io.export.points import require_ezc3d
from sogjax.io.reference.reference_motion import ReferenceMotion, checked


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
