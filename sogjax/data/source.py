"""The images of one camera, one after the other: a video, or a folder of numbered images."""

import hashlib
import json
import os
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.data.image_file import IMAGE_SUFFIXES, MAX_PIXELS, read_image
from sogjax.errors import InputError

# A file that does not open is told in our own sentence, without the codecs' own lines before it.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)

VIDEO_SUFFIXES = (".mp4", ".avi", ".mkv", ".mov")

_COUNT_PACKETS_BELOW = 256 * 2**20
"""Bytes. The packets of larger videos are not counted, which would mean to read the whole file."""

Image = UInt8[np.ndarray, "height width 3"]


class Source(ABC):
    """Sequential access to the images of one camera."""

    @abstractmethod
    def read(self) -> Image | None:
        """The next image (BGR), or None after the last."""

    @abstractmethod
    def close(self) -> None:
        """Release the file."""


@dataclass(frozen=True)
class SourceInfo:
    """What a camera's images are: rate (None for image folders), number, and (width, height)."""

    fps: float | None
    num_frames: int
    size: tuple[int, int]
    longest_gap: float = 1.0
    """The longest time between two images, in units of the middle one: 2 where one image is missing."""


def find_sources(folder: Path) -> dict[str, Path]:
    """By camera the video in `videos/` or the folder in `images/`.

    Raises:
        InputError: there are none, or a camera has two.
    """
    videos, images = folder / "videos", folder / "images"
    found = [path for path in _visible(videos) if path.is_file() and path.suffix.lower() in VIDEO_SUFFIXES]
    found += [path for path in _visible(images) if path.is_dir()]
    sources: dict[str, Path] = {}
    for path in found:
        camera = path.name if path.is_dir() else path.stem
        if camera in sources:
            raise InputError(f"{folder}: camera {camera!r} has both {sources[camera]} and {path}; remove one")
        sources[camera] = path
    if not sources:
        endings = " ".join(VIDEO_SUFFIXES)
        raise InputError(
            f"{folder}: has no videos; put videos/CAMERA.mp4 ({endings}) or images/CAMERA/000000.png there"
        )
    return sources


def open_source(path: Path, start: int = 0, threads: int = 1) -> Source:
    """The images of a video or of an image folder from its frame `start` on; `threads` decode a video.

    Raises:
        InputError: the video or folder cannot be opened.
    """
    return _ImageFolder(path, start) if path.is_dir() else _VideoFile(path, start, threads)


def look_at_source(path: Path) -> SourceInfo:
    """Rate, length and size of a camera's images; the first image is decoded.

    Raises:
        InputError: nothing can be read.
    """
    source = open_source(path)
    try:
        image = source.read()
    finally:
        source.close()
    if image is None:
        raise InputError(f"{path}: holds no image that can be decoded; record or convert it again")
    size = (image.shape[1], image.shape[0])
    if path.is_dir():
        return SourceInfo(None, len(numbered_images(path)), size)
    with _captured(path) as capture:
        fps, claimed = capture.get(cv2.CAP_PROP_FPS), int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
    times = _packet_times(path) if path.stat().st_size < _COUNT_PACKETS_BELOW else None
    return SourceInfo(fps, _num_frames(path, claimed, times), size, _longest_gap(times))


def frame_times(path: Path) -> Float[np.ndarray, "frame"] | None:
    """When each frame of a video is to be shown, in seconds, as its file says, without decoding.

    None for folders of images, and for files so large that reading them would take long.

    Raises:
        InputError: the video cannot be opened.
    """
    if path.is_dir() or path.stat().st_size >= _COUNT_PACKETS_BELOW:
        return None
    with _captured(path, [cv2.CAP_PROP_FORMAT, -1]) as capture:
        times = []
        while capture.grab():
            times.append(1e-3 * capture.get(cv2.CAP_PROP_POS_MSEC))
    return np.sort(np.array(times, float))


def numbered_images(folder: Path) -> list[Path]:
    """The images of a folder in the order of the numbers at the end of their names.

    Raises:
        InputError: a name without a number, a number that is missing, or one that stands twice.
    """
    paths = [path for path in _visible(folder) if path.suffix.lower() in IMAGE_SUFFIXES]
    numbers: dict[int, Path] = {}
    for path in paths:
        match = re.search(r"([0-9]{1,18})$", path.stem)
        if match is None:
            raise InputError(f"{path}: its name does not end in a number; call the images 000000.png and so on")
        number = int(match[1])
        if number in numbers:
            raise InputError(f"{path}: has the number of {numbers[number].name}; keep one image a frame")
        numbers[number] = path
    if not numbers:
        raise InputError(f"{folder}: holds no images ({' '.join(IMAGE_SUFFIXES)}); put 000000.png ... there")
    first = min(numbers)
    for number in range(first, first + len(numbers)):
        if number not in numbers:
            raise InputError(f"{folder}: the image number {number} is missing; number them without a gap")
    return [numbers[number] for number in sorted(numbers)]


def fingerprint(source: Path) -> str:
    """Of a video or a folder of images: names, sizes and times of last change of its files."""
    files = numbered_images(source) if source.is_dir() else [source]
    looked = [(file.name, (state := file.stat()).st_size, state.st_mtime_ns) for file in files]
    return hashlib.sha256(json.dumps(looked).encode()).hexdigest()


class _VideoFile(Source):
    """A video, decoded by FFmpeg; rotation metadata is applied."""

    def __init__(self, path: Path, start: int, threads: int):
        self._capture = _capture(path, [cv2.CAP_PROP_N_THREADS, threads])
        self._path = path
        if start > 0:
            self._seek(start, threads)

    def read(self) -> Image | None:
        ok, image = self._capture.read()
        return image if ok else None

    def close(self) -> None:
        self._capture.release()

    def _seek(self, start: int, threads: int) -> None:
        """Jump to a frame; where the container cannot, decode up to it."""
        self._capture.set(cv2.CAP_PROP_POS_FRAMES, start)
        if round(self._capture.get(cv2.CAP_PROP_POS_FRAMES)) == start:
            return
        self._capture.release()
        self._capture = _capture(self._path, [cv2.CAP_PROP_N_THREADS, threads])
        for _ in range(start):
            self._capture.grab()


class _ImageFolder(Source):
    """A folder of numbered images, all of one size."""

    def __init__(self, folder: Path, start: int):
        self._paths = iter(numbered_images(folder)[start:])
        self._shape: tuple[int, ...] | None = None

    def read(self) -> Image | None:
        path = next(self._paths, None)
        if path is None:
            return None
        image = read_image(path)
        if self._shape not in (None, image.shape):
            size = f"{image.shape[1]}x{image.shape[0]}"
            raise InputError(f"{path}: is {size}, unlike the images before it; make all of one size")
        self._shape = image.shape
        return image

    def close(self) -> None:
        self._paths = iter(())


def _capture(path: Path, parameters: Sequence[int] = ()) -> cv2.VideoCapture:
    capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG, list(parameters))
    if not capture.isOpened():
        raise InputError(f"{path}: does not open as a video; record or convert it again (H.264 in mp4 works)")
    width, height = (int(capture.get(key)) for key in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT))
    if width * height > MAX_PIXELS:
        capture.release()
        raise InputError(
            f"{path}: claims {width}x{height} pixels, more than {MAX_PIXELS}; convert it to a smaller size"
        )
    return capture


@contextmanager
def _captured(path: Path, parameters: Sequence[int] = ()) -> Iterator[cv2.VideoCapture]:
    capture = _capture(path, parameters)
    try:
        yield capture
    finally:
        capture.release()


def _num_frames(path: Path, claimed: int, times: Sequence[float] | None) -> int:
    """The number of frames; what the container claims is believed where its packets are as many."""
    packets = None if times is None else len(times)
    if claimed > 0 and packets in (None, claimed):
        return claimed
    likely = min(count for count in (claimed, packets) if count is not None and count > 0)
    with _captured(path) as capture:
        capture.set(cv2.CAP_PROP_POS_FRAMES, likely - 1)
        at_last = round(capture.get(cv2.CAP_PROP_POS_FRAMES)) == likely - 1
        if at_last and capture.grab() and not capture.grab():
            return likely
    with _captured(path) as capture:
        count = 0
        while capture.grab():
            count += 1
    return count


def _packet_times(path: Path) -> list[float]:
    """When the compressed packets of a video, which are read but not decoded, are to be shown; milliseconds."""
    times = []
    with _captured(path, [cv2.CAP_PROP_FORMAT, -1]) as capture:
        while capture.grab():
            times.append(capture.get(cv2.CAP_PROP_POS_MSEC))
    return times


def _longest_gap(times: Sequence[float] | None) -> float:
    """In units of the middle one; 1 where the times are not known."""
    gaps = np.diff(np.sort(times or [0.0]))
    middle = float(np.median(gaps)) if len(gaps) else 0.0
    return float(gaps.max()) / middle if middle > 0.0 else 1.0


def _visible(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if not path.name.startswith("."))
