"""Silhouettes of a body over the masks of all cameras, cut to the subject."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from sogjax.view.contact_sheet import Tile, contact_sheet

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
