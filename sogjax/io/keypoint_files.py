"""Where a recording's keypoint files are: beside its videos, or where another program left them."""

import re
from dataclasses import dataclass
from pathlib import Path

from sogjax.io.files import visible_files
from sogjax.io.recording_files import KEYPOINTS, OUTPUT_DATA, POSE

_FREEMOCAP_NAME = re.compile(r"mediapipe_?2dData.*\.npy$", re.I)
_ENDINGS = re.compile(r"[_-](json|keypoints|openpose|alphapose|mediapipe|predictions|results)$", re.I)


@dataclass(frozen=True)
class KeypointFiles:
    """Keypoint files by camera, or one array of all cameras."""

    folder: Path
    by_name: dict[str, Path]
    """A folder of JSON files, a JSON file or a npy file, by the camera's name as the other program has it."""
    of_all: Path | None = None
    """An array whose first axis is the cameras, sorted by the names of their videos."""

    @property
    def files(self) -> list[Path]:
        """All the files, sorted."""
        found = [self.of_all] if self.of_all is not None else []
        for path in self.by_name.values():
            found += json_files(path) if path.is_dir() else [path]
        return sorted(found)


def find_keypoints(recording: Path) -> KeypointFiles | None:
    """The keypoint files of a recording, in the first folder that has any; None where there are none."""
    for part in (KEYPOINTS, POSE):
        found = files_in(part.of(recording))
        if found is not None:
            return found
    for folder in (OUTPUT_DATA.of(recording) / "raw_data", OUTPUT_DATA.of(recording)):
        for path in visible_files(folder):
            if path.is_file() and _FREEMOCAP_NAME.match(path.name):
                return KeypointFiles(path.parent, {}, path)
    return None


def files_in(folder: Path) -> KeypointFiles | None:
    """The keypoint files in a folder: `CAMERA/*.json`, `CAMERA_json/*.json`, `CAMERA.json` or `CAMERA.npy`."""
    found: dict[str, Path] = {}
    for path in visible_files(folder):
        whole = path.is_file() and path.suffix.lower() in (".json", ".npy")
        if whole and _FREEMOCAP_NAME.match(path.name):
            return KeypointFiles(folder, {}, path)
        if whole or (path.is_dir() and json_files(path)):
            found.setdefault(_ENDINGS.sub("", path.stem if whole else path.name), path)
    return KeypointFiles(folder, found) if found else None


def json_files(folder: Path) -> list[Path]:
    """The JSON files of a folder, sorted by name."""
    return [path for path in visible_files(folder) if path.suffix.lower() == ".json" and path.is_file()]


def number_in(name: str) -> int | None:
    """The number at the end of a picture's name: 12 of `cam01_000012_keypoints.json` and of `12.jpg`."""
    stem = re.sub(r"\.[A-Za-z][A-Za-z0-9]*$", "", name)
    stem = re.sub(r"[_-]?(keypoints|pose|openpose)$", "", stem, flags=re.I)
    match = re.search(r"([0-9]{1,15})$", stem)
    return None if match is None else int(match[1])
