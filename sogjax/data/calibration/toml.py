"""The calibration TOML of Anipose, Pose2Sim and FreeMoCap: a table a camera."""

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from sogjax.data.atomic import atomic_path
from sogjax.data.calibration.rig import METRES_PER_UNIT, CameraEntry, CameraRig, rig_from_entries
from sogjax.errors import InputError

_CAMERA_KEYS = ("matrix", "rotation", "translation")


def recognises_toml(text: str) -> bool:
    """Whether `text` looks like a table of cameras."""
    return bool(re.search(r"^\s*\[[^\[\]]+\]\s*(#.*)?$", text, re.M) and re.search(r"^\s*matrix\s*=", text, re.M))


def read_toml(path: Path, unit: str = "m") -> CameraRig:
    """The cameras of a TOML file whose translations are in `unit`.

    Tables without a matrix, rotation and translation (`[metadata]`) are ignored.

    Raises:
        InputError: no TOML, a missing key, a wrong value, or a fisheye camera.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise InputError(f"{path}: is not readable as TOML ({error}); correct or export it again") from error
    cameras = {
        key: table
        for key, table in tables.items()
        if isinstance(table, dict) and key != "metadata" and any(k in table for k in _CAMERA_KEYS)
    }
    return rig_from_entries(path, [_entry(path, key, table, unit) for key, table in cameras.items()])


def write_toml(path: Path, rig: CameraRig) -> None:
    """Write `rig` as TOML, translations in metres."""
    cameras = rig.cameras
    tables = []
    for index, name in enumerate(rig.names):
        pose = np.asarray(cameras.camera_from_world, float)[index]
        width, height = rig.image_size(name)
        tables.append(
            f"[cam_{index:02d}]\n"
            f"name = {_quoted(name)}\n"
            f"size = [{width}, {height}]\n"
            f"matrix = {np.asarray(cameras.intrinsics, float)[index].tolist()}\n"
            f"distortions = {np.asarray(cameras.distortion, float)[index].tolist()}\n"
            f"rotation = {Rotation.from_matrix(pose[:3, :3]).as_rotvec().tolist()}\n"
            f"translation = {pose[:3, 3].tolist()}\n"
            "fisheye = false\n"
        )
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(tables), encoding="utf-8")


def _entry(path: Path, key: str, table: dict[str, Any], unit: str) -> CameraEntry:
    name = table.get("name", key)
    where = f"{path}: camera {name!r}"
    if not isinstance(name, str) or not name:
        raise InputError(f"{path}: the name {name!r} of [{key}] is not text; put it in quotes")
    if table.get("fisheye", False):
        raise InputError(f"{where}: fisheye = true is not supported yet; use a camera with the pinhole model")
    size = _numbers(where, table, "size", (2,))
    if not (np.isfinite(size).all() and (size == np.round(size)).all()):
        raise InputError(f"{where}: size = {table['size']} is not two whole numbers; give width and height in pixels")
    rotation = _numbers(where, table, "rotation", (3,))
    if not np.isfinite(rotation).all():
        raise InputError(f"{where}: rotation = {table['rotation']} is not finite; give a Rodrigues vector")
    return CameraEntry(
        name=name,
        intrinsics=_numbers(where, table, "matrix", (3, 3)),
        rotation=Rotation.from_rotvec(rotation).as_matrix(),
        translation=_numbers(where, table, "translation", (3,)) * METRES_PER_UNIT[unit],
        distortion=_numbers(where, table, "distortions", (None,)),
        size=(int(size[0]), int(size[1])),
    )


def _numbers(where: str, table: dict[str, Any], key: str, shape: tuple[int | None, ...]) -> Float[np.ndarray, "..."]:
    if key not in table:
        raise InputError(f"{where}: has no {key!r}; add it, or calibrate the camera again")
    try:
        values = np.array(table[key], float)
    except (TypeError, ValueError):
        values = np.empty(())
    fits = values.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, values.shape, strict=True))
    if not fits:
        wanted = " x ".join("n" if n is None else str(n) for n in shape)
        raise InputError(f"{where}: {key} = {table[key]!r} is not {wanted} numbers; correct it")
    return values


def _quoted(name: str) -> str:
    escaped = name.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in escaped) + '"'
