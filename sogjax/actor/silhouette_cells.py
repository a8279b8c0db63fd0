"""Masks cut into cells of equal size around the subject."""

from collections.abc import Sequence

import cv2
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.actor.coverage import Silhouettes
from sogjax.actor.silhouettes import PosedPictures
from sogjax.model.camera import Camera, undistort, undistorted_sizes

MAX_CELLS = 2048
"""For each camera."""
BORDER = 0.12
"""Border around the subject's box, as a part of its longer side."""


def silhouettes_of(pictures: Sequence[PosedPictures], rig: Camera) -> Silhouettes:
    """The masks of all poses, with a leading axis for the poses."""
    poses = [_pose_cells(posed, int(rig.image_size.shape[0])) for posed in pictures]
    means, sigmas, coverage, mask = (np.stack(part) for part in zip(*poses, strict=True))
    dtype = rig.intrinsics.dtype
    as_dtype = lambda array: jnp.asarray(array, dtype)
    undistorted, sigmas = _undistorted(rig, as_dtype(means), as_dtype(sigmas))
    repeated = lambda leaf: jnp.asarray(np.broadcast_to(np.asarray(leaf), (len(pictures), *leaf.shape)))
    return Silhouettes(jax.tree.map(repeated, rig), undistorted, sigmas, as_dtype(coverage), jnp.asarray(mask))


@eqx.filter_jit
def _undistorted(
    rig: Camera, means: Float[Array, "pose camera cell 2"], sigmas: Float[Array, "pose camera cell"]
) -> tuple[Float[Array, "pose camera cell 2"], Float[Array, "pose camera cell"]]:
    by_pose = lambda of_camera, *arrays: jax.vmap(lambda *of_pose: jax.vmap(of_camera)(rig, *of_pose))(*arrays)
    return by_pose(undistort, means), by_pose(undistorted_sizes, means, sigmas)


def _pose_cells(pictures: PosedPictures, num_cameras: int) -> tuple[np.ndarray, ...]:
    means = np.zeros((num_cameras, MAX_CELLS, 2))
    sigmas, coverage = np.ones((num_cameras, MAX_CELLS)), np.zeros((num_cameras, MAX_CELLS))
    mask = np.zeros((num_cameras, MAX_CELLS), bool)
    for camera, picture in pictures.masks.items():
        centres, sigma, covered = cells_of(picture)
        count = len(covered)
        means[camera, :count], sigmas[camera, :count], coverage[camera, :count] = centres, sigma, covered
        mask[camera, :count] = True
    return means, sigmas, coverage, mask


def cells_of(
    mask: Bool[np.ndarray, "_h _w"],
) -> tuple[Float[np.ndarray, "cell 2"], float, Float[np.ndarray, "cell"]]:
    """Centres (pixels as recorded), half a side (pixels), and what part of each cell the mask covers."""
    top, bottom, left, right = _box(mask)
    crop = mask[top:bottom, left:right].astype(np.float32)
    height, width = crop.shape
    side = max(1.0, np.sqrt(height * width / MAX_CELLS))
    columns = max(1, int(width / side))
    rows = max(1, min(int(height / side), MAX_CELLS // columns))
    covered = cv2.resize(crop, (columns, rows), interpolation=cv2.INTER_AREA)
    wide, high = width / columns, height / rows
    x = left + (np.arange(columns) + 0.5) * wide - 0.5
    y = top + (np.arange(rows) + 0.5) * high - 0.5
    centres = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return centres, float(np.sqrt(wide * high) / 2.0), covered.reshape(-1).astype(float)


def _box(mask: Bool[np.ndarray, "_h _w"]) -> tuple[int, int, int, int]:
    """Top, bottom, left and right of the subject with a border, inside the picture."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    border = int(BORDER * max(rows[-1] - rows[0], columns[-1] - columns[0])) + 1
    inside = lambda low, high, size: (max(int(low) - border, 0), min(int(high) + border + 1, size))
    return (*inside(rows[0], rows[-1], mask.shape[0]), *inside(columns[0], columns[-1], mask.shape[1]))
