"""The images of a camera as a folder of numbered files."""

import re
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from sogjax.data.image_file import IMAGE_SUFFIXES, read_image
from sogjax.errors import InputError


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
