"""Images as Sums of Gaussians by a quad-tree over their cells (Section 4.1).

Every node that could become a blob has a fixed slot ("candidate"), whose place and size are known before any image
is seen: only the colours and the choice of the leaves change from frame to frame. So lens distortion is removed
from the blob centres once per recording.
"""

from collections.abc import Sequence
from functools import partial, reduce
from operator import add

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.model.camera import Camera, undistort, undistorted_sizes
from sogjax.model.compiled import chosen_indices, stage_barrier
from sogjax.model.sog import Sog
from sogjax.scene.cells import CellGrid

Planes = list[Float[Array, "_ _"]]
"""Channels of a picture, one array each: sums over a last axis of three are slow."""


class Candidates(eqx.Module):
    """The quad-tree nodes of one camera, or a stack of cameras: level by level, from the cells upwards."""

    means: Float[Array, "*camera candidate 2"]
    """Undistorted pixels."""
    sigmas: Float[Array, "*camera candidate"]
    """Half the side of the node, in undistorted pixels (Section 4.1)."""
    inside: Bool[Array, "*camera candidate"]
    """The node may be a leaf: it lies inside the image (a cell: at least half of it)."""
    shape: tuple[int, int] = eqx.field(static=True)
    """Rows and columns of the padded cell grid."""
    num_levels: int = eqx.field(static=True)
    grids: tuple[CellGrid, ...] = eqx.field(static=True, default=())
    """How the images of each camera are cut into the cells."""

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
        undistorted, sizes = _undistorted(cameras, jnp.asarray(means, dtype), jnp.asarray(sigmas, dtype))
        return cls(undistorted, sizes, jnp.asarray(inside), shape, num_levels, tuple(grids))


@jax.jit
def _undistorted(
    cameras: Camera, pixels: Float[Array, "camera n 2"], sizes: Float[Array, "camera n"]
) -> tuple[Float[Array, "camera n 2"], Float[Array, "camera n"]]:
    return jax.vmap(undistort)(cameras, pixels), jax.vmap(undistorted_sizes)(cameras, pixels, sizes)


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
    planes, leaves = quadtree_of_planes([cells[..., k] for k in range(3)], candidates, color_tolerance)
    return jnp.stack(planes, axis=-1), leaves


def quadtree_of_planes(
    cells: Planes, candidates: Candidates, color_tolerance: Float[Array, ""]
) -> tuple[list[Float[Array, "candidate"]], Bool[Array, "candidate"]]:
    """The quad-tree of colours that lie channel by channel, which is quicker; any number of channels."""
    running = ~jnp.isnan(color_tolerance)
    levels = stage_barrier(running, partial(_levels, shape=candidates.shape, num_levels=candidates.num_levels), cells)
    inside = jnp.split(candidates.inside, np.cumsum([planes[0].size for planes in levels])[:-1])
    leaves: list[Array] = []
    covered = jnp.zeros(levels[-1][0].shape, bool)
    for level in reversed(range(candidates.num_levels)):
        fits = inside[level].reshape(covered.shape)
        leaf = fits & ~covered
        if level > 0:
            leaf = leaf & _uniform(levels[level], color_tolerance)
            covered = stage_barrier(running, _children, covered | leaf)
        leaves.append(leaf.reshape(-1))
    return stage_barrier(running, _node_colors, levels), jnp.concatenate(leaves[::-1])


def _levels(cells: Planes, shape: tuple[int, int], num_levels: int) -> list[Planes]:
    """Means over the nodes of every level, from the cells upwards: the channels and the squared length."""
    height, width = cells[0].shape
    padded = [jnp.pad(plane, ((0, shape[0] - height), (0, shape[1] - width))) for plane in cells]
    levels = [[*padded, _squared_length(padded)]]
    for _ in range(num_levels - 1):
        levels.append([_parents(plane) for plane in levels[-1]])
    return levels


def _node_colors(levels: list[Planes]) -> list[Float[Array, "candidate"]]:
    """The mean colours of all nodes, channel by channel, in the order of the candidates."""
    return [jnp.concatenate([level[k].reshape(-1) for level in levels]) for k in range(len(levels[0]) - 1)]


def _parents(plane: Float[Array, "rows columns"]) -> Float[Array, "half_rows half_columns"]:
    """Means over squares of four."""
    pairs = plane[0::2, :] + plane[1::2, :]
    return 0.25 * (pairs[:, 0::2] + pairs[:, 1::2])


def _children(plane: Bool[Array, "rows columns"]) -> Bool[Array, "two_rows two_columns"]:
    """What is true of a node is true of its four children."""
    return jnp.repeat(jnp.repeat(plane, 2, axis=0), 2, axis=1)


def _uniform(planes: Planes, color_tolerance: Float[Array, ""]) -> Bool[Array, "rows columns"]:
    variance = planes[-1] - _squared_length(planes[:-1])
    return (color_tolerance >= 0.0) & (variance <= color_tolerance**2)


def _squared_length(planes: Planes) -> Float[Array, "rows columns"]:
    return reduce(add, [plane * plane for plane in planes])


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
    planes = [colors[:, k] for k in range(3)]
    return keep_blobs_of_planes(means, sigmas, planes, keep, capacity)


def keep_blobs_of_planes(
    means: Float[Array, "n 2"],
    sigmas: Float[Array, "n"],
    colors: list[Float[Array, "n"]],
    keep: Bool[Array, "n"],
    capacity: int,
) -> tuple[Sog, Int[Array, "capacity"], Int[Array, ""]]:
    """The chosen blobs as in `keep_blobs`, of colours that lie channel by channel."""
    chosen, count = chosen_indices(keep, capacity)
    mask = jnp.arange(capacity, dtype=count.dtype) < count
    image = Sog(
        means=jnp.where(mask[:, None], means[chosen], 0.0),
        sigmas=jnp.where(mask, sigmas[chosen], 1.0),
        colors=jnp.where(mask[:, None], jnp.stack([plane[chosen] for plane in colors], axis=-1), 0.0),
        mask=mask,
    )
    return image, chosen, count
