"""Pictures of several cameras side by side: how large each tile is, and where."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, UInt8

WIDEST = 16 / 9
"""The shape that a grid comes as near to as its number of tiles allows."""


@dataclass(frozen=True)
class TileGrid:
    """Equal tiles, filled row by row; each picture is fitted into its tile and centred."""

    columns: int
    rows: int
    tile_size: tuple[int, int]
    """Width and height in pixels, both even."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the whole grid in pixels."""
        return self.columns * self.tile_size[0], self.rows * self.tile_size[1]

    def corner(self, index: int) -> tuple[int, int]:
        """The left upper pixel (x, y) of a tile."""
        row, column = divmod(index, self.columns)
        return column * self.tile_size[0], row * self.tile_size[1]

    def fit(self, index: int, image_size: tuple[int, int]) -> "Fit":
        """Where a picture of `image_size` goes in tile `index`."""
        scale = min(tile / image for tile, image in zip(self.tile_size, image_size, strict=True))
        width, height = (max(1, round(scale * side)) for side in image_size)
        x, y = self.corner(index)
        left, top = x + (self.tile_size[0] - width) // 2, y + (self.tile_size[1] - height) // 2
        return Fit(left, top, width, height, width / image_size[0], height / image_size[1])


@dataclass(frozen=True)
class Fit:
    """A rectangle of the grid and the scale of the picture in it."""

    left: int
    top: int
    width: int
    height: int
    scale_x: float
    scale_y: float

    def pixels(self, pixels: Float[np.ndarray, "... 2"]) -> Float[np.ndarray, "... 2"]:
        """Pixels of the picture, as pixels of the rectangle; (0, 0) is the first pixel's centre in both."""
        scale = np.array([self.scale_x, self.scale_y], pixels.dtype)
        return (pixels + pixels.dtype.type(0.5)) * scale - pixels.dtype.type(0.5)

    def place(self, canvas: UInt8[np.ndarray, "h w 3"], image: np.ndarray) -> UInt8[np.ndarray, "y x 3"]:
        """Draw a picture into the rectangle; returns the rectangle as a view of the canvas."""
        area = canvas[self.top : self.top + self.height, self.left : self.left + self.width]
        area[:] = shrink(image, (self.width, self.height))
        return area


def grid_for(
    image_sizes: list[tuple[int, int]], width: int, columns: int | None = None, widest: float = WIDEST
) -> TileGrid:
    """A grid at most `width` pixels wide for pictures of the given sizes, none of them enlarged."""
    count = len(image_sizes)
    aspect = float(np.median([w / h for w, h in image_sizes]))
    if columns is None:
        rows = lambda n: -(-count // n)
        empty = lambda n: (n * rows(n) - count) / count
        columns = min(range(1, count + 1), key=lambda n: abs(np.log(n * aspect / rows(n) / widest)) + empty(n))
    tile = min(width // columns, max(w for w, _ in image_sizes))
    even = lambda side: max(2, int(side) // 2 * 2)
    return TileGrid(columns, -(-count // columns), (even(tile), even(round(tile / aspect))))


def shrink(image: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """The picture at a smaller size: halved as long as that is possible, which is fast, then resampled."""
    while image.shape[1] >= 2 * size[0] and image.shape[0] >= 2 * size[1]:
        half = (image.shape[1] // 2, image.shape[0] // 2)
        even = image[: 2 * half[1], : 2 * half[0]]
        image = cv2.resize(even, half, interpolation=cv2.INTER_AREA)
    if (image.shape[1], image.shape[0]) == size:
        return image
    return cv2.resize(image, size, interpolation=cv2.INTER_LINEAR)
