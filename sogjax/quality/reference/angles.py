"""Another system's angles, counted the way ours are."""

import numpy as np
from jaxtyping import Bool, Float

from sogjax.quality.reference.names import Columns

_OTHER_WAY = -0.8
"""Correlation below which an angle is taken to be counted the other way."""


def same_way(
    ours: Columns, theirs: Columns, rows: Bool[np.ndarray, "frame"]
) -> tuple[dict[str, Float[np.ndarray, "frame"]], list[str]]:
    """Their angles, those that are counted the other way turned round, and what is said of these."""
    turned, said = dict(theirs), []
    for name, values in theirs.items():
        a, b = ours[name][rows], values[rows]
        known = np.isfinite(b)
        moves = known.sum() > 2 and min(np.ptp(a[known]), np.ptp(b[known])) > 1.0
        if moves and np.corrcoef(a[known], b[known])[0, 1] < _OTHER_WAY:
            turned[name] = -values
            said.append(f"{name} is counted the other way in the truth and was turned round")
    return turned, said
