"""OpenCV's YAML as EasyMocap writes it: `intri.yml` (K_NAME, dist_NAME), `extri.yml` (R_NAME or Rot_NAME, T_NAME).

Either file stands for the pair. Where a file has no `H_NAME` and `W_NAME`, the sizes of the images are left open.
"""

import re
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from sogjax.errors import InputError, counted
from sogjax.io.calibration.rig import METRES, CameraEntry, CameraRig, rig_from_entries
from sogjax.io.files import read_bounded

_INTRINSIC = re.compile(r"^K_.+:", re.M)
_EXTRINSIC = re.compile(r"^(R|Rot|T)_.+:", re.M)

Content = Mapping[str, object]


def recognises_easymocap(text: str) -> bool:
    """Whether `text` is one half of such a pair, or both in one."""
    return text.startswith("%YAML") and bool(_INTRINSIC.search(text) or _EXTRINSIC.search(text))


def read_easymocap(path: Path, unit: str = "m") -> CameraRig:
    """The cameras of a pair of files, given by either one; translations in `unit`."""
    text = _text(path)
    intrinsic, extrinsic = bool(_INTRINSIC.search(text)), bool(_EXTRINSIC.search(text))
    content = _content(path, text)
    if not (intrinsic and extrinsic):
        other = other_half(path)
        if other is None:
            missing = "extri.yml (R_NAME or Rot_NAME, T_NAME)" if intrinsic else "intri.yml (K_NAME, dist_NAME)"
            raise InputError(f"{path}: is half of a calibration; put the other half beside it, {missing}")
        content = {**_content(other, _text(other)), **content}
    names = [key.removeprefix("K_") for key in content if key.startswith("K_")]
    placed = [key.removeprefix("T_") for key in content if key.startswith("T_")]
    for name in placed:
        if name not in names:
            raise InputError(f"{path}: camera {name!r} has T_{name}, but no K_{name}; calibrate it, or take it out")
    return rig_from_entries(path, [_entry(path, name, content, unit) for name in names])


def other_half(path: Path) -> Path | None:
    """The file with the other half of a pair: that of the fitting name, else the only one in the folder."""
    text = _text(path)
    intrinsic, extrinsic = bool(_INTRINSIC.search(text)), bool(_EXTRINSIC.search(text))
    if intrinsic and extrinsic:
        return None
    wanted, unwanted = (_EXTRINSIC, _INTRINSIC) if intrinsic else (_INTRINSIC, _EXTRINSIC)
    swapped = ("intri", "extri") if intrinsic else ("extri", "intri")
    beside = [path.with_name(path.name.replace(*swapped)), *sorted(path.parent.iterdir())]
    halves = []
    for file in beside:
        if file != path and file.suffix.lower() in (".yml", ".yaml") and file.is_file():
            try:
                head = _text(file)
            except InputError:
                continue
            if recognises_easymocap(head) and wanted.search(head) and not unwanted.search(head):
                if file.name == beside[0].name:
                    return file
                halves.append(file)
    return halves[0] if len(halves) == 1 else None


def _entry(path: Path, name: str, content: Content, unit: str) -> CameraEntry:
    where = f"{path}: camera {name!r}"
    if f"Rot_{name}" in content:
        rotation = _matrix(where, content, f"Rot_{name}", 9).reshape(3, 3)
    else:
        turn = _matrix(where, content, f"R_{name}", 3)
        if not np.isfinite(turn).all():
            raise InputError(f"{where}: R_{name} = {turn.tolist()} is not finite; give a Rodrigues vector")
        rotation = Rotation.from_rotvec(turn).as_matrix()
    distortion = _matrix(where, content, f"dist_{name}") if f"dist_{name}" in content else np.zeros(5)
    return CameraEntry(
        name=name,
        intrinsics=_matrix(where, content, f"K_{name}", 9).reshape(3, 3),
        rotation=rotation,
        translation=_matrix(where, content, f"T_{name}", 3) * METRES[unit],
        distortion=distortion,
        size=_size(where, name, content),
    )


def _size(where: str, name: str, content: Content) -> tuple[int, int] | None:
    size = [content.get(f"{side}_{name}") for side in "WH"]
    if size == [None, None]:
        return None
    width, height = size
    if not (isinstance(width, float) and isinstance(height, float) and width.is_integer() and height.is_integer()):
        raise InputError(f"{where}: W_{name}, H_{name} = {size} are not two whole numbers; give the size in pixels")
    return int(width), int(height)


def _matrix(where: str, content: Content, key: str, count: int | None = None) -> np.ndarray:
    if key not in content:
        raise InputError(f"{where}: has no {key}; add it, or calibrate the camera again")
    values = content[key]
    if not isinstance(values, np.ndarray) or (count is not None and len(values) != count):
        found = counted(len(values), "number") if isinstance(values, np.ndarray) else "no matrix of numbers"
        raise InputError(f"{where}: {key} holds {found}; give {count or 'a row of'} numbers (!!opencv-matrix)")
    return values


def _text(path: Path) -> str:
    return read_bounded(path, 4 * 2**20).decode("utf-8-sig", errors="replace").replace("\r\n", "\n")


def _content(path: Path, text: str) -> Content:
    """The content by key: a matrix as a row of numbers, or a number; all else is None."""
    if _too_deep(text) or "\0" in text:
        raise InputError(f"{path}: is not YAML as OpenCV writes it (nested too deeply); export it again")
    if not _is_one_map(text):
        raise InputError(f"{path}: is not YAML as OpenCV writes it (not one map of keys); export it again")
    try:
        storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        root = storage.root()
        return {key: _value(root.getNode(key)) for key in (root.keys() if root.isMap() else ())}
    except (cv2.error, SystemError, UnicodeDecodeError) as error:
        reason = " ".join(str(error.__cause__ or error).split()).rpartition("error: ")[2]
        raise InputError(f"{path}: is not readable as OpenCV's YAML ({reason}); export it again") from error


def _too_deep(text: str) -> bool:
    """Whether OpenCV's parser, which goes one call deeper for each bracket and each dash of a line, may not end."""
    depth = deepest = 0
    for character in re.findall(r"[\[\]{}]", text):
        depth += 1 if character in "[{" else -1
        deepest = max(deepest, depth)
    indent = max((len(space) for space in re.findall(r"^[ \t-]*", text, re.M)), default=0)
    return deepest > 16 or indent > 64


def _is_one_map(text: str) -> bool:
    """Whether all is one map from its first line to its last; behind anything else OpenCV's parser may not end."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith(("#", "%"))]
    lines = lines[1:] if lines and lines[0].strip() == "---" else lines
    return bool(lines) and lines[0][0] not in " [{-" and not any(line.startswith(("---", "...")) for line in lines)


def _value(node: cv2.FileNode) -> object:
    """The numbers of a node; those of a matrix are counted before they are read."""
    if node.isInt() or node.isReal():
        return float(node.real())
    if not node.isMap():
        return None
    data, sides = node.getNode("data"), [node.getNode(side) for side in ("rows", "cols")]
    if not data.isSeq() or not all(side.isInt() for side in sides):
        return None
    if data.size() != int(sides[0].real()) * int(sides[1].real()):
        return None
    entries = [data.at(k) for k in range(data.size())]
    if not all(entry.isInt() or entry.isReal() for entry in entries):
        return None
    return np.array([entry.real() for entry in entries], float)
