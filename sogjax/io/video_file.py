"""A video file: its images one after the other, how many there are, and when each is to be shown."""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.errors import InputError
from sogjax.io.image_file import MAX_PIXELS

# A file that does not open is reported in our own sentence, without lines from the codecs before it.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)

_COUNT_PACKETS_BELOW = 256 * 2**20
"""The bytes of a file from which on its packets are not counted, which would mean reading all of it."""


class VideoFile:
    """A video, decoded by FFmpeg; rotation metadata is applied."""

    def __init__(self, path: Path, start: int, threads: int):
        self._capture = _capture(path, [cv2.CAP_PROP_N_THREADS, threads])
        self._path = path
        if start > 0:
            self._seek(start, threads)

    def read(self) -> UInt8[np.ndarray, "height width 3"] | None:
        """The next image (BGR), or None after the last."""
        ok, image = self._capture.read()
        return image if ok else None

    def skip(self) -> None:
        """Pass over the next image: it is decoded, but its colours are not converted."""
        self._capture.grab()

    def close(self) -> None:
        """Release the file."""
        self._capture.release()

    def _seek(self, start: int, threads: int) -> None:
        """Jump to a frame by its number; where the container cannot, or images are missing, decode up to it."""
        if _steady(self._path, self._capture.get(cv2.CAP_PROP_FPS)):
            self._capture.set(cv2.CAP_PROP_POS_FRAMES, start)
            if round(self._capture.get(cv2.CAP_PROP_POS_FRAMES)) == start:
                return
        self._capture.release()
        self._capture = _capture(self._path, [cv2.CAP_PROP_N_THREADS, threads])
        for _ in range(start):
            self._capture.grab()


def look_at_video(path: Path) -> tuple[float, int, Float[np.ndarray, "frame"] | None]:
    """Rate, number and times of a video's images, decoding hardly any; None: it is too large to read the times."""
    with _captured(path) as capture:
        fps, claimed = capture.get(cv2.CAP_PROP_FPS), int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
    times = frame_times(path) if path.stat().st_size < _COUNT_PACKETS_BELOW else None
    return fps, _num_frames(path, claimed, times), times


def frame_times(path: Path) -> Float[np.ndarray, "frame"]:
    """When each frame of a video is to be shown, in seconds and ascending; the whole file is read, but not decoded.

    Raises:
        InputError: it cannot be opened.
    """
    times = []
    with _captured(path, [cv2.CAP_PROP_FORMAT, -1]) as capture:
        while capture.grab():
            times.append(1e-3 * capture.get(cv2.CAP_PROP_POS_MSEC))
    return np.sort(np.array(times, float))


def _steady(path: Path, fps: float) -> bool:
    """Whether images come at a constant rate, by which a jump finds them; the whole file is read once, however large.

    PyAV's reader does so too: both find the same image by its number.
    """
    state = path.stat()
    return _is_steady(path, fps, (state.st_size, state.st_mtime_ns))


@lru_cache(maxsize=256)
def _is_steady(path: Path, fps: float, state: tuple[int, int]) -> bool:
    times = frame_times(path)
    expected = np.arange(len(times)) / max(fps, 1e-6)
    # An image that comes a quarter of a frame too early or too late is not found by its time.
    return len(times) > 0 and bool(np.all(np.abs(times - times[0] - expected) * fps < 0.25))


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


def _num_frames(path: Path, claimed: int, times: Float[np.ndarray, "frame"] | None) -> int:
    """The number of frames; the container's claim is believed if it has that many packets."""
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
