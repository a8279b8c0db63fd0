"""The images of one camera, one after the other: a video, or a folder of numbered images."""

import hashlib
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Float, UInt8

from sogjax.errors import InputError
from sogjax.io.files import visible_files
from sogjax.io.image_file import IMAGE_SUFFIXES, read_image
from sogjax.io.plane_video import plane_video
from sogjax.io.recording_files import IMAGES, SYNCHRONIZED, VIDEOS
from sogjax.io.video_file import VideoFile, look_at_video
from sogjax.model.yuv_picture import YuvPicture

VIDEO_SUFFIXES = (".mp4", ".avi", ".mkv", ".mov")

Bgr = UInt8[np.ndarray, "height width 3"]
Image = TypeVar("Image", covariant=True)


@runtime_checkable
class ImageStream(Protocol[Image]):
    """The images of one camera, in their order."""

    def read(self) -> Image | None:
        """The next image, or None after the last."""
        ...

    def skip(self) -> None:
        """Pass over the next image."""
        ...

    def close(self) -> None:
        """Release the file."""
        ...


def find_sources(folder: Path) -> dict[str, Path]:
    """The cameras' videos in `videos/` (in FreeMoCap's recordings `synchronized_videos/`) or folders in `images/`.

    Raises:
        InputError: there are none, or a camera has two.
    """
    found = videos_in(VIDEOS.of(folder)) or videos_in(SYNCHRONIZED.of(folder))
    found += [path for path in visible_files(IMAGES.of(folder)) if path.is_dir()]
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


def videos_in(folder: Path) -> list[Path]:
    """The videos in a folder, sorted by name."""
    return [path for path in visible_files(folder) if path.is_file() and path.suffix.lower() in VIDEO_SUFFIXES]


def open_source(path: Path, start: int = 0, threads: int = 1, picked: Sequence[int] | None = None) -> ImageStream[Bgr]:
    """The images of a video or of an image folder from its frame `start` on; `threads` decode a video.

    Where images are `picked`, frame k is the file's image `picked[k]`; the numbers must not fall.

    Raises:
        InputError: the video or folder cannot be opened.
    """
    if picked is not None:
        return _PickedImages(open_source(path, 0, threads), picked[start:])
    return _ImageFolder(path, start) if path.is_dir() else VideoFile(path, start, threads)


def open_with_least_work(
    path: Path, start: int = 0, threads: int = 1, picked: Sequence[int] | None = None, smooth: bool = False
) -> ImageStream[Bgr | YuvPicture]:
    """What `open_source` gives, but the images of a video stay in its own colours where they can be read so.

    Unless they are to be `smooth`, some show the edges of the codec's blocks, which cells do not see.
    """
    video = None if path.is_dir() else plane_video(path, 0 if picked is not None else start, threads, smooth)
    if video is None:
        return open_source(path, start, threads, picked)
    return video if picked is None else _PickedImages(video, picked[start:])


@dataclass(frozen=True)
class SourceInfo:
    """What a camera's images are: rate (None for image folders), number, and (width, height)."""

    fps: float | None
    num_frames: int
    size: tuple[int, int]
    times: Float[np.ndarray, "frame"] | None = None
    """When each image is to be shown, in seconds, if the file says so and is not too large to read."""

    @property
    def longest_gap(self) -> float:
        """The longest time between two images, in units of the middle one: 2 where one is missing, 1 if not known."""
        gaps = np.diff(np.zeros(0) if self.times is None else self.times)
        middle = float(np.median(gaps)) if len(gaps) else 0.0
        return float(gaps.max()) / middle if middle > 0.0 else 1.0


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
    fps, num_frames, times = look_at_video(path)
    return SourceInfo(fps, num_frames, size, times)


def numbered_images(folder: Path) -> list[Path]:
    """The images of a folder in the order of the numbers at the end of their names.

    Raises:
        InputError: a name without a number, a number that is missing, or one that stands twice.
    """
    numbers: dict[int, Path] = {}
    for path in visible_files(folder):
        if path.suffix.lower() not in IMAGE_SUFFIXES:
            continue
        match = re.search(r"([0-9]{1,18})$", path.stem)
        if match is None:
            raise InputError(f"{path}: its name does not end in a number; call the images 000000.png and so on")
        number = int(match[1])
        if number in numbers:
            raise InputError(f"{path}: has the number of {numbers[number].name}; keep one image per frame")
        numbers[number] = path
    if not numbers:
        raise InputError(f"{folder}: holds no images ({' '.join(IMAGE_SUFFIXES)}); put 000000.png ... there")
    first = min(numbers)
    for number in range(first, first + len(numbers)):
        if number not in numbers:
            raise InputError(f"{folder}: the image number {number} is missing; number them without a gap")
    return [numbers[number] for number in sorted(numbers)]


def fingerprint(source: Path) -> str:
    """The state of a video or a folder of images: a digest of names, sizes and times of last change."""
    return files_fingerprint(numbered_images(source) if source.is_dir() else [source])


def files_fingerprint(files: Sequence[Path]) -> str:
    """The state of files: a digest of their names, sizes and times of last change."""
    looked = [(file.name, (state := file.stat()).st_size, state.st_mtime_ns) for file in files]
    return hashlib.sha256(json.dumps(looked).encode()).hexdigest()


class _ImageFolder:
    """A folder of numbered images, all of one size."""

    def __init__(self, folder: Path, start: int):
        self._paths = iter(numbered_images(folder)[start:])
        self._shape: tuple[int, ...] | None = None

    def read(self) -> Bgr | None:
        path = next(self._paths, None)
        if path is None:
            return None
        image = read_image(path)
        if self._shape not in (None, image.shape):
            size = f"{image.shape[1]}x{image.shape[0]}"
            raise InputError(f"{path}: is {size}, unlike the images before it; make all of one size")
        self._shape = image.shape
        return image

    def skip(self) -> None:
        next(self._paths, None)

    def close(self) -> None:
        self._paths = iter(())


class _PickedImages(Generic[Image]):
    """Some images of a source, each as often as its number stands in a row of numbers that does not fall.

    All images before them are decoded: where the rate varies, no decoder finds an image by its number.
    """

    def __init__(self, images: ImageStream[Image], numbers: Sequence[int]) -> None:
        self._images, self._numbers, self._next = images, iter(numbers), 0
        self._image: Image | None = None

    def read(self) -> Image | None:
        number = next(self._numbers, None)
        if number is None:
            return None
        while self._next < number:
            self._images.skip()
            self._next += 1
        if self._next == number:
            self._image = self._images.read()
            self._next += 1
        return self._image

    def skip(self) -> None:
        self.read()  # the same image may be wanted again

    def close(self) -> None:
        self._images.close()
