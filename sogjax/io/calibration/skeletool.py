"""Skeletool's `.calibration`: millimetres, one radial coefficient, one key with its values per line, in any order."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError, counted
from sogjax.io.calibration.rig import MAX_BYTES, METRES, CameraEntry, CameraRig, rig_from_entries
from sogjax.io.files import read_text, write_file

HEADER = "Skeletool Camera Calibration File V1.0"

_COUNTS = {"sensor": 2, "size": 2, "animated": 1, "intrinsic": 16, "extrinsic": 16, "radial": 1}
_MOVING = ("intrinsic", "extrinsic", "radial")


def recognises_skeletool(text: str) -> bool:
    """Whether `text` begins as such a file does."""
    return text.lstrip().startswith(HEADER)


@dataclass
class _Camera:
    """The lines of one camera."""

    name: str
    values: dict[str, np.ndarray] = field(default_factory=dict)
    framed: dict[str, tuple[str, np.ndarray]] = field(default_factory=dict)
    """What held in every frame of an animated camera so far, and the first frame that said so."""


def read_skeletool(path: Path, unit: str = "mm") -> CameraRig:
    """The cameras of a file whose translations are in `unit`; `radial` is taken for OpenCV's k1.

    An animated camera is taken where it stands still.
    """
    lines = read_text(path, MAX_BYTES).splitlines()
    cameras: list[_Camera] = []
    frame = ""
    for number, line in enumerate(lines, 1):
        key, *words = line.split() or [""]
        if key == "name":
            cameras.append(_Camera(" ".join(words)))
            frame = ""
        elif key == "frame" and cameras:
            frame = " ".join(words)
        elif key in _COUNTS and cameras:
            _take(f"{path}: line {number}, camera {cameras[-1].name!r}", cameras[-1], key, words, frame)
        elif key and not line.startswith(HEADER):
            raise InputError(f"{path}: line {number} begins with {key[:60]!r}, not a key of a camera; correct it")
    return rig_from_entries(path, [_entry(path, camera, unit) for camera in cameras])


def write_skeletool(path: Path, rig: CameraRig) -> None:
    """Write `rig`, translations in millimetres.

    Raises:
        InputError: a camera whose distortion has more than one radial coefficient, or of unknown image size.
    """
    pixel = 0.005  # millimetres: the sensor's size is not known here
    lines = [HEADER]
    for name in rig.names:
        camera, (width, height) = rig.camera(name), rig.image_size(name)
        distortion = np.asarray(camera.distortion, float)
        if rig.is_fisheye(name) or distortion[1:].any():
            kind = "k1 k2 k3 k4 of a fisheye lens" if rig.is_fisheye(name) else "k1 k2 p1 p2 k3"
            raise InputError(
                f"{path}: Skeletool's format holds one radial coefficient, but camera {name!r} has {kind} = "
                f"{distortion.round(6).tolist()}; write .toml, or calibrate with k1 alone"
            )
        if name != name.strip() or not name.isprintable():
            raise InputError(f"{path}: the camera name {name!r} does not fit into a line; rename the camera")
        intrinsic, extrinsic = np.eye(4), np.asarray(camera.camera_from_world, float).copy()
        intrinsic[:3, :3] = np.asarray(camera.intrinsics, float)
        extrinsic[:3, 3] /= METRES["mm"]
        lines += [
            f"name          {name}",
            f"  sensor      {_words(np.array([width, height]) * pixel)}",
            f"  size        {width} {height}",
            "  animated    0",
            f"  intrinsic   {_words(intrinsic)}",
            f"  extrinsic   {_words(extrinsic)}",
            f"  radial      {_words(distortion[:1])}",
        ]
    write_file(path, "\n".join(lines) + "\n")


def _take(where: str, camera: _Camera, key: str, words: list[str], frame: str) -> None:
    try:
        values = np.array([float(word) for word in words])
    except ValueError:
        values = np.empty(0)
    if len(values) != _COUNTS[key]:
        raise InputError(
            f"{where}: {key} = {' '.join(words)[:80]!r} is not {counted(_COUNTS[key], 'number')}; correct it"
        )
    if frame and key in _MOVING:
        first, before = camera.framed.setdefault(key, (frame, values))
        if not np.array_equal(before, values, equal_nan=True):
            raise InputError(
                f"{where}: its {key} of frame {frame} is not that of frame {first}; cameras that move cannot be used, "
                "so calibrate them fixed"
            )
    camera.values[key] = values


def _entry(path: Path, camera: _Camera, unit: str) -> CameraEntry:
    where = f"{path}: camera {camera.name!r}"
    if not camera.name:
        raise InputError(f"{path}: a camera has no name; write one after `name`")
    for key in ("size", "intrinsic", "extrinsic"):
        if key not in camera.values:
            raise InputError(f"{where}: has no {key!r}; add it, or calibrate the camera again")
    intrinsic, extrinsic = (_matrix(where, camera, key) for key in ("intrinsic", "extrinsic"))
    size = camera.values["size"]
    if not (np.isfinite(size).all() and (size == np.round(size)).all()):
        raise InputError(f"{where}: size = {size.tolist()} is not two whole numbers; give width and height in pixels")
    return CameraEntry(
        name=camera.name,
        intrinsics=intrinsic[:3, :3],
        rotation=extrinsic[:3, :3],
        translation=extrinsic[:3, 3] * METRES[unit],
        distortion=np.concatenate([camera.values.get("radial", np.zeros(1)), np.zeros(4)]),
        size=(int(size[0]), int(size[1])),
    )


def _matrix(where: str, camera: _Camera, key: str) -> Float[np.ndarray, "4 4"]:
    matrix = camera.values[key].reshape(4, 4)
    if matrix[3].tolist() != [0, 0, 0, 1]:
        raise InputError(f"{where}: the last row of {key} is {matrix[3].tolist()}, not 0 0 0 1; correct it")
    if key == "intrinsic" and matrix[:3, 3].any():
        raise InputError(f"{where}: the last column of intrinsic is {matrix[:, 3].tolist()}, not 0 0 0 1; correct it")
    return matrix


def _words(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in np.asarray(values, float).ravel())
