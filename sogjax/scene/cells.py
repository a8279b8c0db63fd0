"""From a decoded frame to the grid of its smallest quad-tree cells, in one pass over the full-size pixels."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from sogjax.model.yuv_picture import ColorStandard, YuvPicture

WEIGHTS: dict[ColorStandard, tuple[float, float]] = {"601": (0.299, 0.114), "709": (0.2126, 0.0722)}
"""The weights of red and blue in the brightness; the rest is green's."""
DROPPED = 0.5
"""Grey levels that FFmpeg's converter loses on average with every product, whose fractions it drops. They are taken off
here too, so that cells do not depend on how a video was read."""


def rgb_of_means(
    luma: Float[np.ndarray, "rows columns"],
    blue_difference: Float[np.ndarray, "rows columns"],
    red_difference: Float[np.ndarray, "rows columns"],
    standard: ColorStandard,
    full_range: bool,
) -> UInt8[np.ndarray, "rows columns 3"]:
    """RGB of cells from the means of a video's own channels.

    The conversion is linear, so that the mean of the converted pixels is the converted mean: except where pixels of a
    cell are brighter or more colourful than red, green and blue can be, which are cut off one by one in a picture.
    """
    channels = cv2.merge([luma, blue_difference, red_difference])
    rgb = cv2.transform(channels, _conversion(standard, full_range))
    return np.rint(np.clip(rgb, 0.0, 255.0)).astype(np.uint8)


@lru_cache
def _conversion(standard: ColorStandard, full_range: bool) -> Float[np.ndarray, "3 4"]:
    """The matrix to red, green and blue, with an offset in the last column (ITU-T H.273, Section 8.3)."""
    red, blue = WEIGHTS[standard]
    green = 1.0 - red - blue
    bright, colorful, black = (1.0, 1.0, 0.0) if full_range else (255.0 / 219.0, 255.0 / 224.0, 16.0)
    of_blue, of_red = 2.0 * (1.0 - blue) * colorful, 2.0 * (1.0 - red) * colorful
    matrix = np.array(
        [
            [bright, 0.0, of_red],
            [bright, -of_blue * blue / green, -of_red * red / green],
            [bright, of_blue, 0.0],
        ]
    )
    products = np.array([1.0, 2.0, 1.0]) + (0.0 if full_range else 1.0)
    offset = -matrix @ np.array([black, 128.0, 128.0]) - DROPPED * products
    return np.column_stack([matrix, offset]).astype(np.float32)


FINE = 4
"""Squares of so many pixels are averaged in floating point."""


@dataclass(frozen=True)
class CellGrid:
    """How the images of one size are cut into cells: the leaves of a quad-tree of a given depth.

    The root is the smallest power-of-two square that holds the image; a cell is `root / 2^depth` pixels wide, at
    least one. The last column and row may be covered by the image only in part.
    """

    width: int
    height: int
    cell_size: int
    """Side of a cell in pixels."""

    @classmethod
    def from_depth(cls, width: int, height: int, depth: int) -> "CellGrid":
        """The grid of a quad-tree of `depth` levels below the root (Section 4.1)."""
        root = 1 << (max(width, height) - 1).bit_length()
        return cls(width, height, max(root >> depth, 1))

    @property
    def depth(self) -> int:
        """Levels of the quad-tree below the root."""
        return (max(self.width, self.height) - 1).bit_length() - self.cell_size.bit_length() + 1

    @property
    def columns(self) -> int:
        """Number of cells across, the last one perhaps in part outside the image."""
        return -(-self.width // self.cell_size)

    @property
    def rows(self) -> int:
        """Number of cells down."""
        return -(-self.height // self.cell_size)

    def enlarged(self, cells: Bool[np.ndarray, "rows columns"]) -> Bool[np.ndarray, "height width"]:
        """A mask of cells as one of the image."""
        return np.kron(cells, np.ones((self.cell_size, self.cell_size), bool))[: self.height, : self.width]

    def averages(self, image: UInt8[np.ndarray, "height width 3"]) -> UInt8[np.ndarray, "rows columns 3"]:
        """Mean colour of every cell, over the part of it that the image covers; channels stay as they are.

        Within a grey level: it is rounded at every halving.
        """
        averages = np.empty((self.rows, self.columns, 3), np.uint8)
        self._fill(averages, image, block_means)
        return averages

    def fine_averages(self, plane: UInt8[np.ndarray, "height width"]) -> Float[np.ndarray, "rows columns"]:
        """Mean of one channel over every cell, as `averages`, but without rounding in the end."""
        averages = np.empty((self.rows, self.columns), np.float32)
        self._fill(averages, plane, fine_block_means)
        return averages

    def halved(self) -> "CellGrid":
        """The grid of these cells in an image of half the width and height, both of which are even."""
        return CellGrid(self.width // 2, self.height // 2, self.cell_size // 2)

    def _fill(self, averages: np.ndarray, image: np.ndarray, means: Callable[[np.ndarray, int], np.ndarray]) -> None:
        """The whole cells by `means`, those that the image covers in part one by one."""
        size = self.cell_size
        columns, rows = self.width // size, self.height // size
        x, y = columns * size, rows * size
        if columns and rows:
            averages[:rows, :columns] = means(image[:y, :x], size)
        for pixel_rows, cell_rows, pixel_columns, cell_columns in (
            (slice(0, y), slice(0, rows), slice(x, None), slice(columns, None)),
            (slice(y, None), slice(rows, None), slice(0, x), slice(0, columns)),
            (slice(y, None), slice(rows, None), slice(x, None), slice(columns, None)),
        ):
            target = averages[cell_rows, cell_columns]
            if target.size:
                source = image[pixel_rows, pixel_columns].astype(averages.dtype, copy=False)
                averages[cell_rows, cell_columns] = _reduced(source, (target.shape[1], target.shape[0]))


def block_means(image: UInt8[np.ndarray, "_h _w *channel"], size: int) -> UInt8[np.ndarray, "_rows _columns *channel"]:
    """Means over squares of `size` pixels, a power of two, by halving: OpenCV is quick at nothing else.

    It rounds halves up; every other halving is of the negative, so that a noisy picture does not become brighter.
    """
    while size >= 4:
        image = ~_half(~_half(image))
        size //= 4
    return _half(image) if size == 2 else image


def fine_block_means(plane: UInt8[np.ndarray, "_h _w"], size: int) -> Float[np.ndarray, "_rows _columns"]:
    """Means over squares of `size` pixels, as `block_means`, but without rounding where few numbers are left."""
    coarse = max(size // FINE, 1)
    fine = block_means(plane, coarse).astype(np.float32)
    for _ in range((size // coarse).bit_length() - 1):
        fine = _half(fine)
    return fine


def _half(image: np.ndarray) -> np.ndarray:
    return _reduced(image, (image.shape[1] // 2, image.shape[0] // 2))


def _reduced(image: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    return cv2.resize(image, shape, interpolation=cv2.INTER_AREA)


def stack_cells(
    images: list[UInt8[np.ndarray, "_height _width 3"]], grids: tuple[CellGrid, ...]
) -> UInt8[np.ndarray, "camera rows columns 3"]:
    """RGB cells of one BGR image per camera, padded to the largest grid; the padding is never used.

    Raises:
        ValueError: an image whose size is not its grid's.
    """
    shape = stack_shape(grids)
    return np.stack([padded_cells(image, grid, shape) for image, grid in zip(images, grids, strict=True)])


def stack_shape(grids: tuple[CellGrid, ...]) -> tuple[int, int]:
    """Rows and columns of the largest grid."""
    return max(grid.rows for grid in grids), max(grid.columns for grid in grids)


def inside_pictures(grids: Sequence[CellGrid], shape: tuple[int, ...]) -> Float[np.ndarray, "camera rows columns"]:
    """1 for the cells of each picture, 0 for the padding to `shape` (rows, columns)."""
    inside = np.zeros((len(grids), *shape), np.float32)
    for k, grid in enumerate(grids):
        inside[k, : grid.rows, : grid.columns] = 1.0
    return inside


def padded_cells(
    image: UInt8[np.ndarray, "_height _width 3"] | YuvPicture, grid: CellGrid, shape: tuple[int, int]
) -> UInt8[np.ndarray, "rows columns 3"]:
    """RGB cells of one image (BGR, or in a video's own colours), padded to `shape`.

    Raises:
        ValueError: an image whose size is not its grid's.
    """
    if image.shape[:2] != (grid.height, grid.width):
        found = f"{image.shape[1]}x{image.shape[0]}"
        raise ValueError(f"an image is {found} pixels, its grid is for {grid.width}x{grid.height}")
    cells = np.zeros((*shape, 3), np.uint8)
    cells[: grid.rows, : grid.columns] = _rgb_cells(image, grid)
    return cells


def _rgb_cells(
    image: UInt8[np.ndarray, "_height _width 3"] | YuvPicture, grid: CellGrid
) -> UInt8[np.ndarray, "rows columns 3"]:
    if isinstance(image, YuvPicture) and grid.cell_size == 1:
        image = image.bgr()
    if not isinstance(image, YuvPicture):
        return grid.averages(image)[..., ::-1]
    half = grid.halved()
    blue, red = half.fine_averages(image.blue_difference), half.fine_averages(image.red_difference)
    return rgb_of_means(grid.fine_averages(image.luma), blue, red, image.standard, image.full_range)
