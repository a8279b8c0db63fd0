"""Things that stand in front of people, painted or learnt: from which depth on the cells of a camera are hidden.

What is hidden there is neither for nor against anything: it is not seen.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

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


BIN = 0.1
"""Metres of depth that count as one."""
SEEN_BEFORE, SEEN_BEHIND = 0.95, 0.03
"""How likely foreground is seen where a body is before, and behind, what hides."""
NOTHING = 5.0
"""How much likelier it is beforehand that a cell hides nothing than that it does."""
FEWEST_MISSES = 2
"""Times that a body must have been missed in a cell; looks that are not independent count once."""
HIDDEN = 0.5
"""Probability from which on a cell counts as hidden."""
BEFORE = 0.2
"""Metres before the nearest place at which a body was missed: what is nearer is not known to be hidden."""
GROWN = 2
"""Cells by which what hides goes on where a body was never seen: it is only missed for certain in its middle."""
_LOOK = 3
"""Cells in each direction over which likelihoods are averaged."""


@dataclass(frozen=True)
class DepthCounts:
    """How often a body was seen and missed in every cell, by depth; changed in place."""

    first: float
    """Depth at which the first bin begins, metres."""
    seen: Float[np.ndarray, "camera rows columns bin"]
    missed: Float[np.ndarray, "camera rows columns bin"]

    @classmethod
    def empty(cls, shape: tuple[int, int, int], nearest: float, farthest: float) -> "DepthCounts":
        """For cells of that shape (cameras, rows, columns) and a body between two depths (metres)."""
        first = BIN * np.floor(nearest / BIN)
        bins = max(int(np.ceil((farthest - first) / BIN)) + 1, 1)
        return cls(float(first), *(np.zeros((*shape, bins), np.float32) for _ in range(2)))

    def add(
        self,
        cells: tuple[Int[np.ndarray, "n"], Int[np.ndarray, "n"], Int[np.ndarray, "n"]],
        depths: Float[np.ndarray, "n"],
        foreground: Float[np.ndarray, "n"],
    ) -> None:
        """Count cells (camera, row, column) covered at depths (metres), by the probability that a body is seen there.

        No cell is among them twice.
        """
        bins = np.clip(((depths - self.first) / BIN).astype(int), 0, self.seen.shape[-1] - 1)
        self.seen[(*cells, bins)] += foreground
        self.missed[(*cells, bins)] += 1.0 - foreground

    def hidden_from(self) -> HiddenFrom:
        """Depths from which on cells are more likely hidden than not; infinite where that is nowhere so."""
        hidden = np.full(self.seen.shape[:3], np.inf, np.float32)
        for camera, missed in enumerate(self.missed):
            rows, columns = np.nonzero(missed.sum(axis=-1) > FEWEST_MISSES - 0.5)
            if len(rows):
                part = tuple(slice(max(at.min() - 1, 0), at.max() + 2) for at in (rows, columns))
                hidden[camera][part] = self._of_part(self.seen[camera][part], missed[part])
                shown = self.seen[camera].sum(axis=-1) > 0.5
                hidden[camera] = np.where(shown, hidden[camera], _nearest_around(hidden[camera]))
        return hidden

    def _of_part(
        self, seen: Float[np.ndarray, "rows columns bin"], missed: Float[np.ndarray, "rows columns bin"]
    ) -> Float[np.ndarray, "rows columns"]:
        before = seen * np.log(SEEN_BEFORE) + missed * np.log(1.0 - SEEN_BEFORE)
        behind = seen * np.log(SEEN_BEHIND) + missed * np.log(1.0 - SEEN_BEHIND)
        up_to = np.cumsum(before, axis=-1)
        nothing = up_to[..., -1:]
        beyond = np.cumsum(behind[..., ::-1], axis=-1)[..., ::-1]
        likelihoods = np.concatenate([up_to - before + beyond, nothing], axis=-1)
        likelihoods = _averaged(likelihoods)
        bins = seen.shape[-1]
        likelihoods[..., -1] += np.log(NOTHING * bins)
        weights = np.exp(likelihoods - likelihoods.max(axis=-1, keepdims=True))
        hidden = np.cumsum(weights, axis=-1)[..., :-1] / weights.sum(axis=-1, keepdims=True)
        nearest = np.where(missed > 0.5, np.arange(bins), bins).min(axis=-1)
        allowed = np.arange(bins) >= nearest[..., None] - round(BEFORE / BIN)
        is_hidden = (hidden > HIDDEN) & allowed
        first = is_hidden.argmax(axis=-1)
        later = np.where(np.arange(bins) >= first[..., None], missed, 0.0).sum(axis=-1)
        found = is_hidden.any(axis=-1) & (later > FEWEST_MISSES - 0.5)
        return np.where(found, self.first + BIN * first, np.inf).astype(np.float32)


def _nearest_around(hidden: Float[np.ndarray, "rows columns"]) -> Float[np.ndarray, "rows columns"]:
    """The lowest depth around each cell."""
    return cv2.erode(hidden, np.ones((2 * GROWN + 1, 2 * GROWN + 1), np.uint8), borderType=cv2.BORDER_REPLICATE)


def _averaged(values: Float[np.ndarray, "rows columns layer"]) -> Float[np.ndarray, "rows columns layer"]:
    """Means over neighbouring cells, of all layers."""
    flat = np.ascontiguousarray(np.moveaxis(values, -1, 0), np.float32)
    return np.stack([cv2.blur(layer, (_LOOK, _LOOK)) for layer in flat], axis=-1)


def cells_covered(
    places: Float[np.ndarray, "blob 2"],
    radii: Float[np.ndarray, "blob"],
    depths: Float[np.ndarray, "blob"],
    shape: tuple[int, int],
) -> Int[np.ndarray, "rows columns"]:
    """The nearest blob whose disc covers each cell; -1 where none does. Places and radii are in cells."""
    canvas = np.full(shape, -1, np.int32)
    real = np.isfinite(places).all(axis=1) & (depths > 0.0) & (np.abs(places).max(axis=1) < 4 * max(shape))
    for blob in np.argsort(-depths):
        if real[blob]:
            centre = tuple(np.rint(places[blob] * 16.0).astype(int).tolist())
            cv2.circle(canvas, centre, round(float(radii[blob]) * 16.0), int(blob), -1, cv2.LINE_8, 4)
    return canvas
