"""From an implicit surface to a triangle mesh: naive surface nets on a regular grid."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float, Int

Points = Float[np.ndarray, "n 3"]
Field = Callable[[Points], Float[np.ndarray, "n"]]
"""A signed function of points: negative inside, about a distance in metres near the surface."""

_CORNERS = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)])
_EDGES = np.array([(a, b) for a in range(8) for b in range(a + 1, 8) if (a ^ b) in (1, 2, 4)])


def surface_nets(
    field: Field, lower: Float[np.ndarray, "3"], upper: Float[np.ndarray, "3"], spacing: float
) -> tuple[Points, Int[np.ndarray, "face 3"]]:
    """Vertices (metres) and triangles, outward side counter-clockwise, of the surface where `field` is zero.

    One vertex a grid cell that the surface crosses (Gibson's surface nets), pulled onto the surface.
    """
    shape = np.ceil((upper - lower) / spacing).astype(int) + 1
    axes = [lower[k] + spacing * np.arange(shape[k]) for k in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3)
    values = _sample(field, grid, shape, spacing)
    cells, corners = _crossed_cells(values)
    vertices = lower + spacing * (cells + _edge_centres(corners))
    faces = _quads(values, cells)
    for _ in range(2):
        vertices = _pulled(field, _evened(vertices, faces))
    vertices = _pulled(field, vertices)
    return vertices, np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])


def gradient(field: Field, points: Points, step: float = 1e-4) -> Points:
    """Slope of the field, by differences."""
    here = field(points)
    return np.stack([field(points + shift) - here for shift in step * np.eye(3)], -1) / step


def _sample(field: Field, grid: Points, shape: Int[np.ndarray, "3"], spacing: float) -> np.ndarray:
    """The field on the grid, exact only near the surface: far blocks keep the value of a coarse sample."""
    blocks = np.stack(np.unravel_index(np.arange(len(grid)), shape), -1) // 4
    key = np.ravel_multi_index(blocks.T, shape // 4 + 1)
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    centres = grid[first] + 1.5 * spacing
    coarse = field(centres)
    values = coarse[inverse]
    near = np.abs(values) < 5.0 * spacing
    values[near] = field(grid[near])
    return values.reshape(shape)


def _crossed_cells(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the cells the surface crosses and the field at their eight corners."""
    size = np.array(values.shape) - 1
    views = [values[a : a + size[0], b : b + size[1], c : c + size[2]] for a, b, c in _CORNERS]
    inside = sum((view < 0.0).astype(int) for view in views)
    cells = np.argwhere((inside > 0) & (inside < 8))
    corners = np.stack([view[tuple(cells.T)] for view in views], -1)
    return cells, corners


def _edge_centres(corners: np.ndarray) -> np.ndarray:
    """The mean of the crossings on a cell's edges, in units of the cell."""
    a, b = corners[:, _EDGES[:, 0]], corners[:, _EDGES[:, 1]]
    crossed = (a < 0.0) != (b < 0.0)
    share = np.where(crossed, a / np.where(crossed, a - b, 1.0), 0.0)
    start, end = _CORNERS[_EDGES[:, 0]], _CORNERS[_EDGES[:, 1]]
    points = start[None] + share[..., None] * (end - start)[None]
    return (points * crossed[..., None]).sum(1) / crossed.sum(1)[:, None]


def _quads(values: np.ndarray, cells: np.ndarray) -> Int[np.ndarray, "quad 4"]:
    """The vertices of the four cells around every grid edge that the surface crosses."""
    number = np.full(np.array(values.shape) - 1, -1)
    number[tuple(cells.T)] = np.arange(len(cells))
    quads = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        low = np.take(values, np.arange(values.shape[axis] - 1), axis) < 0.0
        high = np.take(values, np.arange(1, values.shape[axis]), axis) < 0.0
        edges = np.argwhere(low != high)
        leaving = low[tuple(edges.T)]
        around = []
        for du, dv in ((1, 1), (0, 1), (0, 0), (1, 0)):
            cell = edges.copy()
            cell[:, u] -= du
            cell[:, v] -= dv
            around.append(number[tuple(cell.T)])
        quad = np.stack(around, -1)
        quads.append(np.where(leaving[:, None], quad, quad[:, ::-1]))
    return np.concatenate(quads)


def _evened(vertices: Points, quads: Int[np.ndarray, "quad 4"]) -> Points:
    """Each vertex moved half-way to the mean of its neighbours."""
    total, count = np.zeros_like(vertices), np.zeros(len(vertices))
    for k in range(4):
        np.add.at(total, quads[:, k], vertices[quads[:, (k + 1) % 4]])
        np.add.at(count, quads[:, k], 1.0)
    return 0.5 * (vertices + total / count[:, None])


def _pulled(field: Field, vertices: Points) -> Points:
    """A Newton step onto the surface."""
    slope = gradient(field, vertices)
    return vertices - slope * (field(vertices) / np.maximum((slope**2).sum(-1), 0.05))[:, None]
