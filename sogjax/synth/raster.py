"""A z-buffer in numpy: which face of a triangle mesh is seen in each pixel, and where on it."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int

Corners = Float[np.ndarray, "2 3 face"]
"""Pixel x and y of the three corners of faces."""

_CHUNK = 1_500_000
"""Pixels drawn at a time."""
_EMPTY = np.iinfo(np.int64).max
_FACE_BITS = 24
_DEPTH_STEPS = 2.0**30
"""Steps of a depth key in a metre: depths up to 512 m fit beside the number of the face."""
_SLACK = 1e-9
"""Pixels by which spans are widened, so that rounding leaves no gap between two faces."""


@dataclass(frozen=True)
class Window:
    """A rectangle of pixels: the first column and row, and its size."""

    x: int
    y: int
    width: int
    height: int

    @classmethod
    def around(cls, pixels: Float[np.ndarray, "n 2"], limit: "Window", even: bool = True) -> "Window":
        """The smallest window within `limit` that holds the points, with a margin of a pixel or two.

        With `even`, it begins and ends at even pixels, so that it can be averaged two by two.
        """
        lower = np.floor(pixels.min(0)).astype(int) - 1
        upper = np.ceil(pixels.max(0)).astype(int) + 2
        if even:
            lower, upper = lower - lower % 2, upper + upper % 2
        x, y = max(int(lower[0]), limit.x), max(int(lower[1]), limit.y)
        right = min(int(upper[0]), limit.x + limit.width)
        bottom = min(int(upper[1]), limit.y + limit.height)
        return cls(x, y, max(right - x, 0), max(bottom - y, 0))

    def joined(self, other: "Window") -> "Window":
        """The smallest window that holds both; one without pixels counts for nothing."""
        whole = [window for window in (self, other) if window.width and window.height]
        if len(whole) < 2:
            return whole[0] if whole else self
        x, y = min(self.x, other.x), min(self.y, other.y)
        right = max(self.x + self.width, other.x + other.width)
        bottom = max(self.y + self.height, other.y + other.height)
        return Window(x, y, right - x, bottom - y)

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns of an image that starts at pixel (0, 0)."""
        return slice(self.y, self.y + self.height), slice(self.x, self.x + self.width)


@dataclass(frozen=True)
class Hits:
    """The pixels of a window that show a mesh."""

    rows: Int[np.ndarray, "n"]
    columns: Int[np.ndarray, "n"]
    """Rows and columns of the window."""
    faces: Int[np.ndarray, "n"]
    barycentric: Float[np.ndarray, "3 n"]
    """Weights of the face's corners, corrected for perspective."""
    depths: Float[np.ndarray, "n"]

    def where(self, kept: Bool[np.ndarray, "n"]) -> "Hits":
        """Only some of the hits."""
        return Hits(self.rows[kept], self.columns[kept], self.faces[kept], self.barycentric[:, kept], self.depths[kept])

    def interpolated(
        self, values: Float[np.ndarray, "vertex channel"], faces: Int[np.ndarray, "face 3"]
    ) -> Float[np.ndarray, "n channel"]:
        """Values of the vertices, at the hits."""
        corners = _taken(faces, self.faces)
        total = _taken(values, corners[:, 0]) * self.barycentric[0, :, None]
        for k in (1, 2):
            total += _taken(values, corners[:, k]) * self.barycentric[k, :, None]
        return total


def _taken(values: np.ndarray, rows: Int[np.ndarray, "n"]) -> np.ndarray:
    """Rows of an array, as `values[rows]` gives them in twice the time; there is no row that does not exist."""
    return np.take(values, rows, axis=0, mode="clip")


def rasterize(
    pixels: Float[np.ndarray, "vertex 2"],
    depths: Float[np.ndarray, "vertex"],
    faces: Int[np.ndarray, "face 3"],
    window: Window,
    perspective: bool = True,
    cull: bool = True,
) -> Hits:
    """Draw triangles into a window.

    Args:
        pixels: projected vertices; integer coordinates are the centres of pixels.
        depths: positive; faces with a corner at a depth of zero or less are left out.
        faces: corners, counter-clockwise as seen from outside the body.
        window: where to draw.
        perspective: whether depth is a distance from a pinhole (1/depth is linear in the picture) or that of a
            parallel projection.
        cull: leave out faces that are seen from behind.
    """
    corners = (pixels - np.array([window.x, window.y], float)).T[:, faces.T]
    areas = _areas(corners)
    # Image y points down, so an outward counter-clockwise face has a negative area in the picture.
    drawn = ((areas < 0.0) if cull else (areas != 0.0)) & (depths > 0.0)[faces.T].all(0)
    lower, upper = corners.min(1), corners.max(1)
    drawn &= (upper >= 0.0).all(0) & (lower[0] <= window.width - 1) & (lower[1] <= window.height - 1)
    chosen = np.flatnonzero(drawn)
    corners, areas = corners[:, :, chosen], areas[chosen]
    linear = (1.0 / depths if perspective else depths)[np.ascontiguousarray(faces[chosen].T)]
    best = np.full(window.width * window.height, _EMPTY, np.int64)
    if len(chosen):
        plane = _plane(corners, areas, linear)
        face, row, first, count = _spans(corners, window)
        for part in _parts(count):
            _draw(best, face[part], row[part], first[part], count[part], plane, window, perspective)
    return _hits(best, chosen, corners, areas, linear, window, perspective)


def _areas(corners: Corners) -> Float[np.ndarray, "face"]:
    """Twice the signed areas."""
    x, y = corners
    return (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0])


def _plane(corners: Corners, areas: np.ndarray, linear: np.ndarray) -> Float[np.ndarray, "3 face"]:
    """The planes a x + b y + c that the `linear` values at the corners of each face lie on."""
    x, y = corners
    first, second = linear[1] - linear[0], linear[2] - linear[0]
    a = (first * (y[2] - y[0]) - second * (y[1] - y[0])) / areas
    b = (second * (x[1] - x[0]) - first * (x[2] - x[0])) / areas
    return np.stack([a, b, linear[0] - a * x[0] - b * y[0]])


def _spans(corners: Corners, window: Window) -> tuple[Int[np.ndarray, "span"], ...]:
    """The rows of pixels that the faces cover: face, row, first column and number of columns of each."""
    x, y = corners
    top = np.maximum(np.ceil(y.min(0)), 0).astype(np.int64)
    bottom = np.minimum(np.floor(y.max(0)), window.height - 1).astype(np.int64)
    rows = np.maximum(bottom - top + 1, 0)
    face = np.repeat(np.arange(len(rows)), rows)
    row = np.arange(len(face)) - np.repeat(np.cumsum(rows) - rows - top, rows)
    left, right = np.full(len(face), np.inf), np.full(len(face), -np.inf)
    for k in range(3):
        # An edge along a row needs no care: the other two begin at its ends.
        drop = y[(k + 1) % 3] - y[k]
        level = drop == 0.0
        slope = (x[(k + 1) % 3] - x[k]) / np.where(level, 1.0, drop)
        along = row - y[k][face]
        meets = (along * (row - y[(k + 1) % 3][face]) <= 0.0) & ~level[face]
        crossing = x[k][face] + slope[face] * along
        left = np.minimum(left, np.where(meets, crossing, np.inf))
        right = np.maximum(right, np.where(meets, crossing, -np.inf))
    first = np.ceil(np.clip(left - _SLACK, 0, window.width)).astype(np.int64)
    last = np.floor(np.clip(right + _SLACK, -1, window.width - 1)).astype(np.int64)
    count = last - first + 1
    kept = np.flatnonzero(count > 0)
    return face[kept], row[kept], first[kept], count[kept]


def _parts(counts: Int[np.ndarray, "n"]) -> list[slice]:
    """Runs of spans of about `_CHUNK` pixels."""
    ends = np.cumsum(counts)
    total = int(ends[-1]) if len(ends) else 0
    bounds = [0, *np.searchsorted(ends, np.arange(_CHUNK, total, _CHUNK)).tolist(), len(counts)]
    return [slice(a, b) for a, b in pairwise(bounds) if b > a]


def _draw(
    best: Int[np.ndarray, "pixel"],
    face: Int[np.ndarray, "span"],
    row: Int[np.ndarray, "span"],
    first: Int[np.ndarray, "span"],
    count: Int[np.ndarray, "span"],
    plane: Float[np.ndarray, "3 face"],
    window: Window,
    perspective: bool,
) -> None:
    """Enter spans of pixels into the buffer of smallest keys (depth, face)."""
    a, b, c = plane[:, face]
    along = np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
    value = np.repeat(a * first + b * row + c, count) + np.repeat(a, count) * along
    depth = 1.0 / value if perspective else value
    key = (depth * _DEPTH_STEPS).astype(np.int64) << _FACE_BITS
    np.minimum.at(best, np.repeat(row * window.width + first, count) + along, key | np.repeat(face, count))


def _hits(
    best: Int[np.ndarray, "pixel"],
    chosen: Int[np.ndarray, "face"],
    corners: Corners,
    areas: Float[np.ndarray, "face"],
    linear: Float[np.ndarray, "3 face"],
    window: Window,
    perspective: bool,
) -> Hits:
    """The nearest face of each pixel and the weights of its corners there."""
    seen = np.flatnonzero(best != _EMPTY)
    face = best[seen] & ((1 << _FACE_BITS) - 1)
    rows = seen // window.width
    columns = seen - rows * window.width
    unit_planes = np.stack([_plane(corners, areas, np.eye(3)[:, k : k + 1]) for k in range(2)])
    weights = np.empty((3, len(seen)))
    for k in range(2):
        a, b, c = unit_planes[k]
        weights[k] = a[face] * columns + b[face] * rows + c[face]
    weights[2] = 1.0 - weights[0] - weights[1]
    scaled = weights * linear[:, face]
    value = scaled.sum(0)
    if perspective:
        weights, value = scaled / value, 1.0 / value
    return Hits(rows, columns, chosen[face], weights.astype(np.float32), value)
