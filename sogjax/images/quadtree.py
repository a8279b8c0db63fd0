"""Images as Sums of Gaussians by a quad-tree over their cells (Section 4.1).

Every node that could become a blob has a fixed slot ("candidate"), whose place and size are known before any image
is seen: only the colours and the choice of the leaves change from frame to frame. So lens distortion is removed
from the blob centres once a recording.
"""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.images.cells import CellGrid
from sogjax.model.camera import Camera, undistort
from sogjax.model.sog import Sog


class Candidates(eqx.Module):
    """The quad-tree nodes of one camera, or a stack of cameras: level by level, from the cells upwards."""

    means: Float[Array, "*camera candidate 2"]
    """Undistorted pixels."""
    sigmas: Float[Array, "*camera candidate"]
    """Half the side of the node, in pixels (Section 4.1)."""
    inside: Bool[Array, "*camera candidate"]
    """The node may be a leaf: it lies inside the image (a cell: at least half of it)."""
    shape: tuple[int, int] = eqx.field(static=True)
    """Rows and columns of the padded cell grid."""
    num_levels: int = eqx.field(static=True)

    @classmethod
    def from_grids(cls, grids: Sequence[CellGrid], cameras: Camera) -> "Candidates":
        """The nodes for images cut by `grids`, one for each of the stacked `cameras`."""
        rows, columns = max(g.rows for g in grids), max(g.columns for g in grids)
        num_levels = max(min(rows, columns).bit_length(), 1)
        block = 1 << (num_levels - 1)
        shape = (-(-rows // block) * block, -(-columns // block) * block)
        tables = [_node_table(grid, shape, num_levels) for grid in grids]
        means, sigmas, inside = (np.stack(parts) for parts in zip(*tables, strict=True))
        dtype = cameras.intrinsics.dtype
        undistorted = _undistorted(cameras, jnp.asarray(means, dtype))
        return cls(undistorted, jnp.asarray(sigmas, dtype), jnp.asarray(inside), shape, num_levels)


@jax.jit
def _undistorted(cameras: Camera, pixels: Float[Array, "camera n 2"]) -> Float[Array, "camera n 2"]:
    return jax.vmap(undistort)(cameras, pixels)


def _node_table(
    grid: CellGrid, shape: tuple[int, int], num_levels: int
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n"], Bool[np.ndarray, "n"]]:
    """Centres (pixels, as recorded), sigmas and `inside` of all nodes."""
    means, sigmas, inside = [], [], []
    for level in range(num_levels):
        side = grid.cell_size << level
        y, x = np.mgrid[: shape[0] >> level, : shape[1] >> level].reshape(2, -1)
        means.append(np.stack([(x + 0.5) * side - 0.5, (y + 0.5) * side - 0.5], axis=-1))
        sigmas.append(np.full(len(x), side / 2.0))
        if level == 0:
            covered = np.clip(grid.width / side - x, 0, 1) * np.clip(grid.height / side - y, 0, 1)
            inside.append(covered >= 0.5)
        else:
            inside.append(((x + 1) * side <= grid.width) & ((y + 1) * side <= grid.height))
    return np.concatenate(means), np.concatenate(sigmas), np.concatenate(inside)


def quadtree(
    cells: Float[Array, "rows columns 3"], candidates: Candidates, color_tolerance: Float[Array, ""]
) -> tuple[Float[Array, "candidate 3"], Bool[Array, "candidate"]]:
    """Mean colours of all nodes of one camera and which of them are leaves.

    A node splits while the standard deviation of its cells' colours is over `color_tolerance` (eps_col), or while it
    sticks out of the image, down to the cells. A negative tolerance gives one blob for each cell.
    """
    rows, columns = candidates.shape
    padded = jnp.pad(cells, ((0, rows - cells.shape[0]), (0, columns - cells.shape[1]), (0, 0)))
    moments = jnp.concatenate([padded, jnp.sum(padded**2, axis=-1, keepdims=True)], axis=-1)
    levels = [moments]
    for _ in range(candidates.num_levels - 1):
        h, w = levels[-1].shape[0] // 2, levels[-1].shape[1] // 2
        levels.append(levels[-1].reshape(h, 2, w, 2, 4).mean(axis=(1, 3)))
    sizes = [level.shape[0] * level.shape[1] for level in levels]
    inside = jnp.split(candidates.inside, np.cumsum(sizes)[:-1])
    leaves: list[Array] = []
    exists = jnp.ones(levels[-1].shape[:2], bool)
    for k in reversed(range(candidates.num_levels)):
        level, fits = levels[k], inside[k].reshape(levels[k].shape[:2])
        variance = level[..., 3] - jnp.sum(level[..., :3] ** 2, axis=-1)
        uniform = (color_tolerance >= 0.0) & (variance <= color_tolerance**2)
        leaf = exists & fits if k == 0 else exists & fits & uniform
        leaves.append(leaf.reshape(-1))
        split = exists & ~leaf
        exists = jnp.repeat(jnp.repeat(split, 2, axis=0), 2, axis=1)
    colors = jnp.concatenate([level[..., :3].reshape(-1, 3) for level in levels])
    return colors, jnp.concatenate(leaves[::-1])


def keep_blobs(
    means: Float[Array, "n 2"],
    sigmas: Float[Array, "n"],
    colors: Float[Array, "n 3"],
    keep: Bool[Array, "n"],
    capacity: int,
) -> tuple[Sog, Int[Array, "capacity"], Int[Array, ""]]:
    """The chosen blobs as a Sog, where each came from, and how many were chosen.

    A count above `capacity` means that blobs were cut off: the caller must look at it and try a larger capacity.
    """
    (chosen,) = jnp.nonzero(keep, size=capacity, fill_value=0)
    count = jnp.sum(keep)
    mask = jnp.arange(capacity) < count
    image = Sog(
        means=jnp.where(mask[:, None], means[chosen], 0.0),
        sigmas=jnp.where(mask, sigmas[chosen], 1.0),
        colors=jnp.where(mask[:, None], colors[chosen], 0.0),
        mask=mask,
    )
    return image, chosen, count
