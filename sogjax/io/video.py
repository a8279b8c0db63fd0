"""The images of a recording, time step by time step, and the writer of videos."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import ExitStack, closing
from functools import partial
from itertools import pairwise
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

import cv2
import numpy as np
from jaxtyping import UInt8

from sogjax.errors import InputError
from sogjax.io.files import atomic_path
from sogjax.io.image_file import evened, read_image
from sogjax.io.recording import Recording
from sogjax.io.source import ImageStream, open_source, open_with_least_work
from sogjax.io.video_file import frame_times
from sogjax.model.cores import usable_cores
from sogjax.model.yuv_picture import YuvPicture

Item = TypeVar("Item")

WORTH_A_JUMP = 60
"""Frames from one that is read to the next, beyond which a jump (from the key frame before it) is likely cheaper."""


def read_frames(recording: Recording, start: int | None = None, stop: int | None = None) -> Iterator[list[Any]]:
    """The images of each time step, BGR, in the order of the rig's cameras; None where a camera is missing.

    `start` and `stop` are the recording's numbers of the first frame and of the one after the last. Threads decode the
    cameras, one time step ahead of the consumer; when the consumer stops, all files are closed.

    Raises:
        InputError: a video ends early or changes its size.
    """
    return read_prepared(recording, lambda camera, frame, image: image, start, stop)


def read_chosen(recording: Recording, frames: Iterable[int]) -> Iterator[tuple[int, list[Any]]]:
    """Some of the recording's frames with their images, in the order of time, as `read_frames` gives them.

    Raises:
        InputError: a video ends early or changes its size.
    """
    chosen = sorted({*frames})
    if not {*chosen} <= {*recording.frames}:
        raise ValueError(f"of the frames {chosen}, some are not in a recording of the frames {recording.frames}")
    starts = [k for k, frame in enumerate(chosen) if k == 0 or frame - chosen[k - 1] > WORTH_A_JUMP]
    for first, stop in pairwise([*starts, len(chosen)]):
        part = chosen[first:stop]
        images = _decoded_ahead(recording, _whole, part, planes=True, smooth=True)
        yield from zip(part, images, strict=True)


def _whole(camera: int, frame: int, image: np.ndarray | YuvPicture | None) -> UInt8[np.ndarray, "_h _w 3"] | None:
    """The picture in red, green and blue."""
    return image.bgr() if isinstance(image, YuvPicture) else image


def read_prepared(
    recording: Recording,
    prepare: Callable[[int, int, Any], Item],
    start: int | None = None,
    stop: int | None = None,
    planes: bool = False,
) -> Iterator[list[Item]]:
    """What `prepare` makes of each camera, frame and image (None where it is missing), time step by time step.

    The decoding threads do that, so a large image need not outlive the moment in which it was decoded. Frames count as
    in `read_frames`. With `planes`, an image may come in its video's own colours (`YuvPicture`), which spares the
    conversion of every pixel, unless the colours of its camera are to be evened out.

    Raises:
        InputError: a video ends early or changes its size.
    """
    known = recording.frames
    start, stop = known.start if start is None else start, known.stop if stop is None else min(stop, known.stop)
    if not known.start <= start <= stop:
        raise ValueError(f"frames {start} to {stop} are not in a recording of the frames {known.start} to {known[-1]}")
    return _decoded_ahead(recording, prepare, range(start, stop), planes)


def _decoded_ahead(
    recording: Recording,
    prepare: Callable[[int, int, Any], Item],
    frames: Sequence[int],
    planes: bool,
    smooth: bool = False,
) -> Iterator[list[Item]]:
    if not frames:
        return
    in_planes = partial(open_with_least_work, smooth=smooth)
    cameras, workers = recording.rig.names, usable_cores()
    threads = max(1, workers // len(cameras))
    with ExitStack() as stack:
        pool = stack.enter_context(ThreadPoolExecutor(min(len(cameras), workers)))

        def opened_at(frame: int, camera: str) -> ImageStream[Any]:
            opening = in_planes if planes and camera not in recording.color_gains else open_source
            start = max(frame + recording.frame_offset[camera], 0)
            return opening(recording.sources[camera], start, threads, recording.picked.get(camera))

        opened = [pool.submit(opened_at, frames[0], camera) for camera in cameras]
        stack.callback(_close_all, opened)
        sources, sizes = [future.result() for future in opened], [recording.rig.image_size(name) for name in cameras]

        ended: set[int] = set()
        passed_over = {frame: range(last + 1, frame) for last, frame in pairwise([frames[0] - 1, *frames])}

        def decoded(camera: int, frame: int) -> Item:
            name = cameras[camera]
            if camera in ended or not recording.has_image(name, frame):
                return prepare(camera, frame, None)
            for passed in passed_over[frame]:
                if recording.has_image(name, passed):
                    sources[camera].skip()
            image = sources[camera].read()
            if image is None and recording.fewest_cameras is None:
                unread = range(recording.frames.start, frame) if frame == frames[0] else passed_over[frame]
                raise _ends_early(recording, name, unread, opened_at)
            if image is None:
                ended.add(camera)  # what might still come would be images of other frames
            else:
                image = _checked(recording, name, image, frame, sizes[camera])
            return prepare(camera, frame, None if recording.is_missing(name, frame) else image)

        decode = lambda frame: [pool.submit(decoded, camera, frame) for camera in range(len(cameras))]
        upcoming = decode(frames[0])
        stack.callback(lambda: wait(upcoming))
        for following in [*frames[1:], None]:
            images = [future.result() for future in upcoming]
            upcoming[:] = [] if following is None else decode(following)
            yield images


def _close_all(opened: list[Future[ImageStream[Any]]]) -> None:
    wait(opened)
    for future in opened:
        if future.exception() is None:
            future.result().close()


def _ends_early(
    recording: Recording, camera: str, unread: range, opened_at: Callable[[int, str], ImageStream[Any]]
) -> InputError:
    """What is said of a video whose frame `unread.stop` cannot be read.

    The frames before it that are `unread` were jumped or passed over; reading them tells which is the last that can be.
    """
    end = unread.stop
    if unread:
        held = [frame for frame in unread if recording.has_image(camera, frame)]
        with closing(opened_at(unread.start, camera)) as images:
            end = next((frame for frame in held if images.read() is None), end)
    remedy = "convert the video again"
    if end > recording.frames.start:
        remedy = f"set `last_frame: {end - 1}` in recording.yaml, or {remedy}"
    return InputError(
        f"{recording.sources[camera]}: ends before frame {end}, though its header promises more; {remedy}"
    )


def _checked(
    recording: Recording, camera: str, image: np.ndarray | YuvPicture, frame: int, calibrated: tuple[int, int]
) -> np.ndarray | YuvPicture:
    source = recording.sources[camera]
    size = (image.shape[1], image.shape[0])
    if size != calibrated:
        raise InputError(f"{source}: its frame {frame} is {size[0]}x{size[1]}, unlike the first; convert it again")
    return image if isinstance(image, YuvPicture) else evened(image, recording.color_gains.get(camera))


def read_still(recording: Recording, camera: str, path: Path) -> UInt8[np.ndarray, "height width 3"]:
    """A single picture of a camera, BGR, in the same colours as its frames.

    Raises:
        InputError: no such file, or no image.
    """
    return evened(read_image(path), recording.color_gains.get(camera))


class VideoWriter:
    """Writes an mp4 (codec mp4v), within a `with` block; it gets its name only when it is complete.

    The codec stores even sizes only: the last row or column of an odd image is left out.
    """

    def __init__(self, path: Path, fps: float):
        if path.suffix.lower() != ".mp4":
            raise InputError(f"{path}: videos are written as .mp4 only; change the extension")
        self._path, self._fps = path, fps
        self._stack = ExitStack()
        self._writer: cv2.VideoWriter | None = None
        self._shape: tuple[int, ...] | None = None
        self._count = 0

    def __enter__(self) -> "VideoWriter":
        self._temporary = self._stack.enter_context(atomic_path(self._path))
        return self

    def write(self, image: UInt8[np.ndarray, "height width 3"]) -> None:
        """Append an image (BGR); all are of one size."""
        writer = self._writer = self._writer or self._open(image)
        self._shape = self._shape or image.shape
        if image.shape != self._shape:
            raise ValueError(f"{self._path}: an image of shape {image.shape} after one of {self._shape}")
        writer.write(np.ascontiguousarray(image))
        self._count += 1

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Finish the file, or remove it after an error, where no image was written, or where some are missing.

        Raises:
            InputError: not all images are in the file.
        """
        if self._writer is not None:
            self._writer.release()
        if error is not None:
            self._stack.__exit__(kind, error, traceback)
            return
        with self._stack:
            self._check_whole()

    def _check_whole(self) -> None:
        """The codec does not say that the disk is full."""
        if self._writer is None:
            raise ValueError(f"{self._path}: no image was written")
        try:
            found = len(frame_times(self._temporary))
        except InputError:
            found = 0
        if found != self._count:
            raise InputError(
                f"{self._path}: could not be written completely ({found} of {self._count} images are in it; the "
                "disk may be full); choose another disk"
            )

    def _open(self, image: UInt8[np.ndarray, "height width 3"]) -> cv2.VideoWriter:
        height, width = image.shape[:2]
        writer = cv2.VideoWriter(str(self._temporary), cv2.VideoWriter.fourcc(*"mp4v"), self._fps, (width, height))
        if not writer.isOpened():
            raise InputError(
                f"{self._path}: a video of {width}x{height} at {self._fps:g} fps cannot be written "
                "there; choose another folder"
            )
        return writer
