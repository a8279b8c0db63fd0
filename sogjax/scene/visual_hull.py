"""A coarse visual hull: the part of space that no camera's region leaves out, and whether masks agree with it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Shaped
from scipy.ndimage import binary_opening

from sogjax.model.camera import NEAR, Camera, distort, near_picture, project_points
from sogjax.model.program import compiled
from sogjax.scene.background_difference import reduced_mask, widened

VOXELS = 64
"""Voxels along each side of the cube."""
SIDE = 1.3
"""The cube's side, in units of the subject's size."""
LOW = 0.2
"""Height above the floor, in units of the subject's size, below which something may be a shadow."""
LOW_VOXELS = round(LOW / SIDE * VOXELS)
"""`LOW` in voxels."""
DEPTHS_EVERY = 61
"""One voxel in so many tells how far away a cube is; no divisor of their number along a side."""
MANY = 5
"""From so many cameras on, one of them may miss a part of the subject, or a movement."""


@dataclass(frozen=True)
class Cube:
    """A cube of voxels that holds a subject; lengths in metres, world."""

    centre: Float[np.ndarray, "3"]
    size: float
    """The subject's, roughly."""

    @property
    def spacing(self) -> float:
        """Distance of neighbouring voxels."""
        return SIDE * self.size / VOXELS

    @property
    def points(self) -> Float[np.ndarray, "voxel 3"]:
        """The voxels' centres; the last axis varies fastest."""
        steps = self._from_centre(np.arange(VOXELS))
        return (np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1) + self.centre).reshape(-1, 3)

    def middle(self, voxels: Bool[np.ndarray, "voxel"]) -> Float[np.ndarray, "3"]:
        """The mean of the centres of some voxels; there must be one."""
        return self.centre + self._from_centre(np.argwhere(voxels.reshape(3 * (VOXELS,))).mean(axis=0))

    def _from_centre(self, places: np.ndarray) -> np.ndarray:
        """How far voxels are from the cube's centre along an axis, by their places there."""
        return (places - (VOXELS - 1) / 2) * self.spacing


@dataclass(frozen=True)
class VoxelPixels:
    """Where the voxels of a cube lie in one camera's picture."""

    rows: np.ndarray
    columns: np.ndarray
    inside: Bool[np.ndarray, "voxel"]
    shape: tuple[int, int]
    footprint: int
    """Width of a voxel in pixels."""

    def hits(self, region: Bool[np.ndarray, "rows columns"]) -> Bool[np.ndarray, "voxel"]:
        """Which voxels lie in a region, or outside of the picture, where nothing is known."""
        return region[self.rows, self.columns] | ~self.inside

    def shows(self, region: Bool[np.ndarray, "rows columns"]) -> Bool[np.ndarray, "voxel"]:
        """Which voxels lie in a region of the picture."""
        return region[self.rows, self.columns] & self.inside

    def silhouette_of(self, voxels: Bool[np.ndarray, "voxel"]) -> Bool[np.ndarray, "rows columns"]:
        """The picture of some of the voxels."""
        shown = voxels & self.inside
        canvas = np.zeros(self.shape, np.uint8)
        canvas[self.rows[shown], self.columns[shown]] = 1
        element = np.ones((self.footprint + 2, self.footprint + 2), np.uint8)
        return cv2.morphologyEx(canvas, cv2.MORPH_CLOSE, element) > 0


def resized(camera: Camera, size: tuple[float | int, float | int]) -> Camera:
    """The camera of the same pictures at another width and height, in whatever these are counted."""
    before, matrix = np.asarray(camera.image_size), np.array(camera.intrinsics)
    scale = (np.asarray(size) / before).astype(before.dtype)
    matrix[:2, :2] *= scale[:, None]
    matrix[:2, 2] = (matrix[:2, 2] + 0.5) * scale - 0.5
    changed = (jnp.asarray(matrix), jnp.asarray(scale * before))
    return eqx.tree_at(lambda c: (c.intrinsics, c.image_size), camera, changed)


def cube_around(masks: Sequence[Bool[np.ndarray, "_h _w"]], cameras: Sequence[Camera]) -> Cube:
    """The cube that holds the subject of most of the masks.

    Its centre is the point with the least sum of distances to the rays through the masks' centres, so that a camera
    whose mask is wrong does not move it far.
    """
    rays = [central_ray(mask, camera) for mask, camera in zip(masks, cameras, strict=True)]
    eyes, directions, angles = (np.array(part) for part in zip(*rays, strict=True))
    centre, weights = np.zeros(3), np.ones(len(rays))
    for _ in range(10):
        centre = nearest_point(eyes, directions, weights)
        distances = np.linalg.norm(np.cross(directions, centre - eyes), axis=1)
        weights = 1.0 / np.maximum(distances, 0.05)
    return Cube(centre, float(np.median(np.linalg.norm(centre - eyes, axis=1) * angles)))


def nearest_point(
    points: Float[np.ndarray, "line 3"],
    directions: Float[np.ndarray, "line 3"],
    weights: Float[np.ndarray, "line"] | None = None,
) -> Float[np.ndarray, "3"]:
    """The point with the least sum of (weighted) squared distances to lines through points, along unit directions.

    Where all lines are parallel, it is the one of their nearest points that is least far from the origin.
    """
    across = np.eye(3)[None] - directions[:, :, None] * directions[:, None, :]
    across = across if weights is None else weights[:, None, None] * across
    return np.linalg.lstsq(across.sum(axis=0), np.einsum("lij,lj->i", across, points), rcond=1e-9)[0]


def central_ray(mask: Bool[np.ndarray, "_h _w"], camera: Camera) -> tuple[np.ndarray, np.ndarray, float]:
    """Eye, direction of the mask's centre, and the mask's larger side as a tangent."""
    rows, columns = np.nonzero(mask)
    matrix, pose = np.asarray(camera.intrinsics, float), np.asarray(camera.camera_from_world, float)
    direction = pose[:3, :3].T @ np.linalg.solve(matrix, [columns.mean(), rows.mean(), 1.0])
    side = max(np.ptp(rows) / matrix[1, 1], np.ptp(columns) / matrix[0, 0])
    return -pose[:3, :3].T @ pose[:3, 3], direction / np.linalg.norm(direction), float(side)


def voxel_pixels(cube: Cube, camera: Camera, shape: tuple[int, int]) -> VoxelPixels:
    """Project the voxels into a picture of `shape` (rows, columns)."""
    dtype = camera.intrinsics.dtype
    placed = (jnp.asarray(cube.centre, dtype), jnp.asarray(cube.spacing, dtype))
    found = _picture_places(camera, *placed, jnp.asarray(np.array(shape, np.int32)))
    rows, columns, inside, depths = (np.asarray(part) for part in found)
    nearest = max(float(np.median(depths)), NEAR)
    footprint = int(np.ceil(cube.spacing * float(camera.focal_length) / nearest))
    return VoxelPixels(rows.astype(np.intp), columns.astype(np.intp), inside, shape, min(footprint, 64))


@compiled
def _picture_places(
    camera: Camera, centre: Float[Array, "3"], spacing: Float[Array, ""], shape: Int[Array, "2"]
) -> tuple[Int[Array, "voxel"], Int[Array, "voxel"], Bool[Array, "voxel"], Float[Array, "some"]]:
    """Rows and columns of the pictures as recorded, 0 outside of them; what is inside; depths of some of the voxels.

    Far outside the picture, where a lens model folds back, the depth is 0.
    """
    steps = (jnp.arange(VOXELS, dtype=spacing.dtype) - (VOXELS - 1) / 2) * spacing
    offsets = jnp.stack(jnp.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    pixels, depths = project_points(camera, offsets + centre[None])
    depths = jnp.where(near_picture(camera, pixels, 0.5), depths, 0.0)
    seen = depths > NEAR
    columns, rows = jnp.rint(jnp.where(seen[:, None], distort(camera, pixels), -1.0)).astype(jnp.int32).T
    inside = seen & (rows >= 0) & (rows < shape[0]) & (columns >= 0) & (columns < shape[1])
    return jnp.where(inside, rows, 0), jnp.where(inside, columns, 0), inside, depths[::DEPTHS_EVERY]


def upright(voxels: Shaped[np.ndarray, "voxel"], up: Float[np.ndarray, "3"]) -> Shaped[np.ndarray, "x y z"]:
    """What is known of voxels as a block whose last axis points up."""
    axis = int(np.argmax(np.abs(up)))
    block = np.moveaxis(voxels.reshape(3 * (VOXELS,)), axis, 2)
    return block if up[axis] > 0 else np.flip(block, 2)


def from_upright(block: Bool[np.ndarray, "x y z"], up: Float[np.ndarray, "3"]) -> Bool[np.ndarray, "voxel"]:
    """The voxels of a block whose last axis points up."""
    axis = int(np.argmax(np.abs(up)))
    return np.moveaxis(block if up[axis] > 0 else np.flip(block, 2), 2, axis).reshape(-1)


def without_floor(occupied: Bool[np.ndarray, "voxel"], up: Float[np.ndarray, "3"]) -> Bool[np.ndarray, "voxel"]:
    """The voxels without those that lie low on the floor with nothing above them, as a shadow does."""
    if not occupied.any():
        return occupied
    kept = upright(occupied, up).copy()
    top = int(np.percentile(np.nonzero(kept)[2], 2)) + LOW_VOXELS
    kept[:, :, :top] &= binary_opening(kept, np.ones((1, 1, LOW_VOXELS)))[:, :, :top]
    return from_upright(kept, up)


AGREEING = 0.75
"""Share of a mask that the hull of all cameras must cover. Good masks have 0.93 and more, and so had the
rough ones of a real recording; a mask without legs leaves the others with about a half."""
OWN_COVERAGE = 0.2
"""Weight of a camera's own coverage: where the rest agrees as well without either of two, the worse one is wrong."""

Mask = Bool[np.ndarray, "_h _w"]


@dataclass(frozen=True)
class MaskHull:
    """The visual hulls of masks of one subject: of all of them, or of some.

    All lie in one cube, into whose pictures its voxels are projected once.
    """

    masks: dict[int, Mask]
    cube: Cube
    pixels: dict[int, VoxelPixels]
    outside: dict[int, Bool[np.ndarray, "voxel"]]
    """The voxels that each camera rules out."""

    @classmethod
    def of_masks(
        cls, masks: Mapping[int, Mask], cameras: Mapping[int, Camera], hidden: Mapping[int, Mask] | None = None
    ) -> "MaskHull":
        """The hulls of masks by cameras of pictures of their size; where a camera's view is hidden, all is allowed."""
        cube = cube_around([*masks.values()], [cameras[k] for k in masks])
        pixels = {k: voxel_pixels(cube, cameras[k], mask.shape) for k, mask in masks.items()}
        # A thin limb may lie between the centres of voxels, so masks are widened by half of one.
        near = {k: widened(mask, pixels[k].footprint // 2) for k, mask in masks.items()}
        near |= {k: near[k] | mask for k, mask in (hidden or {}).items() if k in near}
        return cls(dict(masks), cube, pixels, {k: ~pixels[k].hits(mask) for k, mask in near.items()})

    @classmethod
    def of_subject(
        cls, masks: Mapping[int, Mask], cameras: Mapping[int, Camera], hidden: Mapping[int, Mask] | None = None
    ) -> "MaskHull":
        """The hulls of masks of whole pictures, at the working size."""
        small = {k: reduced_mask(mask) for k, mask in masks.items()}
        shrunk = {k: resized(cameras[k], (mask.shape[1], mask.shape[0])) for k, mask in small.items()}
        return cls.of_masks(small, shrunk, {k: reduced_mask(mask) for k, mask in (hidden or {}).items() if k in small})

    def hull(self, cameras: Sequence[int]) -> Bool[np.ndarray, "voxel"]:
        """The voxels that the masks of some of the cameras hold."""
        return ~np.any([self.outside[k] for k in cameras], axis=0)

    def coverages(self, cameras: Sequence[int]) -> dict[int, float]:
        """The share of each of these masks that the hull of them covers."""
        hull = self.hull(cameras)
        shown = {k: (self.pixels[k].silhouette_of(hull) & self.masks[k]).sum() for k in cameras}
        return {k: float(pixels / max(self.masks[k].sum(), 1)) for k, pixels in shown.items()}


def disagreeing_cameras(
    masks: Mapping[int, Mask], cameras: Mapping[int, Camera], hidden: Mapping[int, Mask] | None = None
) -> dict[int, float]:
    """Cameras whose masks the others do not confirm, and which share of each mask the hull covers without them.

    Points of space that all masks hold (the visual hull) project onto the whole of every mask if the masks show one
    thing: "silhouette coherence" (Hernandez, Schmitt and Cipolla, PAMI 2007). While some mask is covered too little,
    the camera is taken out without which the rest agree best, until two are left, of which either may be wrong.
    `hidden` is where something stands in front, by camera: there a mask says nothing.
    """
    left, hull = list(masks), MaskHull.of_subject(masks, cameras, hidden)
    out: dict[int, float] = {}
    covered = hull.coverages(left)
    while len(left) > 2 and min(covered.values()) < AGREEING:
        without = {camera: hull.coverages([other for other in left if other != camera]) for camera in left}
        worst = max(left, key=lambda camera: sum(without[camera].values()) - OWN_COVERAGE * covered[camera])
        out[worst] = covered[worst]
        left.remove(worst)
        covered = without[worst]
    return out


def hull_coverage(
    masks: Mapping[int, Mask], cameras: Mapping[int, Camera], hidden: Mapping[int, Mask] | None = None
) -> dict[int, float]:
    """The share of each mask that the visual hull of all of them covers: 1 where they agree.

    What lies where a camera's view is `hidden` may be in the hull, whatever its mask says.
    """
    return MaskHull.of_subject(masks, cameras, hidden).coverages(list(masks))
