"""The cells of a recording on disk, so that sweeps and notebooks do not decode its videos again.

Cells (averaged pictures, sRGB bytes) are what image blobs are made of: one file serves every colour space, every
tolerance and every actor. Beside each array (`.npy`, to be memory-mapped) lies a small `.json` that says what it was
made from; an array is used only where that still holds.
"""

import hashlib
import json
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from jaxtyping import UInt8

from sogjax.errors import InputError
from sogjax.io.files import atomic_path
from sogjax.io.npz_file import check_npy
from sogjax.io.plane_video import pyav_version
from sogjax.io.recording import Recording
from sogjax.io.source import fingerprint

CELLS_VERSION = 4
"""Raise it with every change that alters cells or their files."""
_CHUNK = 2**22

Cells = UInt8[np.ndarray, "camera rows columns 3"]
Frame = TypeVar("Frame")
CellsOfClip = UInt8[np.ndarray, "frame camera rows columns 3"]


@dataclass(frozen=True)
class CellCache:
    """The kept cells of one recording, cut by quad-trees of one depth; frames count from the recording's first."""

    folder: Path
    recording: Recording
    depth: int
    say: Callable[[str], None]
    """Receives a sentence if kept cells cannot be used."""

    def find(self, first: int, last: int) -> CellsOfClip | None:
        """The cells of the frames from `first` to before `last`, memory-mapped; None where they must be made."""
        first, last = first + self.recording.first_frame, last + self.recording.first_frame
        for note in sorted(self.folder.glob(f"{self._prefix}-*.json")):
            array = note.with_suffix(".npy")
            try:
                begin, cells = self._checked(note, array)
            except _UnusableError as reason:
                self.say(f"images.cache: {array} {reason}; it is made again")
                note.unlink(missing_ok=True)
                array.unlink(missing_ok=True)
                continue
            if begin <= first and last <= begin + len(cells):
                return cells[first - begin : last - begin]
        return None

    def kept(
        self, first: int, last: int, frames: Iterator[Frame], cells_of: Callable[[Frame], Cells]
    ) -> Iterator[Frame]:
        """The same frames; when the last one was taken, the cells of all of them are on disk.

        Raises:
            InputError: the folder cannot be written, or the disk is full.
        """
        begin = first + self.recording.first_frame
        array = self.folder / f"{self._prefix}-{begin}-{last - first}.npy"
        with atomic_path(array) as temporary, temporary.open("wb") as file:
            checksum, shape = 0, None
            for frame in frames:
                cells = cells_of(frame)
                if shape is None:
                    shape = (last - first, *cells.shape)
                    header = {"descr": "|u1", "fortran_order": False, "shape": shape}
                    np.lib.format.write_array_header_1_0(file, header)
                content = np.ascontiguousarray(cells).tobytes()
                checksum = zlib.crc32(content, checksum)
                file.write(content)
                yield frame
        note = {"made_from": self._made_from, "first_frame": begin, "checksum": checksum}
        with atomic_path(array.with_suffix(".json")) as temporary:
            temporary.write_text(json.dumps(note, indent=1))

    @cached_property
    def _prefix(self) -> str:
        """The beginning of the names of the files: readable, and different for other folders, cameras and depths."""
        what = [str(self.recording.path.resolve()), self.recording.rig.names, self.depth]
        return f"{self.recording.name}-{hashlib.sha256(json.dumps(what).encode()).hexdigest()[:12]}"

    @cached_property
    def _made_from(self) -> dict[str, Any]:
        """Everything that the cells depend on."""
        cameras = self.recording.rig.names
        gains = {camera: list(self.recording.color_gains[camera]) for camera in sorted(self.recording.color_gains)}
        optional = {
            "color_gains": gains,
            "picked": {camera: list(n) for camera, n in self.recording.picked.items()},
            "PyAV": pyav_version(),  # its cells may differ from those of OpenCV by a grey level
        }
        return {key: value for key, value in optional.items() if value} | {
            "version": CELLS_VERSION,
            "depth": self.depth,
            "frame_offset": {camera: self.recording.frame_offset[camera] for camera in cameras},
            "files": {camera: fingerprint(self.recording.sources[camera]) for camera in cameras},
        }

    def _checked(self, note: Path, array: Path) -> tuple[int, CellsOfClip]:
        """The first frame and the cells of a file, if it is whole and what it was made from has not changed."""
        try:
            content = json.loads(note.read_text())
            made_from, begin, checksum = (content[key] for key in ("made_from", "first_frame", "checksum"))
            if not isinstance(begin, int):
                raise TypeError("first_frame is not a number")
        except (OSError, ValueError, LookupError, TypeError) as error:
            raise _UnusableError("has no readable note of what it was made from") from error
        if made_from != self._made_from:
            raise _UnusableError("was made from other files or settings")
        try:
            check_npy(array)
            cells = np.load(array, mmap_mode="r", allow_pickle=False)
        except (OSError, ValueError, EOFError, InputError) as error:
            raise _UnusableError("is missing or cut short") from error
        state = array.stat()
        if _checksum(array, cells.offset, state.st_size, state.st_mtime_ns) != checksum:
            raise _UnusableError("is damaged")
        return begin, cells


class _UnusableError(Exception):
    """Why kept cells cannot be used."""


def cell_cache(folder: str, recording: Recording, depth: int, say: Callable[[str], None]) -> CellCache:
    """The cache in a folder, which is made where it is missing.

    Raises:
        InputError: it cannot be made.
    """
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"images.cache={folder}: no folder can be made there ({reason}); choose another") from error
    return CellCache(path, recording, depth, say)


@lru_cache(maxsize=256)
def _checksum(path: Path, offset: int, size: int, changed_at: int) -> int:
    """Of a file from `offset` on, read piece by piece; once in a process, as long as size and time do not change."""
    checksum = 0
    with path.open("rb") as file:
        file.seek(offset)
        while piece := file.read(_CHUNK):
            checksum = zlib.crc32(piece, checksum)
    return checksum
