"""Calibrations that are tables of numbers: the TOML of Anipose, Pose2Sim and FreeMoCap, the JSON of CMU Panoptic."""

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from sogjax.errors import InputError
from sogjax.io.calibration.rig import MAX_BYTES, METRES, CameraEntry, CameraRig, rig_from_entries
from sogjax.io.files import read_parsed, write_file

Table = Mapping[str, Any]


def recognises_toml(text: str) -> bool:
    """Whether `text` looks like a table of cameras."""
    table = re.search(r"^[ \t]*\[[^\[\]\n]+\][ \t\r]*(#.*)?$", text, re.M)
    return bool(table and re.search(r"^[ \t]*matrix[ \t]*=", text, re.M))


def read_toml(path: Path, unit: str = "m") -> CameraRig:
    """The cameras of a TOML file, one table per camera, whose translations are in `unit`.

    Tables without a matrix, rotation and translation (`[metadata]`) are ignored.
    """
    tables = read_parsed(path, "TOML", tomllib.loads, "correct or export it again", MAX_BYTES)
    cameras = {
        key: table
        for key, table in tables.items()
        if isinstance(table, dict) and key != "metadata" and table.keys() & {"matrix", "rotation", "translation"}
    }
    return rig_from_entries(path, [_toml_entry(path, key, table, unit) for key, table in cameras.items()])


def _toml_entry(path: Path, key: str, table: Table, unit: str) -> CameraEntry:
    name = table.get("name", key)
    where = f"{path}: camera {name!r}"
    if not isinstance(name, str) or not name:
        raise InputError(f"{path}: the name {name!r} of [{key}] is not text; put it in quotes")
    fisheye = table.get("fisheye", False)
    if not isinstance(fisheye, bool):
        raise InputError(f"{where}: fisheye = {fisheye!r} is neither true nor false; correct it")
    rotation = _numbers(where, table, "rotation", (3,))
    if not np.isfinite(rotation).all():
        raise InputError(f"{where}: rotation = {table['rotation']} is not finite; give a Rodrigues vector")
    return CameraEntry(
        name=name,
        intrinsics=_numbers(where, table, "matrix", (3, 3)),
        rotation=Rotation.from_rotvec(rotation).as_matrix(),
        translation=_numbers(where, table, "translation", (3,)) * METRES[unit],
        distortion=_numbers(where, table, "distortions", (None,)),
        size=_image_size(where, table, "size"),
        fisheye=fisheye,
    )


def write_toml(path: Path, rig: CameraRig) -> None:
    """Write `rig` as TOML, translations in metres.

    Raises:
        InputError: the size of a camera's images is not known.
    """
    tables = []
    for index, name in enumerate(rig.names):
        camera, (width, height), fisheye = rig.camera(name), rig.image_size(name), rig.is_fisheye(name)
        pose, distortion = np.asarray(camera.camera_from_world, float), np.asarray(camera.distortion, float).tolist()
        tables.append(
            f"[cam_{index:02d}]\n"
            f"name = {_quoted(name)}\n"
            f"size = [{width}, {height}]\n"
            f"matrix = {np.asarray(camera.intrinsics, float).tolist()}\n"
            f"distortions = {distortion[:4] if fisheye else distortion}\n"
            f"rotation = {Rotation.from_matrix(pose[:3, :3]).as_rotvec().tolist()}\n"
            f"translation = {pose[:3, 3].tolist()}\n"
            f"fisheye = {'true' if fisheye else 'false'}\n"
        )
    write_file(path, "\n".join(tables))


def _quoted(name: str) -> str:
    escaped = name.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in escaped) + '"'


def recognises_panoptic(text: str) -> bool:
    """Whether `text` is JSON that has a list of cameras."""
    return text.lstrip().startswith("{") and '"cameras"' in text


def read_panoptic(path: Path, unit: str = "cm") -> CameraRig:
    """The cameras of a JSON file, a list `cameras` with K, R, t, distCoef and resolution; translations in `unit`."""
    content = read_parsed(path, "JSON", json.loads, "export it again", MAX_BYTES)
    cameras = content.get("cameras") if isinstance(content, dict) else None
    if not isinstance(cameras, list) or not all(isinstance(camera, dict) for camera in cameras):
        raise InputError(f"{path}: has no list `cameras` of objects; export it again")
    return rig_from_entries(path, [_panoptic_entry(path, index, camera, unit) for index, camera in enumerate(cameras)])


def _panoptic_entry(path: Path, index: int, camera: Table, unit: str) -> CameraEntry:
    name, translation = camera.get("name"), camera.get("t")
    if not isinstance(name, str) or not name:
        raise InputError(f"{path}: cameras[{index}] has no name; add one (text)")
    where = f"{path}: camera {name!r}"
    is_column = isinstance(translation, list) and bool(translation) and isinstance(translation[0], list)
    return CameraEntry(
        name=name,
        intrinsics=_numbers(where, camera, "K", (3, 3)),
        rotation=_numbers(where, camera, "R", (3, 3)),
        translation=_numbers(where, camera, "t", (3, 1) if is_column else (3,)).reshape(3) * METRES[unit],
        distortion=_numbers(where, camera, "distCoef", (None,)) if "distCoef" in camera else np.zeros(5),
        size=_image_size(where, camera, "resolution") if "resolution" in camera else None,
    )


def _numbers(where: str, table: Table, key: str, shape: tuple[int | None, ...]) -> Float[np.ndarray, "..."]:
    """The numbers under `key`, of `shape` (None: any length); NaN and infinity pass."""
    if key not in table:
        raise InputError(f"{where}: has no {key!r}; add it, or calibrate the camera again")
    try:
        values = np.array(table[key], float)
    except (TypeError, ValueError, OverflowError):
        values = np.empty(())
    fits = values.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, values.shape, strict=True))
    if not fits:
        wanted = " x ".join("n" if n is None else str(n) for n in shape)
        raise InputError(f"{where}: {key} = {_short(table[key])} is not {wanted} numbers; correct it")
    return values


def _image_size(where: str, table: Table, key: str) -> tuple[int, int]:
    size = _numbers(where, table, key, (2,))
    if not (np.isfinite(size).all() and (size == np.round(size)).all()):
        raise InputError(f"{where}: {key} = {table[key]} is not two whole numbers; give width and height in pixels")
    return int(size[0]), int(size[1])


def _short(value: object) -> str:
    try:
        text = " ".join(repr(value).split())
    except (ValueError, RecursionError):  # a number of thousands of digits, a list nested as deep
        text = f"a {type(value).__name__}"
    return text if len(text) <= 200 else f"{text[:197]}..."
