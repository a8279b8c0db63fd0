"""Things that stand in front of people: from which depth on the cells of a camera are hidden.

What is hidden there is neither for nor against anything: it is not seen.
"""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.scene.background import cell_means
from sogjax.scene.cells import CellGrid, stack_shape
from sogjax.scene.quadtree import Candidates

HIDING_SHARE = 0.5
"""A cell hides what is behind it if so much of it does."""
ONE_DEPTH = 0.15
"""Metres by which the cells of an image blob may hide from different depths on."""

HiddenFrom = Float[np.ndarray, "camera rows columns"]
"""Depth along the camera's axis (metres) from which on a cell is hidden; 0 where all is, infinite where nothing is."""


def nothing_hidden(grids: Sequence[CellGrid]) -> HiddenFrom:
    """Cells that hide nothing."""
    return np.full((len(grids), *stack_shape(tuple(grids))), np.inf, np.float32)


def painted(masks: Sequence[Bool[np.ndarray, "_height _width"] | None], grids: Sequence[CellGrid]) -> HiddenFrom:
    """Cells that hide everything where a picture of each camera (None: it has none) is white."""
    hidden = nothing_hidden(grids)
    for camera, (mask, grid) in enumerate(zip(masks, grids, strict=True)):
        if mask is not None:
            share = cell_means(mask.astype(np.float32), grid)
            hidden[camera, : grid.rows, : grid.columns][share > HIDING_SHARE] = 0.0
    return hidden


class Occluders(eqx.Module):
    """From which depth on cells, and the nodes of a quad-tree over them, are hidden; metres along the camera's axis."""

    cells: Float[Array, "camera rows columns"]
    nodes: Float[Array, "camera candidate"]

    @classmethod
    def of_cells(cls, hidden: HiddenFrom, candidates: Candidates) -> tuple["Occluders", Candidates]:
        """Of cells; and the nodes that may be leaves, none of which lies across the edge of what hides."""
        tables = [_of_nodes(of_camera, candidates) for of_camera in hidden]
        lowest, mixed = (np.stack(parts) for parts in zip(*tables, strict=True))
        dtype = candidates.sigmas.dtype
        kept = eqx.tree_at(lambda c: c.inside, candidates, candidates.inside & ~jnp.asarray(mixed))
        return cls(jnp.asarray(hidden, dtype), jnp.asarray(lowest, dtype)), kept


def _of_nodes(
    hidden: Float[np.ndarray, "rows columns"], candidates: Candidates
) -> tuple[Float[np.ndarray, "node"], Bool[np.ndarray, "node"]]:
    """The nearest depth in each node, and which nodes have several; level by level, from the cells upwards."""
    rows, columns = candidates.shape
    border = ((0, rows - hidden.shape[0]), (0, columns - hidden.shape[1]))
    lowest = highest = np.pad(hidden, border, constant_values=np.inf)
    nearest, mixed = [], []
    for level in range(candidates.num_levels):
        if level:
            lowest, highest = _of_four(lowest, np.minimum), _of_four(highest, np.maximum)
        nearest.append(lowest.reshape(-1))
        mixed.append((highest > lowest + ONE_DEPTH).reshape(-1))
    return np.concatenate(nearest), np.concatenate(mixed)


def _of_four(
    values: Float[np.ndarray, "rows columns"], choose: np.ufunc
) -> Float[np.ndarray, "half_rows half_columns"]:
    pairs = choose(values[0::2], values[1::2])
    return choose(pairs[:, 0::2], pairs[:, 1::2])
