"""The cells of a clip on disk, so that no frame is decoded twice: they serve every colour space, tolerance and actor.

A folder: `cells.bin` holds the cells (averaged pictures, sRGB bytes) of every frame of a recording in its place,
`frames.bin` which of them are there, with checksums, and `made_from.json` what they were made of. A frame counts only
where its checksum holds, so a process can be killed at any moment, and several may write the same cells. Samples,
pictures of a few frames, lie beside them.
"""

import hashlib
import json
import shutil
import zlib
from collections.abc import Callable
from io import FileIO
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from jaxtyping import Bool, UInt8

from sogjax.errors import InputError
from sogjax.io.files import atomic_path, disk_trouble_told, write_file
from sogjax.io.plane_video import pyav_version
from sogjax.io.recording import Recording
from sogjax.io.source import fingerprint

CELLS_VERSION = 5
"""Raise it with every change that alters cells or their files."""
CELLS, FRAMES, MADE_FROM = "cells.bin", "frames.bin", "made_from.json"

Cells = UInt8[np.ndarray, "camera rows columns 3"]
Samples = list[dict[int, UInt8[np.ndarray, "_rows _columns 3"]]]
"""By camera what was taken of some frames."""


class CellStore:
    """The kept cells of one recording, cut by quad-trees of one depth; frames are the recording's numbers.

    Args:
        folder: of the files, made where it is missing; its cells are dropped if they were made of anything else.
        recording: whose cells.
        depth: of the quad-trees.
        shape: cameras, rows and columns of the cells of a frame.
        say: receives a sentence where kept cells cannot be used.

    Raises:
        InputError: the folder cannot be made or written.
    """

    def __init__(
        self, folder: Path, recording: Recording, depth: int, shape: tuple[int, int, int], say: Callable[[str], None]
    ):
        self.folder, self._files, self._writing = folder, dict[str, FileIO](), Lock()
        self._shape, self._size = (*shape, 3), int(np.prod(shape)) * 3
        self._entry = np.dtype([("kept", "u1"), ("checksum", "<u4"), ("present", "u1", (shape[0],))])
        self.is_full = False
        """Whether nothing more is kept."""
        self._say, self._made_from = say, _made_from(recording, depth, shape)
        with disk_trouble_told(folder):
            self._begin()

    def _begin(self) -> None:
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            if self._read_note() != self._made_from:
                if (self.folder / MADE_FROM).exists():
                    self._say(f"{self.folder}: the cells were made from other files or settings; they are made again")
                self.remove()
                self.folder.mkdir()
                write_file(self.folder / MADE_FROM, json.dumps(self._made_from))
            for name in (CELLS, FRAMES):
                (self.folder / name).touch()
        except OSError as error:
            reason = error.strerror or str(error)
            raise InputError(f"{self.folder}: no cells can be kept there ({reason}); choose another folder") from error

    def kept(self, frames: range) -> Bool[np.ndarray, "frame"]:
        """Which of some frames are there."""
        entries = np.fromfile(self.folder / FRAMES, self._entry)
        numbers = np.asarray(frames)
        there = numbers < len(entries)
        return there & (entries["kept"][np.where(there, numbers, 0)] > 0 if len(entries) else False)

    def find(self, frame: int) -> tuple[Cells, Bool[np.ndarray, "camera"]] | None:
        """The cells of a frame, memory-mapped, and which cameras have a picture; None where they must be made."""
        with (self.folder / FRAMES).open("rb") as file:
            file.seek(frame * self._entry.itemsize)
            content = file.read(self._entry.itemsize)
        entry = np.frombuffer(content, self._entry)[0] if len(content) == self._entry.itemsize else None
        if entry is None or not entry["kept"]:
            return None
        offset = frame * self._size
        if (self.folder / CELLS).stat().st_size >= offset + self._size:
            cells = np.memmap(self.folder / CELLS, np.uint8, "r", offset, self._shape)
            if zlib.crc32(cells.data) == entry["checksum"]:
                return cells, entry["present"].astype(bool)
        self._say(f"{self.folder}: the cells of frame {frame} are damaged; they are made again")
        self._write(FRAMES, np.zeros(1, self._entry).tobytes(), frame * self._entry.itemsize)
        return None

    def keep(self, frame: int, cells: Cells, present: Bool[np.ndarray, "camera"]) -> None:
        """Keep the cells of a frame.

        Raises:
            InputError: the disk is full, or the folder is gone.
        """
        content, entry = np.ascontiguousarray(cells), np.zeros(1, self._entry)
        entry["kept"], entry["checksum"], entry["present"] = 1, zlib.crc32(content.data), present
        with disk_trouble_told(self.folder / CELLS):
            self._write(CELLS, content.tobytes(), frame * self._size)
            self._write(FRAMES, entry.tobytes(), frame * self._entry.itemsize)

    def has_samples(self, name: str) -> bool:
        """Whether the samples of a kind were kept."""
        return (self.folder / f"{name}.json").is_file()

    def keep_samples(self, name: str, samples: Samples) -> Samples:
        """Keep samples of a kind; returns them as they lie on the disk.

        Raises:
            InputError: the disk is full, or the folder is gone.
        """
        for camera, of_camera in enumerate(samples):
            stacked = np.stack([*of_camera.values()]) if of_camera else np.zeros((0, 1, 1, 3), np.uint8)
            with atomic_path(self.folder / f"{name}_{camera}.npy") as temporary:
                np.save(temporary, stacked)
        write_file(self.folder / f"{name}.json", json.dumps([[*of_camera] for of_camera in samples]))
        return self.samples(name)

    def samples(self, name: str) -> Samples:
        """The samples of a kind that were kept, memory-mapped: by camera what was taken of each frame."""
        frames = json.loads((self.folder / f"{name}.json").read_text(encoding="utf-8"))
        arrays = [np.load(self.folder / f"{name}_{camera}.npy", mmap_mode="r") for camera in range(len(frames))]
        return [dict(zip(of_camera, array, strict=True)) for of_camera, array in zip(frames, arrays, strict=True)]

    def close(self) -> None:
        """Close the files; what was kept stays."""
        for file in self._files.values():
            file.close()
        self._files.clear()

    def remove(self) -> None:
        """Remove all that was kept."""
        self.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def _write(self, name: str, content: bytes, offset: int) -> None:
        """Write at a place, without a buffer: a full disk shows here and not in whoever reads the mapped file."""
        with self._writing:
            if name not in self._files:
                self._files[name] = (self.folder / name).open("r+b", buffering=0)
            self._files[name].seek(offset)
            left = memoryview(content)
            while left:
                left = left[self._files[name].write(left) :]

    def _read_note(self) -> dict[str, Any] | None:
        try:
            return json.loads((self.folder / MADE_FROM).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None


def store_name(recording: Recording, depth: int) -> str:
    """The name of the store's folder among others: readable, and different for other folders, cameras and depths."""
    what = json.dumps([str(recording.path.resolve()), recording.rig.names, depth])
    return f"{recording.name}-{hashlib.sha256(what.encode()).hexdigest()[:12]}-cells"


def _made_from(recording: Recording, depth: int, shape: tuple[int, int, int]) -> dict[str, Any]:
    """Everything that the cells depend on."""
    cameras = recording.rig.names
    return {
        "version": CELLS_VERSION,
        "depth": depth,
        "shape": list(shape),
        "frame_offset": {camera: recording.frame_offset[camera] for camera in cameras},
        "files": {camera: fingerprint(recording.sources[camera]) for camera in cameras},
        "color_gains": {camera: list(gains) for camera, gains in sorted(recording.color_gains.items())},
        "picked": {camera: list(numbers) for camera, numbers in recording.picked.items()},
        "missing": {camera: [list(span) for span in spans] for camera, spans in recording.missing.items()},
        "PyAV": pyav_version(),  # its cells may differ from those of OpenCV by a grey level
    }
