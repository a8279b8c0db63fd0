"""The background of all cameras as cells, for the tracker."""

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Float, UInt8


class BackgroundCells(eqx.Module):
    """What every cell shows when nobody stands before it; padded to the largest camera, where nothing is known."""

    colors: UInt8[Array | np.ndarray, "camera rows columns 3"]
    """RGB."""
    spread: Float[Array | np.ndarray, "camera rows columns"]
    """Standard deviation of a channel, in units of the full range (0..1)."""
    known: Bool[Array | np.ndarray, "camera rows columns"]
    """False where nothing may be concluded from the colour."""
