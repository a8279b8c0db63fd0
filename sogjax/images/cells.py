"""From a decoded frame to the grid of its smallest quad-tree cells, in one pass over the full-size pixels."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import UInt8


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
    def columns(self) -> int:
        """Number of cells across, the last one perhaps in part outside the image."""
        return -(-self.width // self.cell_size)

    @property
    def rows(self) -> int:
        """Number of cells down."""
        return -(-self.height // self.cell_size)

    def averages(self, image: UInt8[np.ndarray, "height width 3"]) -> UInt8[np.ndarray, "rows columns 3"]:
        """Mean colour of every cell, over the part of it that the image covers; channels stay as they are."""
        size = self.cell_size
        if size == 1:
            return image
        whole_columns, whole_rows = self.width // size, self.height // size
        averages = np.empty((self.rows, self.columns, 3), np.uint8)
        x, y = whole_columns * size, whole_rows * size
        parts = [
            (slice(0, y), slice(0, whole_rows), slice(0, x), slice(0, whole_columns)),
            (slice(0, y), slice(0, whole_rows), slice(x, None), slice(whole_columns, None)),
            (slice(y, None), slice(whole_rows, None), slice(0, x), slice(0, whole_columns)),
            (slice(y, None), slice(whole_rows, None), slice(x, None), slice(whole_columns, None)),
        ]
        for pixel_rows, cell_rows, pixel_columns, cell_columns in parts:
            target = averages[cell_rows, cell_columns]
            if target.size:
                shape = (target.shape[1], target.shape[0])
                source = image[pixel_rows, pixel_columns]
                averages[cell_rows, cell_columns] = cv2.resize(source, shape, interpolation=cv2.INTER_AREA)
        return averages


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


def padded_cells(
    image: UInt8[np.ndarray, "_height _width 3"], grid: CellGrid, shape: tuple[int, int]
) -> UInt8[np.ndarray, "rows columns 3"]:
    """RGB cells of one BGR image, padded to `shape`.

    Raises:
        ValueError: an image whose size is not its grid's.
    """
    if image.shape[:2] != (grid.height, grid.width):
        found = f"{image.shape[1]}x{image.shape[0]}"
        raise ValueError(f"an image is {found} pixels, its grid is for {grid.width}x{grid.height}")
    cells = np.zeros((*shape, 3), np.uint8)
    cells[: grid.rows, : grid.columns] = grid.averages(image)[..., ::-1]
    return cells
