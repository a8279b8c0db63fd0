"""Qualisys' `.qca.txt`, XML: millimetres, intrinsics in 1/64 of a pixel, the camera's centre in the world.

The file's camera looks along -z with y up; half a turn about x makes OpenCV's axes of it. Distortion coefficients
are those of OpenCV and have no unit. Cameras are named by their serial numbers.
"""

import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.calibration.rig import LARGEST, MAX_BYTES, METRES, CameraEntry, CameraRig, rig_from_entries
from sogjax.io.files import read_parsed, read_text

_SUBPIXELS = 64.0

_DISTORTION = (
    "radialDistortion1",
    "radialDistortion2",
    "tangentalDistortion1",
    "tangentalDistortion2",
    "radialDistortion3",
)


def recognises_qualisys(text: str) -> bool:
    """Whether `text` is XML with cameras of Qualisys."""
    return text.lstrip().startswith("<") and "<camera" in text and "focalLengthU" in text


def read_qualisys(path: Path, unit: str = "mm") -> CameraRig:
    """The cameras of a file whose lengths are in `unit`."""
    text = read_text(path, MAX_BYTES)
    declared = re.search(r"<!\s*(DOCTYPE|ENTITY)", text, re.I)
    if declared:
        raise InputError(f"{path}: holds <!{declared[1]}, which is not read for safety; take it out")
    root = read_parsed(path, "XML", ElementTree.fromstring, "export it again", MAX_BYTES)
    return rig_from_entries(path, [_entry(path, camera, unit) for camera in root.iter("camera")])


def _entry(path: Path, camera: ElementTree.Element, unit: str) -> CameraEntry:
    name = camera.get("serial", "")
    where = f"{path}: camera {name!r}"
    if not name.strip():
        raise InputError(f"{path}: a camera has no serial number, by which it is named; add serial=")
    intrinsic, transform = _part(where, camera, "intrinsic"), _part(where, camera, "transform")
    value = lambda key: _number(where, intrinsic, key)
    if abs(_number(where, intrinsic, "skew", 0.0)) > 0:
        raise InputError(f"{where}: its skew is {intrinsic.get('skew')}; calibrate it without skew")
    left, top, size = _picture(where, camera, intrinsic)
    matrix = np.diag([value("focalLengthU") / _SUBPIXELS, value("focalLengthV") / _SUBPIXELS, 1.0])
    matrix[:2, 2] = value("centerPointU") / _SUBPIXELS - left, value("centerPointV") / _SUBPIXELS - top
    turn = np.array([[_number(where, transform, f"r{row}{column}") for column in (1, 2, 3)] for row in (1, 2, 3)])
    centre = np.array([_number(where, transform, axis) for axis in "xyz"]) * METRES[unit]
    rotation = _tidy(np.diag([1.0, -1.0, -1.0]) @ turn)
    return CameraEntry(
        name=name,
        intrinsics=matrix,
        rotation=rotation,
        translation=-rotation @ centre,
        distortion=np.array([_number(where, intrinsic, key, 0.0) for key in _DISTORTION]),
        size=size,
    )


def _picture(
    where: str, camera: ElementTree.Element, intrinsic: ElementTree.Element
) -> tuple[float, float, tuple[int, int] | None]:
    """Left and top border of what is recorded of the sensor, and its size in pixels."""
    part = camera.find("fov_video")
    if part is not None:
        left, top, right, bottom = (_number(where, part, side) for side in ("left", "top", "right", "bottom"))
        return left, top, (_whole(where, right - left + 1), _whole(where, bottom - top + 1))
    if intrinsic.get("sensorMaxU") is None or intrinsic.get("sensorMaxV") is None:
        return 0.0, 0.0, None
    sides = [(_number(where, intrinsic, f"sensorMax{side}") + 1) / _SUBPIXELS for side in "UV"]
    return 0.0, 0.0, (_whole(where, sides[0]), _whole(where, sides[1]))


def _whole(where: str, side: float) -> int:
    if not abs(side) < 1e9 or side != round(side):
        raise InputError(f"{where}: its pictures are {side} pixels wide or high, not a whole number; correct fov_video")
    return int(side)


def _part(where: str, camera: ElementTree.Element, tag: str) -> ElementTree.Element:
    part = camera.find(tag)
    if part is None:
        raise InputError(f"{where}: has no <{tag}>; calibrate the camera again")
    return part


def _number(where: str, element: ElementTree.Element, key: str, otherwise: float | None = None) -> float:
    text = element.get(key)
    if text is None and otherwise is not None:
        return otherwise
    try:
        value = float(text or "")
    except ValueError:
        value = float("nan")
    if not abs(value) <= LARGEST:
        raise InputError(f"{where}: {key} = {(text or '')[:60]!r} is not a number below 1e12; correct it")
    return value


def _tidy(rotation: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """The rotation next to a matrix of six digits, so that the centre stays where the file says; others as they are."""
    if not np.isfinite(rotation).all():
        return rotation
    u, scales, vt = np.linalg.svd(rotation)
    return u @ vt if np.abs(scales - 1).max() < 1e-3 else rotation
