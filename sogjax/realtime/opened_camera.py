"""Cameras that OpenCV opens: devices by number, addresses, pipelines."""

import re
import time
from collections.abc import Mapping
from pathlib import Path
from threading import Event
from typing import Any

import cv2
import numpy as np

from sogjax.errors import InputError
from sogjax.realtime.pictures import Taken
from sogjax.run.terminal import say

TRIED_AGAIN = 2.0
"""Seconds until a camera that stopped is opened again."""
OPENED_WITHIN, READ_WITHIN = 10_000, 5_000
"""Milliseconds in which an address must answer, and in which the next picture must come."""


class OpenedCamera:
    """A camera that OpenCV opens; one that stops is opened again, and its file, if it is one, ends.

    A file gives its pictures at its own rate.

    Args:
        name: what the calibration calls it.
        source: a device number, an address, a file, or a pipeline.
        size: width and height for which it is calibrated, pixels.

    Raises:
        InputError: it does not open, or its pictures are of another size.
    """

    def __init__(self, name: str, source: int | str, size: tuple[int, int]) -> None:
        self._name, self._source, self._size = name, source, size
        self._is_file = isinstance(source, str) and Path(source).is_file()
        self._closed = Event()
        self._capture, first = self._opened()
        self._first = first if self._is_file else None  # of a camera it is old by the time that all is ready
        self._begin: float | None = None

    @property
    def name(self) -> str:
        """What the calibration calls it."""
        return self._name

    def read(self) -> Taken | None:
        """The next picture, with the time when it came; None: the file has ended, or the camera was closed."""
        while not self._closed.is_set():
            if (taken := self._next()) is not None:
                return taken
            if self._is_file:
                return None
            say(f"camera {self._name}: {self._source} stopped; the others go on, and it is opened again")
            self._open_again()
        return None

    def close(self) -> None:
        """Release it."""
        self._closed.set()

    def release(self) -> None:
        """Give the device back; called by the thread that reads, when it ends."""
        self._capture.release()

    def _next(self) -> Taken | None:
        """The next picture of the calibrated size, and when it came, before it was decoded; None: there is none."""
        picture, self._first = self._first, None
        if picture is None and not self._capture.grab():
            return None
        now = time.monotonic()
        if picture is None:
            ok, picture = self._capture.retrieve()
            if not ok or (picture.shape[1], picture.shape[0]) != self._size:
                return None
        if self._is_file:
            seconds = 1e-3 * self._capture.get(cv2.CAP_PROP_POS_MSEC)
            self._begin = now - seconds if self._begin is None else self._begin
            self._closed.wait(max(self._begin + seconds - now, 0.0))
            now = time.monotonic()
        return Taken(picture, now, now)

    def _open_again(self) -> None:
        said = ""
        while not self._closed.wait(TRIED_AGAIN):
            self._capture.release()
            try:
                self._capture, _ = self._opened()
            except InputError as error:
                if str(error) != said:
                    say(said := str(error))
                continue
            say(f"camera {self._name}: is back")
            return

    def _opened(self) -> tuple[cv2.VideoCapture, np.ndarray]:
        """The camera, and a picture that it gave.

        Raises:
            InputError: it does not open, or its pictures are of another size.
        """
        capture = opened_capture(self._name, self._source, self._size)
        ok, picture = capture.read()
        if not ok:
            capture.release()
            raise InputError(f"camera {self._name}: {self._source} opens but gives no picture; is it in use elsewhere?")
        found = (picture.shape[1], picture.shape[0])
        if found != self._size:
            capture.release()
            raise InputError(
                f"camera {self._name}: gives pictures of {found[0]}x{found[1]}, but is calibrated for "
                f"{self._size[0]}x{self._size[1]}; set the camera to that size, or calibrate it again"
            )
        return capture, picture


def opened_capture(name: str, source: int | str, size: tuple[int, int]) -> cv2.VideoCapture:
    """The camera as OpenCV opens it, asked for pictures of a size.

    Raises:
        InputError: it does not open.
    """
    if isinstance(source, int):
        capture = cv2.VideoCapture(source)
    elif "!" in source:
        capture = cv2.VideoCapture(source, cv2.CAP_GSTREAMER)
    else:
        limits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, OPENED_WITHIN, cv2.CAP_PROP_READ_TIMEOUT_MSEC, READ_WITHIN]
        capture = cv2.VideoCapture(source, cv2.CAP_FFMPEG, limits)
    if not capture.isOpened():
        raise InputError(
            f"camera {name}: {source} does not open; check the number or address, that no other program uses it, "
            "and that this OpenCV reads such a source"
        )
    if isinstance(source, int):
        capture.set(cv2.CAP_PROP_FRAME_WIDTH, size[0])
        capture.set(cv2.CAP_PROP_FRAME_HEIGHT, size[1])
        capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)
    return capture


def checked_sources(sources: Any, names: tuple[str, ...]) -> dict[str, int | str]:
    """The source of each calibrated camera that is used; digits, and /dev/videoN, are a device's number.

    Raises:
        InputError: none, a camera that is not calibrated, or two cameras on one device.
    """
    if not isinstance(sources, Mapping) or not sources:
        raise InputError(
            f"sources={sources}: name the cameras, such as sources='{{{names[0]}:0}}', or replay the recording with "
            "replay=true"
        )
    found: dict[str, int | str] = {}
    for key, source in sources.items():
        name, text = str(key), str(source)
        if name not in names:
            raise InputError(f"sources: there is no camera {name!r} in the calibration; there are {', '.join(names)}")
        device = _source(text)
        other = next((known for known, used in found.items() if used == device), None)
        if other is not None:
            raise InputError(f"sources: {other} and {name} are both {text}; give each camera its own source")
        found[name] = device
    return found


def _source(text: str) -> int | str:
    """A source in one form, however it is written: a device by its number, a file by its whole path."""
    if text.isdecimal():
        return int(text)
    path = Path(text)
    real = str(path.resolve()) if "://" not in text and "!" not in text and path.exists() else text
    device = re.fullmatch(r"/dev/video(\d+)", real)
    return real if device is None else int(device[1])
