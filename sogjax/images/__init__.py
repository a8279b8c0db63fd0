"""From pictures to Sums of Gaussians (Section 4.1)."""

from typing import TYPE_CHECKING

from sogjax.lazy import lazy_names

if TYPE_CHECKING:
    from sogjax.images.cells import CellGrid, stack_cells
    from sogjax.images.quadtree import Candidates

__all__ = [
    "Candidates",
    "CellGrid",
    "stack_cells",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "Candidates": "sogjax.images.quadtree",
        "CellGrid": "sogjax.images.cells",
        "stack_cells": "sogjax.images.cells",
    },
)
