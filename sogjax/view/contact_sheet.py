"""Contact sheets: the pictures of all cameras with their masks, side by side."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from sogjax.view.tiles import grid_for

WIDTH = 1600
"""Pixels; the sheet's largest width."""
TITLE_HEIGHT = 26
TINT = 0.45
"""Part of a tinted pixel that is the tint."""
GREEN, RED, WHITE = (80, 220, 60), (60, 60, 235), (255, 255, 255)
"""BGR."""


@dataclass(frozen=True)
class Tile:
    """One camera's picture with regions painted over it."""

    image: UInt8[np.ndarray, "_h _w 3"]
    """BGR."""
    regions: Sequence[tuple[Bool[np.ndarray, "_h _w"], tuple[int, int, int]]]
    """What to paint, with its colour (BGR); later ones over earlier ones."""
    text: str
    outlined: bool = True


def contact_sheet(tiles: Sequence[Tile], title: str, width: int = WIDTH) -> UInt8[np.ndarray, "h w 3"]:
    """All tiles in a grid (BGR), each with its text, below a title."""
    sizes = [(tile.image.shape[1], tile.image.shape[0]) for tile in tiles]
    grid = grid_for(sizes, width)
    columns, rows = grid.size
    canvas = np.zeros((TITLE_HEIGHT + rows, columns, 3), np.uint8)
    for k, (tile, size) in enumerate(zip(tiles, sizes, strict=True)):
        area = grid.fit(k, size).place(canvas[TITLE_HEIGHT:], tile.image)
        for region, color in tile.regions:
            _paint(area, region, color, tile.outlined)
        write(area, tile.text, (6, 16))
    write(canvas, title, (6, 18))
    return canvas


def write(area: np.ndarray, text: str, corner: tuple[int, int]) -> None:
    """Small white text on a dark rim, readable on any picture."""
    for color, thick in (((0, 0, 0), 3), (WHITE, 1)):
        cv2.putText(area, text, corner, cv2.FONT_HERSHEY_SIMPLEX, 0.45, color, thick, cv2.LINE_AA)


def _paint(
    area: UInt8[np.ndarray, "y x 3"], region: Bool[np.ndarray, "_h _w"], color: tuple[int, int, int], outlined: bool
) -> None:
    size = (area.shape[1], area.shape[0])
    inside = cv2.resize(region.astype(np.float32), size, interpolation=cv2.INTER_AREA) > 0.5
    tinted = (1.0 - TINT) * area[inside] + TINT * np.array(color, np.float32)
    area[inside] = np.rint(tinted).astype(np.uint8)
    if outlined:
        outlines, _ = cv2.findContours(inside.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        cv2.drawContours(area, outlines, -1, color, 1)
