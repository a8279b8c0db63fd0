"""What cameras show when nobody stands before them: pictures, how far they vary, where they are known; as cells too."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import cv2
import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Float, UInt8

from sogjax.scene.background_difference import EDGE_NOISE, channel_max
from sogjax.scene.cells import CellGrid, stack_shape
from sogjax.scene.plates import FittedPlate


class BackgroundCells(eqx.Module):
    """What every cell shows when nobody stands before it; padded to the largest camera, where nothing is known."""

    colors: UInt8[Array | np.ndarray, "camera rows columns 3"]
    """The background's RGB, 0 to 255."""
    spread: Float[Array | np.ndarray, "camera rows columns"]
    """Standard deviation of a channel, in units of the full range (0..1)."""
    known: Bool[Array | np.ndarray, "camera rows columns"]
    """False where nothing may be concluded from the colour."""


NOISE_FLOOR = 2.0
"""Grey levels: rounding, compression and noise of a still scene together are seldom less."""
KNOWN_SHARE = 0.75
"""A cell is known if so much of it is."""

CALM, CALM_SIDE = 1.3, 7
"""Where the spread, over squares of so many pixels, is less than this many times a camera's usual one, something stands
still."""

Origin = Literal["picture", "clip"]


@dataclass(frozen=True)
class BackgroundImage:
    """The background of one camera, at any size."""

    picture: UInt8[np.ndarray, "_h _w 3"]
    """The background's BGR, 0 to 255."""
    spread: Float[np.ndarray, "_h _w"]
    """Standard deviation of a grey level: noise, what flickers, and edges that are not quite in place."""
    known: Bool[np.ndarray, "_h _w"]
    """False where the background was never seen, or may be the subject."""
    origin: Origin
    """A photograph of the empty scene, or learnt from the clip."""
    furnished: bool = False
    """Whether much that never moves stands beside the people and is nobody: a table, chairs."""

    @classmethod
    def from_photograph(cls, picture: UInt8[np.ndarray, "_h _w 3"]) -> "BackgroundImage":
        """The background from a photograph of the empty scene, known everywhere."""
        spread = np.hypot(NOISE_FLOOR, EDGE_NOISE * local_contrast(picture)).astype(np.float32)
        return cls(picture, spread, np.ones(picture.shape[:2], bool), "picture")

    @classmethod
    def from_plate(cls, plate: FittedPlate) -> "BackgroundImage":
        """The background from a photograph that was held against the videos."""
        return replace(cls.from_photograph(plate.picture), known=plate.known)

    def filled(self, other: "BackgroundImage") -> "BackgroundImage":
        """With what another one knows where this one does not."""
        size = (self.known.shape[1], self.known.shape[0])
        resized = lambda values: cv2.resize(values, size, interpolation=cv2.INTER_LINEAR)
        there = ~self.known & (resized(other.known.astype(np.float32)) > 0.99)
        picture = np.where(there[..., None], resized(other.picture), self.picture)
        spread = np.where(there, resized(other.spread.astype(np.float32)), self.spread)
        return replace(self, picture=picture, spread=spread, known=self.known | there)

    def calm_as(self, first: "BackgroundImage") -> "BackgroundImage":
        """With what another one, which was learnt from all of each picture, tells of furniture.

        Where this one knows nothing, that one says how far colours vary.
        """
        spread = cv2.resize(first.spread.astype(np.float32), self.known.shape[::-1], interpolation=cv2.INTER_LINEAR)
        return replace(self, spread=np.where(self.known, self.spread, spread), furnished=first.furnished)

    @property
    def calm(self) -> Bool[np.ndarray, "_h _w"]:
        """Beside furniture, where the background is not known, and its most frequent colour hardly varies.

        Elsewhere nothing is: who stands still hardly moves.
        """
        if not self.furnished or not self.known.any():
            return np.zeros_like(self.known)
        usual = float(np.median(self.spread[self.known]))
        return ~self.known & (cv2.blur(self.spread, (CALM_SIDE, CALM_SIDE)) < CALM * usual)

    @classmethod
    def nothing(cls, width: int, height: int) -> "BackgroundImage":
        """A background of which nothing is known."""
        empty = np.zeros((height, width), np.float32)
        return cls(np.zeros((height, width, 3), np.uint8), empty + NOISE_FLOOR, empty > 0, "clip")


def local_contrast(picture: np.ndarray) -> Float[np.ndarray, "_h _w"]:
    """The largest difference of neighbouring pixels, in grey levels."""
    return channel_max(cv2.morphologyEx(picture, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))).astype(np.float32)


def stack_background(backgrounds: Sequence[BackgroundImage], grids: Sequence[CellGrid]) -> BackgroundCells:
    """The cells of one background per camera, whatever their sizes, padded to the largest grid."""
    rows, columns = stack_shape(tuple(grids))
    colors = np.zeros((len(grids), rows, columns, 3), np.uint8)
    spread = np.zeros((len(grids), rows, columns), np.float32)
    known = np.zeros((len(grids), rows, columns), bool)
    for camera, (background, grid) in enumerate(zip(backgrounds, grids, strict=True)):
        part = (camera, slice(grid.rows), slice(grid.columns))
        colors[part], spread[part], known[part] = background_cells_of(background, grid)
    return BackgroundCells(colors, spread, known)


def background_cells_of(
    background: BackgroundImage, grid: CellGrid
) -> tuple[UInt8[np.ndarray, "rows columns 3"], Float[np.ndarray, "rows columns"], Bool[np.ndarray, "rows columns"]]:
    """Colours (RGB), spread (0..1) and `known` of the cells of one camera, averaged over what is known of each."""
    weight = background.known.astype(np.float32)
    share = cell_means(weight, grid)
    safe = np.maximum(share, 1e-6)
    light = cell_means(background.picture.astype(np.float32) * weight[..., None], grid) / safe[..., None]
    spread = cell_means(background.spread.astype(np.float32) * weight, grid) / safe / 255.0
    known = share >= KNOWN_SHARE
    colors = np.rint(np.where(known[..., None], light, 0.0)).clip(0, 255).astype(np.uint8)[..., ::-1]
    return colors, np.where(known, spread, NOISE_FLOOR / 255.0).astype(np.float32), known


def cell_means(values: Float[np.ndarray, "..."], grid: CellGrid) -> Float[np.ndarray, "..."]:
    """Mean over every cell of a grid of what is given at another size of the same picture.

    By summed areas, so a cell may end within a pixel of the smaller picture.
    """
    rows = _edges(grid.rows, grid.cell_size, grid.height, values.shape[0])
    columns = _edges(grid.columns, grid.cell_size, grid.width, values.shape[1])
    sums = cv2.integral(values, sdepth=cv2.CV_64F)
    across = _between(_between(sums, rows, 0), columns, 1)
    whole = np.diff(across, axis=0)
    area = np.outer(np.diff(rows), np.diff(columns))
    return (np.diff(whole, axis=1) / area.reshape(*area.shape, *([1] * (values.ndim - 2)))).astype(np.float32)


def _edges(count: int, cell_size: int, full: int, small: int) -> Float[np.ndarray, "edge"]:
    """Where cells begin and end, in pixels of the smaller picture; the last one ends with it."""
    return np.minimum(np.arange(count + 1) * cell_size, full) * (small / full)


def _between(sums: Float[np.ndarray, "..."], places: Float[np.ndarray, "edge"], axis: int) -> np.ndarray:
    """Linear interpolation of sums at places between pixels."""
    low = np.minimum(places.astype(int), sums.shape[axis] - 2)
    part = (places - low).reshape([-1 if k == axis else 1 for k in range(sums.ndim)])
    return (1.0 - part) * np.take(sums, low, axis) + part * np.take(sums, low + 1, axis)
