"""A z-buffer in numpy: which face of a triangle mesh is seen in each pixel, and where on it."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

_CHUNK = 1_500_000
"""Candidate pixels handled at a time."""
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

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns of an image that starts at pixel (0, 0)."""
        return slice(self.y, self.y + self.height), slice(self.x, self.x + self.width)


@dataclass(frozen=True)
class Hits:
    """The pixels of a window that show a mesh."""

    rows: Int[np.ndarray, "n"]
    columns: Int[np.ndarray, "n"]
    """Of the window."""
    faces: Int[np.ndarray, "n"]
    barycentric: Float[np.ndarray, "n 3"]
    """Weights of the face's corners, corrected for perspective."""
    depths: Float[np.ndarray, "n"]

    def interpolated(
        self, values: Float[np.ndarray, "vertex channel"], faces: Int[np.ndarray, "face 3"]
    ) -> Float[np.ndarray, "n channel"]:
        """Values of the vertices, at the hits."""
        corners = faces[self.faces]
        total = self.barycentric[:, :1] * values[corners[:, 0]]
        total += self.barycentric[:, 1:2] * values[corners[:, 1]]
        total += self.barycentric[:, 2:] * values[corners[:, 2]]
        return total


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
    corners = pixels[faces] - np.array([window.x, window.y], float)
    areas = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # Image y points down, so an outward counter-clockwise face has a negative area in the picture.
    drawn = ((areas < 0.0) if cull else (areas != 0.0)) & (depths[faces] > 0.0).all(1)
    drawn &= (corners.max(1) >= 0.0).all(1) & (corners.min(1) <= [window.width - 1, window.height - 1]).all(1)
    chosen = np.flatnonzero(drawn)
    corners, areas = corners[chosen], areas[chosen]
    linear = (1.0 / depths if perspective else depths)[faces[chosen]]
    best = np.full(window.width * window.height, _EMPTY, np.int64)
    if len(chosen):
        slopes = _slopes(corners, areas, linear)
        face, row, first, count = _spans(corners, window)
        for part in _parts(count):
            _draw(best, face[part], row[part], first[part], count[part], slopes, window, perspective)
    return _hits(best, chosen, corners, areas, linear, window, perspective)


def _cross(a: Float[np.ndarray, "*n 2"], b: Float[np.ndarray, "*n 2"]) -> Float[np.ndarray, "*n"]:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _slopes(corners: np.ndarray, areas: np.ndarray, linear: np.ndarray) -> tuple[np.ndarray, ...]:
    """Of each face the plane a x + b y + c that its `linear` values at the corners lie on."""
    (x0, y0), (x1, y1), (x2, y2) = (corners[:, k].T for k in range(3))
    first, second = linear[:, 1] - linear[:, 0], linear[:, 2] - linear[:, 0]
    a = (first * (y2 - y0) - second * (y1 - y0)) / areas
    b = (second * (x1 - x0) - first * (x2 - x0)) / areas
    return a, b, linear[:, 0] - a * x0 - b * y0


def _spans(corners: np.ndarray, window: Window) -> tuple[np.ndarray, ...]:
    """The rows of pixels that the faces cover: face, row, first column and number of columns of each."""
    top = np.maximum(np.ceil(corners[..., 1].min(1)), 0).astype(np.int64)
    bottom = np.minimum(np.floor(corners[..., 1].max(1)), window.height - 1).astype(np.int64)
    rows = np.maximum(bottom - top + 1, 0)
    face = np.repeat(np.arange(len(corners)), rows)
    row = np.arange(len(face)) - np.repeat(np.cumsum(rows) - rows - top, rows)
    left, right = np.full(len(face), np.inf), np.full(len(face), -np.inf)
    for k in range(3):
        (xa, ya), (xb, yb) = corners[:, k].T, corners[:, (k + 1) % 3].T
        level = ya == yb
        slope = np.where(level, 0.0, (xb - xa) / np.where(level, 1.0, yb - ya))
        lower, upper = np.minimum(ya, yb)[face], np.maximum(ya, yb)[face]
        x = xa[face] + slope[face] * (row - ya[face])
        meets = (row >= lower) & (row <= upper)
        for end in (xa, xb):  # a level edge covers its whole length
            here = meets & level[face]
            left = np.where(here, np.minimum(left, end[face]), left)
            right = np.where(here, np.maximum(right, end[face]), right)
        left = np.where(meets, np.minimum(left, x), left)
        right = np.where(meets, np.maximum(right, x), right)
    first = np.ceil(np.clip(left - _SLACK, 0, window.width)).astype(np.int64)
    last = np.floor(np.clip(right + _SLACK, -1, window.width - 1)).astype(np.int64)
    count = last - first + 1
    kept = count > 0
    return face[kept], row[kept], first[kept], count[kept]


def _parts(counts: Int[np.ndarray, "n"]) -> list[slice]:
    """Runs of spans of about `_CHUNK` pixels."""
    ends = np.cumsum(counts)
    total = int(ends[-1]) if len(ends) else 0
    bounds = [0, *np.searchsorted(ends, np.arange(_CHUNK, total, _CHUNK)).tolist(), len(counts)]
    return [slice(a, b) for a, b in pairwise(bounds) if b > a]


def _draw(best, face, row, first, count, slopes, window, perspective) -> None:  # noqa: ANN001
    """Enter spans of pixels into the buffer of smallest keys (depth, face)."""
    a, b, c = slopes
    start = a[face] * first + b[face] * row + c[face]
    along = np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
    value = np.repeat(start, count) + np.repeat(a[face], count) * along
    depth = 1.0 / value if perspective else value
    key = (depth * _DEPTH_STEPS).astype(np.int64) << _FACE_BITS
    np.minimum.at(best, np.repeat(row * window.width + first, count) + along, key | np.repeat(face, count))


def _hits(best, chosen, corners, areas, linear, window, perspective) -> Hits:  # noqa: ANN001
    seen = np.flatnonzero(best != _EMPTY)
    face = best[seen] & ((1 << _FACE_BITS) - 1)
    rows, columns = seen // window.width, seen % window.width
    ax, ay, bx, by, cx, cy = corners.reshape(-1, 6)[face].T
    inverse = 1.0 / areas[face]
    weights = np.empty((len(seen), 3))
    weights[:, 0] = ((bx - columns) * (cy - rows) - (by - rows) * (cx - columns)) * inverse
    weights[:, 1] = ((cx - columns) * (ay - rows) - (cy - rows) * (ax - columns)) * inverse
    weights[:, 2] = 1.0 - weights[:, 0] - weights[:, 1]
    scaled = weights * linear[face]
    value = scaled.sum(1)
    if perspective:
        weights, value = scaled / value[:, None], 1.0 / value
    return Hits(rows, columns, chosen[face], weights.astype(np.float32), value)
