"""Images that are read one after the other, whatever file they come from.

The images of a camera as a folder of numbered files.

Images selected by their presentation times, so that a video of varying rate becomes one of a fixed rate.

Phones and cameras that drop images write such videos: if counted, their images drift away from the others'.
"""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Generic, Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from sogjax.errors import InputError
from sogjax.io.image_file import IMAGE_SUFFIXES, read_image

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


class ImageFolder:
    """A folder of numbered images, all of one size."""

    def __init__(self, folder: Path, start: int):
        self._paths = iter(numbered_images(folder)[start:])
        self._shape: tuple[int, ...] | None = None

    def read(self) -> UInt8[np.ndarray, "height width 3"] | None:
        """The next image (BGR), or None after the last."""
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
        """Pass over the next image."""
        next(self._paths, None)

    def close(self) -> None:
        """Leave out what is left."""
        self._paths = iter(())


def numbered_images(folder: Path) -> list[Path]:
    """The images of a folder in the order of the numbers at the end of their names.

    Raises:
        InputError: a name without a number, a number that is missing, or one that stands twice.
    """
    paths = [path for path in visible_files(folder) if path.suffix.lower() in IMAGE_SUFFIXES]
    numbers: dict[int, Path] = {}
    for path in paths:
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


def visible_files(folder: Path) -> list[Path]:
    """What is in a folder, sorted by name, without hidden files; nothing where there is no such folder."""
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if not path.name.startswith("."))


MOST_FRAMES = 50
"""Per image on average: with more, a time stamp or the rate is wrong."""
FARTHEST = 0.75
"""Frames that an image may lie away from the time it stands for; a video of even images of any rate stays below."""


def picked_images(times: Float[np.ndarray, "image"], fps: float) -> Int[np.ndarray, "frame"]:
    """For each frame of a fixed rate, counted from the first image, the image nearest in time.

    Args:
        times: of the images, in seconds, ascending.
        fps: frames per second.

    Raises:
        ValueError: there are no images, or `MOST_FRAMES` times as many frames as images.
    """
    if not len(times) or (times[-1] - times[0]) * fps > MOST_FRAMES * len(times):
        raise ValueError(f"{len(times)} images do not make a video of {fps:g} frames per second")
    wanted = _frame_times(times, fps)
    after = np.searchsorted(times, wanted).clip(0, len(times) - 1)
    before = (after - 1).clip(0)
    return np.where(wanted - times[before] <= times[after] - wanted, before, after)


def frames_without_image(
    times: Float[np.ndarray, "image"], fps: float, picked: Int[np.ndarray, "frame"]
) -> Bool[np.ndarray, "frame"]:
    """Whether the image nearest to a frame is that of another time: its own was lost."""
    return np.abs(times[picked] - _frame_times(times, fps)) * fps > FARTHEST


def _frame_times(times: Float[np.ndarray, "image"], fps: float) -> Float[np.ndarray, "frame"]:
    count = int((times[-1] - times[0]) * fps + 0.5) + 1
    return times[0] + np.arange(count) / fps


class PickedImages(Generic[Image]):
    """Some images of a source, each as often as its number stands in a row of numbers that does not fall.

    All images before them are decoded: where the rate varies, no decoder finds an image by its number.
    """

    def __init__(self, images: ImageStream[Image], numbers: Sequence[int]) -> None:
        self._images, self._numbers, self._next = images, iter(numbers), 0
        self._image: Image | None = None

    def read(self) -> Image | None:
        """The image of the next number, or None after the last."""
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
        """Pass over the next image, which may be wanted again later."""
        self.read()

    def close(self) -> None:
        """Release the file."""
        self._images.close()
