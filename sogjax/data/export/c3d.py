"""C3D, the file format of marker systems: joint centres and extremities, in millimetres, in the motion's own world."""

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from sogjax.data.atomic import atomic_path
from sogjax.data.export.bones import frame_time
from sogjax.data.export.points import marker_points
from sogjax.data.motion import Motion
from sogjax.errors import InputError
from sogjax.model.frames import forward_axis

MILLIMETRES = 1000.0
MAX_FRAMES = 65_535
"""A C3D header counts no further; more frames would be lost silently."""


def write_c3d(path: Path, motion: Motion, up: str = "z", markers: str | None = None) -> None:
    """Write the points of `marker_points`; POINT:X_SCREEN and Y_SCREEN say which axes point forward and up.

    Raises:
        InputError: ezc3d is not installed; no frames, too many or uneven ones; or a path that cannot be written.
    """
    ezc3d = require_ezc3d(str(path))
    rate = 1.0 / frame_time(path, motion)
    if motion.num_frames > MAX_FRAMES:
        raise InputError(
            f"{path}: C3D holds at most {MAX_FRAMES} frames, but the motion has {motion.num_frames}; "
            "write .trc or .csv, or track it in parts"
        )
    names, positions = marker_points(motion, up, up, markers)
    points = np.ones((4, len(names), motion.num_frames))
    points[:3] = MILLIMETRES * positions.transpose(2, 1, 0)
    file = ezc3d.c3d()
    parameters = file["parameters"]["POINT"]
    parameters["RATE"]["value"] = [rate]
    parameters["LABELS"]["value"] = names
    parameters["UNITS"]["value"] = ["mm"]
    file.add_parameter("POINT", "X_SCREEN", _signed(forward_axis(up)))
    file.add_parameter("POINT", "Y_SCREEN", _signed(up))
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
