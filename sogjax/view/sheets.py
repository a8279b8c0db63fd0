"""Contact sheets: the pictures of all cameras with their masks, side by side.

A sheet of one camera's background: what it is, how far it varies, where it is unknown, and what stands before it.

Silhouettes of a body over the masks of all cameras, cut to the subject.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

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


WIDEST = 20.0
"""Grey levels of spread that are shown white."""

Frame = tuple[UInt8[np.ndarray, "_h _w 3"], Float[np.ndarray, "_rows _columns"]]
"""A picture (BGR) and the probability of foreground."""


def background_sheet(
    title: str,
    picture: UInt8[np.ndarray, "_h _w 3"],
    spread: Float[np.ndarray, "_h _w"],
    known: Bool[np.ndarray, "_h _w"],
    frames: Mapping[int, Frame],
) -> UInt8[np.ndarray, "h w 3"]:
    """The sheet (BGR): background with what is unknown in red, spread, then each frame beside its foreground."""
    share = f"{float(1.0 - known.mean()):.1%} unknown"
    tiles = [
        Tile(picture, [(~known, RED)], f"background, {share}"),
        Tile(_grey(spread / WIDEST), [], f"spread, white: {WIDEST:g} grey levels or more"),
    ]
    for number, (image, probability) in frames.items():
        tiles.append(Tile(image, [], f"frame {number}"))
        tiles.append(Tile(_grey(probability), [], f"frame {number}: foreground, grey: unknown"))
    return contact_sheet(tiles, title)


def _grey(values: Float[np.ndarray, "_h _w"]) -> UInt8[np.ndarray, "_h _w 3"]:
    levels = np.rint(255.0 * np.clip(values, 0.0, 1.0)).astype(np.uint8)
    return cv2.cvtColor(levels, cv2.COLOR_GRAY2BGR)


BOTH, ONLY_MASK, ONLY_BODY = (70, 200, 70), (230, 120, 40), (50, 50, 240)
"""BGR: green, blue, red."""
LEGEND = "green: both, blue: only the mask, red: only the body"
BORDER = 0.08
"""Border around the subject, as a part of its size."""
TILE = 320
"""Pixels; the side of one camera's tile."""


@dataclass(frozen=True)
class SilhouetteView:
    """One camera: its picture, and mask and silhouette, which may be smaller than it."""

    camera: str
    iou: float
    image: UInt8[np.ndarray, "_h _w 3"]
    """BGR."""
    mask: Bool[np.ndarray, "rows columns"]
    silhouette: Bool[np.ndarray, "rows columns"]


def silhouette_sheet(views: Sequence[SilhouetteView], title: str) -> UInt8[np.ndarray, "h w 3"]:
    """One tile per camera (BGR), with its IoU, below a title and a legend."""
    tiles = [_tile(view) for view in views]
    return contact_sheet(tiles, f"{title} ({LEGEND})")


def _tile(view: SilhouetteView) -> Tile:
    both = view.mask | view.silhouette
    rows, columns = np.nonzero(both) if both.any() else np.nonzero(np.ones_like(both))
    side = int((1.0 + 2.0 * BORDER) * (1 + max(np.ptp(rows), np.ptp(columns))))
    corner = ((rows.min() + rows.max() - side) / 2, (columns.min() + columns.max() - side) / 2)
    cut = lambda picture: _square(picture, both.shape, corner, side)
    mask, silhouette = (cut(part.astype(np.float32)) > 0.5 for part in (view.mask, view.silhouette))
    regions = [(mask & silhouette, BOTH), (mask & ~silhouette, ONLY_MASK), (silhouette & ~mask, ONLY_BODY)]
    return Tile(_faded(cut(view.image)), regions, f"{view.camera}: {view.iou:.2f}", outlined=False)


def _faded(image: UInt8[np.ndarray, "y x 3"]) -> UInt8[np.ndarray, "y x 3"]:
    """Grey and dim, so that the regions' colours stand out."""
    return cv2.cvtColor(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) // 2, cv2.COLOR_GRAY2BGR)


def _square(picture: np.ndarray, shape: tuple[int, ...], corner: tuple[float, float], side: int) -> np.ndarray:
    """A square of a picture, at the size of a tile; `corner` and `side` count pixels of pictures of `shape`."""
    down, across = picture.shape[0] / shape[0], picture.shape[1] / shape[1]
    step = side / TILE
    # a tile's pixel centres in the picture; (0, 0) is the centre of the first pixel in both
    matrix = np.array(
        [
            [across * step, 0.0, across * (corner[1] + 0.5 * step) - 0.5],
            [0.0, down * step, down * (corner[0] + 0.5 * step) - 0.5],
        ]
    )
    return cv2.warpAffine(picture, matrix, (TILE, TILE), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
