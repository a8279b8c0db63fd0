"""Pictures of several cameras side by side: how large each tile is and where, and contact sheets of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

SHEET_WIDTH = 1600
"""Largest width of a contact sheet in pixels."""
TITLE_HEIGHT = 26
GREEN, RED, BLUE = (80, 220, 60), (60, 60, 235), (235, 110, 40)
"""BGR."""


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

    def area(self, canvas: UInt8[np.ndarray, "h w 3"], image: np.ndarray | None) -> UInt8[np.ndarray, "y x 3"]:
        """The rectangle as a view of the canvas, with a picture drawn into it; None leaves it as it is."""
        area = canvas[self.top : self.top + self.height, self.left : self.left + self.width]
        if image is not None:
            area[:] = shrink(image, (self.width, self.height))
        return area


def grid_for(image_sizes: Sequence[tuple[int, int]], width: int, height: int | None = None) -> TileGrid:
    """A grid at most `width` pixels wide, and `height` high if it is given, for pictures of such sizes, none enlarged.

    Its shape comes as near to 16:9 as its number of tiles allows.
    """
    count = len(image_sizes)
    aspect = float(np.median([w / h for w, h in image_sizes]))
    rows = lambda n: -(-count // n)
    empty = lambda n: (n * rows(n) - count) / count
    columns = min(range(1, count + 1), key=lambda n: abs(np.log(n * aspect / rows(n) / (16 / 9))) + empty(n))
    tile = min(width // columns, max(w for w, _ in image_sizes))
    if height is not None:
        tile = min(tile, int(height // rows(columns) * aspect))
    even = lambda side: max(2, int(side) // 2 * 2)
    return TileGrid(columns, rows(columns), (even(tile), even(round(tile / aspect))))


def shrink(image: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """The picture at a smaller size: halved as long as that is possible, which is fast, then resampled."""
    while image.shape[1] >= 2 * size[0] and image.shape[0] >= 2 * size[1]:
        half = (image.shape[1] // 2, image.shape[0] // 2)
        even = image[: 2 * half[1], : 2 * half[0]]
        image = cv2.resize(even, half, interpolation=cv2.INTER_AREA)
    if (image.shape[1], image.shape[0]) == size:
        return image
    return cv2.resize(image, size, interpolation=cv2.INTER_LINEAR)


def write_label(area: np.ndarray, text: str, corner: tuple[int, int], size: float = 0.42) -> None:
    """Write small white text on a dark rim, readable on any picture."""
    for color, thick in (((0, 0, 0), 3), ((255, 255, 255), 1)):
        cv2.putText(area, text, corner, cv2.FONT_HERSHEY_SIMPLEX, size, color, thick, cv2.LINE_AA)


@dataclass(frozen=True)
class Tile:
    """One camera's picture with regions painted over it."""

    image: UInt8[np.ndarray, "_h _w 3"]
    """BGR."""
    regions: Sequence[tuple[Bool[np.ndarray, "_h _w"], tuple[int, int, int]]]
    """What to paint, with its colour (BGR); later ones over earlier ones."""
    text: str
    outlined: bool = True


def contact_sheet(tiles: Sequence[Tile], title: str) -> UInt8[np.ndarray, "h w 3"]:
    """All tiles in a grid (BGR), each with its text, below a title."""
    sizes = [(tile.image.shape[1], tile.image.shape[0]) for tile in tiles]
    grid, canvas = titled_grid(sizes, title)
    for k, (tile, size) in enumerate(zip(tiles, sizes, strict=True)):
        area = grid.fit(k, size).area(canvas[TITLE_HEIGHT:], tile.image)
        for region, color in tile.regions:
            _paint(area, region, color, tile.outlined)
        write_label(area, tile.text, (6, 16))
    return canvas


def titled_grid(sizes: Sequence[tuple[int, int]], title: str) -> tuple[TileGrid, UInt8[np.ndarray, "h w 3"]]:
    """A grid for pictures of such sizes, and a black sheet for it whose uppermost `TITLE_HEIGHT` rows are the title."""
    grid = grid_for(sizes, SHEET_WIDTH)
    canvas = np.zeros((TITLE_HEIGHT + grid.size[1], grid.size[0], 3), np.uint8)
    write_label(canvas, title, (6, 18))
    return grid, canvas


def _paint(
    area: UInt8[np.ndarray, "y x 3"], region: Bool[np.ndarray, "_h _w"], color: tuple[int, int, int], outlined: bool
) -> None:
    """Tint a region a little less than by half."""
    inside = cv2.resize(region.astype(np.float32), area.shape[1::-1], interpolation=cv2.INTER_AREA) > 0.5
    area[inside] = np.rint(0.55 * area[inside] + 0.45 * np.array(color, np.float32)).astype(np.uint8)
    if outlined:
        outlines, _ = cv2.findContours(inside.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(area, outlines, -1, color, 1)
