"""Places where a body may be in one frame: the parts of space that look like it in all cameras, and how they lie."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.ndimage import gaussian_filter, maximum_filter

from sogjax.model.camera import NEAR, Camera, cells_at, project_points
from sogjax.model.program import compiled
from sogjax.model.rotation import axis_vector
from sogjax.scene.visual_hull import nearest_point
from sogjax.search.seen_frame import SeenFrame

MOST_VOXELS = 150_000
FINEST = 0.08
"""Metres between voxels, at least."""
REACH = 0.8
"""How far from the middle of the cameras places are looked for, as a part of the cameras' distance from it."""
HEIGHTS = 1.6
"""Metres above and below the middle of the cameras."""
SEEN_BY = 0.5
"""Part of the cameras (and two of them) that must see a place."""
TRUNK = 0.13
"""Metres, standard deviation: what is smoothed over to find the thickest part of a body."""
STANDING = 0.4
"""The same along the vertical, to find people who stand: feet and shadows of several on the floor are no body then."""
POOR = 0.3
"""Places that look less like the body than this part of the best are left out."""
APART = 0.4
"""Metres between places that count as different."""
BODY_REACH = 0.95
"""Metres around a place in which the rest of the body is."""
COLUMN = 0.2
"""Metres around the axis of somebody who stands, in which nobody else is."""
BESIDE = 0.25
"""Metres between two who stand and embrace, at least."""
BETWEEN = 0.35
"""Metres between the halves of a place from which on they may be two bodies that touch; of somebody with his arms
stretched out 0.3, of two who embrace 0.45."""
THICK, TALL = 0.35, 1.3
"""Metres: how far from a body's axis, and along it from the middle, what is seen is taken for its length."""


@dataclass(frozen=True)
class Place:
    """A place where a body may be."""

    centre: Float[np.ndarray, "3"]
    """Metres, world: of what looks like the body there."""
    axis: Float[np.ndarray, "3"]
    """The direction in which that is longest."""
    slenderness: float
    """How much longer it is than wide; 1 or more."""
    score: float
    length: float
    """Metres, how long it is in that direction: the height of somebody who stands straight."""


def places(frame: SeenFrame, up: str, count: int, among: int = 1) -> list[Place]:
    """The places that look most like the body, best first, at most `count`.

    `among` is how many actors there are: where so many people stand comes first then; where fewer are told apart, the
    best place may be two of them who touch, and its halves come before it.
    """
    grid, spacing = _voxels(frame.cameras, up)
    flat = jnp.asarray(grid.reshape(-1, 3), frame.odds.dtype)
    scores = np.array(_voxel_scores(frame, flat), float).reshape(grid.shape[:3])
    return places_among(grid, spacing, scores, up, count, among)


def likeness(frame: SeenFrame, point: Float[np.ndarray, "3"]) -> float:
    """How much what is seen at a point (metres, world) looks like the body: mean log odds; -2 where few cameras see."""
    return float(_voxel_scores(frame, jnp.asarray(point[None], frame.odds.dtype))[0])


def places_among(
    grid: Float[np.ndarray, "a b c 3"],
    spacing: float,
    scores: Float[np.ndarray, "a b c"],
    up: str,
    count: int,
    among: int,
) -> list[Place]:
    """`places` in voxels (metres, world), so far from each other, by how much each looks like the body."""
    bodies = _apart((_place_at(grid, scores, *peak) for peak in _peaks(scores, np.full(3, TRUNK / spacing))), count)
    if among == 1 or not bodies:
        return bodies
    tall = _peaks(scores, np.where(np.abs(axis_vector(up)) > 0.5, STANDING, TRUNK) / spacing)
    people = _apart((_standing_at(grid, scores, *peak, up) for peak in tall), among, BESIDE)
    if len(people) < among:
        people = _halves(grid, scores, bodies[0], up) or people
    return [*people, *bodies][:count]


def _peaks(scores: Float[np.ndarray, "a b c"], width: Float[np.ndarray, "3"]) -> list[tuple[tuple[int, ...], float]]:
    """The voxels around which the scores are highest, smoothed over so many voxels, and their values; best first."""
    smooth = gaussian_filter(np.maximum(scores, -1.0), width, mode="constant", cval=-1.0)
    peaks = np.argwhere((smooth == maximum_filter(smooth, size=3)) & (smooth > -0.9))
    values = smooth[tuple(peaks.T)]
    order = np.argsort(-values)
    return [(tuple(map(int, peak)), float(value)) for peak, value in zip(peaks[order], values[order], strict=True)]


def _apart(found: Iterable[Place], count: int, apart: float = APART) -> list[Place]:
    """The first of them that look nearly as much like the body as the best, so far (metres) from those before."""
    kept: list[Place] = []
    for place in found:
        if kept and (len(kept) == count or place.score < POOR * kept[0].score):
            break
        if all(np.linalg.norm(place.centre - other.centre) >= apart for other in kept):
            kept.append(place)
    return kept


def _place_at(grid: np.ndarray, scores: np.ndarray, peak: tuple[int, ...], score: float) -> Place:
    """The place around a peak: the centre and the longest direction of what looks like the body near it."""
    weights, points = np.maximum(scores - 0.5 * score, 0.0).reshape(-1), grid.reshape(-1, 3)
    centre = grid[peak]
    for radius in (0.6, BODY_REACH):
        near = (np.linalg.norm(points - centre, axis=1) < radius) * weights
        if near.sum() <= 0.0:
            return Place(grid[peak], np.array([0.0, 0.0, 1.0]), 1.0, score, 0.0)
        centre = near @ points / near.sum()
    off = points - centre
    values, vectors = np.linalg.eigh((near[:, None] * off).T @ off / near.sum())
    axis = vectors[:, 2]
    solid = (weights > 0.0) & (np.linalg.norm(np.cross(off, axis), axis=1) < THICK) & (np.abs(off @ axis) < TALL)
    low, high = np.percentile(off[solid] @ axis, (0.5, 99.5)) if solid.any() else (0.0, 0.0)
    return Place(centre, axis, float(np.sqrt(values[2] / max(values[1], 1e-9))), score, float(high - low))


def _standing_at(grid: np.ndarray, scores: np.ndarray, peak: tuple[int, ...], score: float, up: str) -> Place:
    """Where somebody stands around a peak: the middle of what looks like the body above and below it."""
    vertical, points = np.abs(axis_vector(up)), grid.reshape(-1, 3)
    off = points - grid[peak]
    along = off @ vertical
    near = (np.linalg.norm(off - along[:, None] * vertical, axis=1) < COLUMN) & (np.abs(along) < TALL)
    weights = near * np.maximum(scores - 0.5 * score, 0.0).reshape(-1)
    centre = weights @ points / weights.sum() if weights.sum() > 0.0 else grid[peak]
    return Place(centre, vertical, 1.0, score, 0.0)


def _halves(grid: np.ndarray, scores: np.ndarray, place: Place, up: str) -> list[Place]:
    """Both sides of a place across the horizontal direction in which it is widest, if they lie far apart."""
    level = np.abs(axis_vector(up)) < 0.5
    off = grid.reshape(-1, 3) - place.centre
    weights = np.maximum(scores - 0.5 * place.score, 0.0).reshape(-1) * (np.linalg.norm(off, axis=1) < BODY_REACH)
    if weights.sum() <= 0.0:
        return []
    flat = off[:, level]
    along = flat @ np.linalg.eigh((weights[:, None] * flat).T @ flat)[1][:, -1]
    sides = [weights * (side * along > 0.0) for side in (1.0, -1.0)]
    if min(side.sum() for side in sides) <= 0.0:
        return []
    middles = [(side @ off) / side.sum() for side in sides]
    if np.linalg.norm((middles[0] - middles[1])[level]) < BETWEEN:
        return []
    found = [replace(place, centre=place.centre + middle, slenderness=1.0) for middle in middles]
    return found if sides[0].sum() >= sides[1].sum() else found[::-1]


def _voxels(cameras: Camera, up: str) -> tuple[Float[np.ndarray, "a b c 3"], float]:
    """A grid of places (metres, world) around what the cameras look at, and its spacing."""
    world = np.asarray(cameras.camera_from_world, float)
    centres = -np.einsum("cji,cj->ci", world[:, :3, :3], world[:, :3, 3])
    middle = nearest_point(centres, world[:, 2, :3])
    distance = float(np.median(np.linalg.norm(centres - middle, axis=1)))
    reach = max(REACH * distance, 0.5)
    vertical = np.abs(axis_vector(up)) > 0.5
    extent = np.where(vertical, min(HEIGHTS, reach), reach)
    spacing = max(FINEST, float(np.prod(2.0 * extent) / MOST_VOXELS) ** (1.0 / 3.0))
    axes = [np.arange(-n, n + 1) * spacing for n in np.ceil(extent / spacing).astype(int)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1) + middle, spacing


@compiled
def _voxel_scores(frame: SeenFrame, points: Float[Array, "voxel 3"]) -> Float[Array, "voxel"]:
    """Mean log odds over the cameras that see a voxel; very low where too few do."""

    def one_camera(camera: Camera, odds: Array, size: Array) -> tuple[Array, Array]:
        pixels, depth = project_points(camera, points)
        cell, inside = cells_at(camera, size, jnp.where(depth[:, None] > NEAR, pixels, -1e6))
        window = lambda values: jax.lax.reduce_window(values, 0.0, jax.lax.add, (3, 3), (1, 1), "SAME") / 9.0
        return jnp.where(inside, window(odds)[cell[:, 1], cell[:, 0]], 0.0), inside.astype(odds.dtype)

    values, seen = jax.lax.map(lambda each: one_camera(*each), (frame.cameras, frame.whole, frame.cell_sizes))
    by = jnp.sum(seen, axis=0)
    enough = (by >= SEEN_BY * seen.shape[0] - 1e-3) & (by >= min(2, seen.shape[0]))
    return jnp.where(enough, jnp.sum(values, axis=0) / jnp.maximum(by, 1.0), -2.0)
