"""Cameras that OpenCV opens: devices by number, addresses, pipelines."""

import time
from collections.abc import Mapping
from pathlib import Path
from threading import Event
from typing import Any

import cv2

from sogjax.errors import InputError
from sogjax.realtime.pictures import Taken
from sogjax.run.terminal import say

TRIED_AGAIN = 2.0
"""Seconds until a camera that stopped is opened again."""
OPENED_WITHIN = 10_000
"""Milliseconds in which an address must answer."""


class OpenedCamera:
    """A camera that OpenCV opens; one that stops is opened again, and its file, if it is one, ends.

    Args:
        name: what the calibration calls it.
        source: a device number, an address, or a pipeline.
        size: width and height for which it is calibrated, pixels.

    Raises:
        InputError: it does not open, or its pictures are of another size.
    """

    def __init__(self, name: str, source: int | str, size: tuple[int, int]) -> None:
        self._name, self._source, self._size = name, source, size
        self._closed = Event()
        self._capture = opened_capture(name, source, size)
        self._next = self._checked()

    @property
    def name(self) -> str:
        """What the calibration calls it."""
        return self._name

    def read(self) -> Taken | None:
        """The next picture, with the time when it came; None: the file has ended, or the camera was closed."""
        while not self._closed.is_set():
            if self._next is not None:
                taken, self._next = self._next, None
                return taken
            if self._capture.grab():
                now = time.monotonic()
                ok, picture = self._capture.retrieve()
                if ok and (picture.shape[1], picture.shape[0]) == self._size:
                    return Taken(picture, now, now)
            if isinstance(self._source, str) and Path(self._source).is_file():
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

    def _open_again(self) -> None:
        while not self._closed.wait(TRIED_AGAIN):
            self._capture.release()
            try:
                self._capture = opened_capture(self._name, self._source, self._size)
            except InputError:
                continue
            say(f"camera {self._name}: is back")
            return

    def _checked(self) -> Taken:
        ok, picture = self._capture.read()
        now = time.monotonic()
        if not ok:
            self._capture.release()
            raise InputError(f"camera {self._name}: {self._source} opens but gives no picture; is it in use elsewhere?")
        found = (picture.shape[1], picture.shape[0])
        if found != self._size:
            self._capture.release()
            raise InputError(
                f"camera {self._name}: gives pictures of {found[0]}x{found[1]}, but is calibrated for "
                f"{self._size[0]}x{self._size[1]}; set the camera to that size, or calibrate it again"
            )
        return Taken(picture, now, now)


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
        capture = cv2.VideoCapture(source, cv2.CAP_FFMPEG, [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, OPENED_WITHIN])
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
    """The source of each calibrated camera that is used; digits are a device's number.

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
        device = int(text) if text.isdecimal() else text
        other = next((known for known, used in found.items() if used == device), None)
        if other is not None:
            raise InputError(f"sources: {other} and {name} are both {text}; give each camera its own source")
        found[name] = device
    return found
