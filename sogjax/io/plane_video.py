"""A video whose images stay in its own colours, decoded by PyAV, where that is installed (`sogjax[video]`)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from functools import lru_cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import UInt8

from sogjax.io.image_file import MAX_PIXELS
from sogjax.model.yuv_picture import ColorStandard, YuvPicture

if TYPE_CHECKING:
    from av.container import InputContainer  # pyright: ignore[reportMissingImports]
    from av.video.frame import VideoFrame  # pyright: ignore[reportMissingImports]

FORMATS = {"yuv420p": False, "yuvj420p": True}
"""The pixel formats that are read, and whether black and white are 0 and 255; cameras write hardly any other."""
STANDARDS: dict[int, ColorStandard] = {1: "709", 2: "601", 5: "601", 6: "601"}
"""Colours by their number in the file (ITU-T H.273), as FFmpeg converts them; 2 is "not said"."""


def pyav_version() -> str | None:
    """The version of PyAV; None: it is not installed, or cannot be imported."""
    return None if _pyav() is None else version("av")


def _pyav() -> Any:
    try:
        version("av")  # any folder of this name could be imported
        return import_module("av")
    except (PackageNotFoundError, ImportError):
        return None


def plane_video(path: Path, start: int, threads: int, smooth: bool = False) -> PlaneVideo | None:
    """The images of a video from its frame `start` on; None where only OpenCV can read them as they should be.

    That is where PyAV is not installed, or is too old, or where the video is of a rare kind: turned sideways, of odd
    size, with more than eight bits or other differences of colour. It does not depend on `start`, so the same frame
    gives the same cells wherever reading began. `threads` decode it; with `smooth`, no image shows the edges of its
    blocks.
    """
    if _pyav() is None:
        return None
    try:
        video = _opened(path, threads, smooth)
        if video is None or start == 0 or _jumped(video, path, start):
            return video
        video.close()
        if (video := _opened(path, threads, smooth)) is not None:
            for _ in range(start):
                video.skip()
        return video
    except (*_failures(), AttributeError):  # of the file, which OpenCV names; of an old PyAV
        return None


def _failures() -> tuple[type[Exception], ...]:
    """What PyAV raises over files; some errors of FFmpeg are of no kind of Python's."""
    return OSError, ValueError, _pyav().FFmpegError


def _opened(path: Path, threads: int, smooth: bool) -> PlaneVideo | None:
    with ExitStack() as stack:
        container = _pyav().open(str(path), options={})
        stack.callback(container.close)
        video = PlaneVideo(container, threads, smooth)
        if not video.readable:
            return None
        stack.pop_all()
        return video


def _jumped(video: PlaneVideo, path: Path, start: int) -> bool:
    try:
        return video.seek(_times(path), start)
    except _failures():
        return False


def _times(path: Path) -> tuple[int, ...]:
    """When the images are to be shown, in their order and in units of the file; none where it does not say so."""
    state = path.stat()
    return _times_of(str(path), state.st_size, state.st_mtime_ns)


@lru_cache(maxsize=256)
def _times_of(path: str, size: int, changed: int) -> tuple[int, ...]:
    """The whole file is read, but not decoded."""
    with _pyav().open(path) as container:
        packets = [packet for packet in container.demux(video=0) if packet.size and not packet.is_discard]
        times = [packet.pts for packet in packets]
    return () if None in times or len({*times}) < len(times) else tuple(sorted(times))


class PlaneVideo:
    """The images of an open file, one after the other."""

    def __init__(self, container: InputContainer, threads: int, smooth: bool):
        self._container = container
        self._images: Iterator[VideoFrame] = iter(())
        self._first: VideoFrame | None = None
        if not container.streams.video:
            return
        stream = container.streams.video[0]
        codec = stream.codec_context
        # Images that no other one is made of need no smoothing of block edges: the mean of a cell does not see them.
        # Pictures made beside the cells, as for the overlay, show them.
        codec.options = {} if smooth else {"skip_loop_filter": "noref"}
        codec.skip_frame = "DEFAULT"  # a PyAV that cannot is too old
        codec.thread_count = threads
        codec.thread_type = "AUTO" if threads > 1 else "NONE"
        if 0 < codec.width * codec.height <= MAX_PIXELS:
            self._images = self._decoded()
            self._first = next(self._images, None)

    @property
    def readable(self) -> bool:
        """Whether the images are of a kind that is read here, by the first one."""
        first = self._first
        return first is not None and _known(first)

    def read(self) -> YuvPicture | UInt8[np.ndarray, "height width 3"] | None:
        """The next image, or None after the last; as a picture (BGR) where its kind changes within the video."""
        image = self._next()
        if image is None:
            return None
        return yuv_picture(image) if _known(image) else _bgr(image)

    def skip(self) -> None:
        """Pass over the next image."""
        self._next()

    def close(self) -> None:
        """Release the file."""
        self._first, self._images = None, iter(())
        self._container.close()

    def seek(self, times: Sequence[int], start: int) -> bool:
        """Jump to an image by its number, given when each is to be shown; False: it cannot be found for sure."""
        first = self._first
        if start >= len(times) or first is None or first.pts != times[0]:
            return False
        stream, numbers, back = self._container.streams.video[0], {time: k for k, time in enumerate(times)}, start
        while True:
            self._container.seek(times[back], stream=stream, backward=True)
            self._images = self._decoded(times[start])
            image, number = self._reached(numbers, start)
            if image is not None and number == start:
                self._first = image
                return True
            if number is None or back == 0:
                return False
            back = max(0, 2 * back - number - 1)

    def _reached(self, numbers: Mapping[int, int], start: int) -> tuple[VideoFrame | None, int | None]:
        """The first image from here on that does not come before the wanted one, and its number."""
        for image in self._images:
            number = None if image.pts is None else numbers.get(image.pts)
            if number is None or number >= start:
                return image, number
        return None, None

    def _next(self) -> VideoFrame | None:
        image, self._first = self._first, None
        return next(self._images, None) if image is None else image

    def _decoded(self, wanted: int | None = None) -> Iterator[VideoFrame]:
        """All images from here on, up to damage: as with OpenCV, no later image is taken for that of another frame.

        Before the time that is `wanted` come only those that others are made of.
        """
        failures, codec = _failures(), self._container.streams.video[0].codec_context
        try:
            for packet in self._container.demux(video=0):
                early = wanted is not None and packet.pts is not None and packet.pts < wanted
                codec.skip_frame = "NONREF" if early else "DEFAULT"
                yield from packet.decode()  # pyright: ignore[reportReturnType]
        except failures:
            return


def yuv_picture(image: VideoFrame) -> YuvPicture:
    """The planes of an image; they live in the decoder's memory as long as they are used."""
    luma, blue, red = (
        np.frombuffer(plane, np.uint8).reshape(plane.height, plane.line_size)[:, : plane.width]  # pyright: ignore
        for plane in image.planes
    )
    full_range = FORMATS[image.format.name]
    return YuvPicture(luma, blue, red, STANDARDS[int(image.colorspace)], full_range, lambda: _bgr(image))


def _known(image: VideoFrame) -> bool:
    even = image.width % 2 == 0 and image.height % 2 == 0
    kind = image.format.name
    full_range = 2  # the number of the range in which black and white are 0 and 255
    as_named = kind in FORMATS and (FORMATS[kind] or int(image.color_range) != full_range)  # OpenCV knows some of these
    return even and as_named and int(image.colorspace) in STANDARDS and image.rotation == 0


def _bgr(image: VideoFrame) -> UInt8[np.ndarray, "height width 3"]:
    return image.to_ndarray(format="bgr24")
