"""The calibration TOML of Anipose, Pose2Sim and FreeMoCap: one table per camera."""

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from sogjax.errors import InputError
from sogjax.io.calibration.rig import METRES, CameraEntry, CameraRig, image_size, numbers, rig_from_entries
from sogjax.io.files import atomic_path

_CAMERA_KEYS = ("matrix", "rotation", "translation")


def recognises_toml(text: str) -> bool:
    """Whether `text` looks like a table of cameras."""
    table = re.search(r"^[ \t]*\[[^\[\]\n]+\][ \t\r]*(#.*)?$", text, re.M)
    return bool(table and re.search(r"^[ \t]*matrix[ \t]*=", text, re.M))


def read_toml(path: Path, unit: str = "m") -> CameraRig:
    """The cameras of a TOML file whose translations are in `unit`.

    Tables without a matrix, rotation and translation (`[metadata]`) are ignored.

    Raises:
        InputError: no TOML, a missing key, or a wrong value.
    """
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not readable as TOML ({error}); correct or export it again") from error
    cameras = {
        key: table
        for key, table in tables.items()
        if isinstance(table, dict) and key != "metadata" and any(k in table for k in _CAMERA_KEYS)
    }
    return rig_from_entries(path, [_entry(path, key, table, unit) for key, table in cameras.items()])


def write_toml(path: Path, rig: CameraRig) -> None:
    """Write `rig` as TOML, translations in metres.

    Raises:
        InputError: the size of a camera's images is not known.
    """
    cameras = rig.cameras
    tables = []
    for index, name in enumerate(rig.names):
        pose = np.asarray(cameras.camera_from_world, float)[index]
        width, height = rig.image_size(name)
        distortion, fisheye = np.asarray(cameras.distortion, float)[index].tolist(), rig.is_fisheye(name)
        tables.append(
            f"[cam_{index:02d}]\n"
            f"name = {_quoted(name)}\n"
            f"size = [{width}, {height}]\n"
            f"matrix = {np.asarray(cameras.intrinsics, float)[index].tolist()}\n"
            f"distortions = {distortion[:4] if fisheye else distortion}\n"
            f"rotation = {Rotation.from_matrix(pose[:3, :3]).as_rotvec().tolist()}\n"
            f"translation = {pose[:3, 3].tolist()}\n"
            f"fisheye = {'true' if fisheye else 'false'}\n"
        )
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(tables), encoding="utf-8")


def _entry(path: Path, key: str, table: dict[str, Any], unit: str) -> CameraEntry:
    name = table.get("name", key)
    where = f"{path}: camera {name!r}"
    if not isinstance(name, str) or not name:
        raise InputError(f"{path}: the name {name!r} of [{key}] is not text; put it in quotes")
    fisheye = table.get("fisheye", False)
    if not isinstance(fisheye, bool):
        raise InputError(f"{where}: fisheye = {fisheye!r} is neither true nor false; correct it")
    rotation = numbers(where, table, "rotation", (3,))
    if not np.isfinite(rotation).all():
        raise InputError(f"{where}: rotation = {table['rotation']} is not finite; give a Rodrigues vector")
    return CameraEntry(
        name=name,
        intrinsics=numbers(where, table, "matrix", (3, 3)),
        rotation=Rotation.from_rotvec(rotation).as_matrix(),
        translation=numbers(where, table, "translation", (3,)) * METRES[unit],
        distortion=numbers(where, table, "distortions", (None,)),
        size=image_size(where, table, "size"),
        fisheye=fisheye,
    )


def _quoted(name: str) -> str:
    escaped = name.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in escaped) + '"'
