"""Sheets of pictures: a camera's background, what stands in front, silhouettes of a body, and the body itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from sogjax.io.image_file import write_image
from sogjax.io.recording import Recording
from sogjax.io.video import read_chosen
from sogjax.scene.cells import CellGrid
from sogjax.scene.occluders import HiddenFrom
from sogjax.view.tiles import BLUE, RED, Tile, contact_sheet

Picture = UInt8[np.ndarray, "_h _w 3"]
"""BGR."""


def background_sheet(
    title: str,
    picture: Picture,
    spread: Float[np.ndarray, "_h _w"],
    known: Bool[np.ndarray, "_h _w"],
    frames: Mapping[int, tuple[Picture, Float[np.ndarray, "_rows _columns"]]],
) -> UInt8[np.ndarray, "h w 3"]:
    """A camera's background, red where it is unknown, its spread, and frames beside their probability of foreground."""
    white = 20.0
    share = f"{float(1.0 - known.mean()):.1%} unknown"
    tiles = [
        Tile(picture, [(~known, RED)], f"background, {share}"),
        Tile(_grey(spread / white), [], f"spread, white: {white:g} grey levels or more"),
    ]
    for number, (image, probability) in frames.items():
        tiles.append(Tile(image, [], f"frame {number}"))
        tiles.append(Tile(_grey(probability), [], f"frame {number}: foreground, grey: unknown"))
    return contact_sheet(tiles, title)


def _grey(values: Float[np.ndarray, "_h _w"]) -> Picture:
    levels = np.rint(255.0 * np.clip(values, 0.0, 1.0)).astype(np.uint8)
    return cv2.cvtColor(levels, cv2.COLOR_GRAY2BGR)


BOTH, ONLY_MASK, ONLY_BODY, UNTOLD = (70, 200, 70), (230, 120, 40), (50, 50, 240), (60, 200, 230)
"""BGR: green, blue, red, yellow."""
LEGEND = "green: both, blue: only the mask, red: only the body, yellow: the body where a mask says nothing"
TILE = 320
"""Side of one camera's tile in pixels."""


@dataclass(frozen=True)
class SilhouetteView:
    """One camera: its picture, and mask and silhouette, which may be smaller, and where the mask says nothing."""

    camera: str
    iou: float
    image: Picture
    mask: Bool[np.ndarray, "rows columns"]
    silhouette: Bool[np.ndarray, "rows columns"]
    untold: Bool[np.ndarray, "rows columns"]


def silhouette_sheet(views: Sequence[SilhouetteView], title: str) -> UInt8[np.ndarray, "h w 3"]:
    """Silhouettes of a body over the masks of all cameras (BGR), cut to the subject, each with its IoU."""
    return contact_sheet([_silhouette_tile(view) for view in views], f"{title} ({LEGEND})")


def _silhouette_tile(view: SilhouetteView) -> Tile:
    """The subject with a border of 8 % of its size."""
    both = view.mask | view.silhouette
    rows, columns = np.nonzero(both) if both.any() else np.nonzero(np.ones_like(both))
    side = int(1.16 * (1 + max(np.ptp(rows), np.ptp(columns))))
    corner = ((rows.min() + rows.max() - side) / 2, (columns.min() + columns.max() - side) / 2)
    cut = lambda picture: _square(picture, both.shape, corner, side)
    parts = (view.mask, view.silhouette, view.untold)
    mask, silhouette, untold = (cut(part.astype(np.float32)) > 0.5 for part in parts)
    only = silhouette & ~mask
    colored = ((mask & silhouette, BOTH), (mask & ~silhouette, ONLY_MASK), (only & ~untold, ONLY_BODY))
    regions = [*colored, (only & untold, UNTOLD)]
    dim = cv2.cvtColor(cv2.cvtColor(cut(view.image), cv2.COLOR_BGR2GRAY) // 2, cv2.COLOR_GRAY2BGR)
    return Tile(dim, regions, f"{view.camera}: {view.iou:.2f}", outlined=False)


def _square(picture: np.ndarray, shape: tuple[int, ...], corner: tuple[float, float], side: int) -> np.ndarray:
    """A square of a picture, at the size of a tile; `corner` and `side` count pixels of pictures of `shape`."""
    scale = np.array([picture.shape[1] / shape[1], picture.shape[0] / shape[0]])
    step = side / TILE
    # a tile's pixel centres in the picture; (0, 0) is the centre of the first pixel in both
    matrix = np.column_stack([np.diag(scale * step), scale * (np.array(corner[::-1]) + 0.5 * step) - 0.5])
    return cv2.warpAffine(picture, matrix, (TILE, TILE), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)


HEIGHT, BORDER = 640, 24
"""Height and border of a body's picture in pixels."""
BACKGROUND = (120, 120, 120)
"""BGR."""
DISC = 1.1774
"""Radius of a disc in units of sigma: where a Gaussian has fallen to a half."""


def body_picture(
    means: Float[np.ndarray, "blob 3"], sigmas: Float[np.ndarray, "blob"], colors: Float[np.ndarray, "blob 3"]
) -> UInt8[np.ndarray, "h w 3"]:
    """A body as coloured discs (BGR), from the front and from its left side.

    Args:
        means: of the blobs in the body's own frame, x forward, y left, z up; metres.
        sigmas: metres.
        colors: sRGB in 0..1.
    """
    low, high = (means - DISC * sigmas[:, None]).min(axis=0), (means + DISC * sigmas[:, None]).max(axis=0)
    scale = (HEIGHT - 2 * BORDER) / max(float(high[2] - low[2]), 1e-3)
    below = scale * (high[2] - means[:, 2])
    # right and towards the viewer: seen from the front, the body's left is on the right
    sides = [(means[:, 1], means[:, 0]), (-means[:, 0], means[:, 1])]
    return np.hstack([_discs(scale * right, below, scale * DISC * sigmas, colors, towards) for right, towards in sides])


def _discs(
    right: np.ndarray, below: np.ndarray, radii: np.ndarray, colors: np.ndarray, towards: np.ndarray
) -> UInt8[np.ndarray, "h w 3"]:
    """Discs with dark rims, places and radii in pixels, those nearer to the viewer over the others."""
    left = (right - radii).min()
    canvas = np.full((HEIGHT, round(float((right + radii).max() - left)) + 2 * BORDER, 3), BACKGROUND, np.uint8)
    bits = 4  # OpenCV's fixed-point numbers
    fixed = lambda value: round(float(value) * 2**bits)
    for k in np.argsort(towards):
        centre = (fixed(BORDER + right[k] - left), fixed(BORDER + below[k]))
        blue, green, red = (round(float(255 * np.clip(value, 0.0, 1.0))) for value in colors[k, ::-1])
        cv2.circle(canvas, centre, fixed(radii[k]), (blue, green, red), -1, cv2.LINE_AA, bits)
        cv2.circle(canvas, centre, fixed(radii[k]), (40, 40, 40), 1, cv2.LINE_AA, bits)
    return canvas


def write_occluders(
    path: Path, recording: Recording, grids: Sequence[CellGrid], hidden: HiddenFrom, frame: int, title: str
) -> Path:
    """Write the pictures of a frame with the cells that hide something; returns the path.

    Raises:
        InputError: a picture cannot be read, or the file cannot be written.
    """
    _, images = next(read_chosen(recording, [frame]))
    tiles = []
    for name, image, grid, of_camera in zip(recording.rig.names, images, grids, hidden, strict=True):
        inside = of_camera[: grid.rows, : grid.columns]
        shown = np.zeros((grid.height, grid.width, 3), np.uint8) if image is None else np.asarray(image)
        tiles.append(Tile(shown, [(grid.enlarged(np.isfinite(inside)), BLUE)], f"{name}: {_told(inside)}"))
    write_image(path, contact_sheet(tiles, f"{recording.name}, frame {frame}: {title}"))
    return path


def _told(hidden: Float[np.ndarray, "rows columns"]) -> str:
    known = hidden[np.isfinite(hidden)]
    if not known.size:
        return "nothing"
    share = known.size / hidden.size
    what = "all" if not known.any() else f"what is behind {np.median(known[known > 0.0]):.1f} m (median)"
    return f"{share:.1%} of the cells hide {what}"
