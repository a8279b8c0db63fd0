"""JSON as the CMU Panoptic data set has it: a list `cameras` with K, R, t, distCoef and resolution; centimetres."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from sogjax.errors import InputError
from sogjax.io.calibration.rig import METRES, CameraEntry, CameraRig, image_size, numbers, rig_from_entries


def recognises_panoptic(text: str) -> bool:
    """Whether `text` is JSON that has a list of cameras."""
    return text.lstrip().startswith("{") and '"cameras"' in text


def read_panoptic(path: Path, unit: str = "cm") -> CameraRig:
    """The cameras of a file whose translations are in `unit`.

    Raises:
        InputError: no JSON, a missing key, or a wrong value.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not readable as JSON ({error}); export it again") from error
    cameras = content.get("cameras") if isinstance(content, dict) else None
    if not isinstance(cameras, list) or not all(isinstance(camera, dict) for camera in cameras):
        raise InputError(f"{path}: has no list `cameras` of objects; export it again")
    return rig_from_entries(path, [_entry(path, index, camera, unit) for index, camera in enumerate(cameras)])


def _entry(path: Path, index: int, camera: dict[str, Any], unit: str) -> CameraEntry:
    name = camera.get("name")
    if not isinstance(name, str) or not name:
        raise InputError(f"{path}: cameras[{index}] has no name; add one (text)")
    where = f"{path}: camera {name!r}"
    shape = (3, 1) if _is_column(camera.get("t")) else (3,)
    return CameraEntry(
        name=name,
        intrinsics=numbers(where, camera, "K", (3, 3)),
        rotation=numbers(where, camera, "R", (3, 3)),
        translation=numbers(where, camera, "t", shape).reshape(3) * METRES[unit],
        distortion=numbers(where, camera, "distCoef", (None,)) if "distCoef" in camera else np.zeros(5),
        size=image_size(where, camera, "resolution") if "resolution" in camera else None,
    )


def _is_column(value: object) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], list)
