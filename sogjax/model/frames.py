"""Which way is up: from the upright frame of bodies to a recording's world."""

import numpy as np
from jaxtyping import Float

_COLUMNS = {
    # images of the body's forward (x), left (y) and up (z) axes in the world
    "z": ("x", "y", "z"),
    "y": ("z", "x", "y"),
    "x": ("y", "z", "x"),
    "-z": ("x", "-y", "-z"),
    "-y": ("z", "-x", "-y"),
    "-x": ("y", "-z", "-x"),
}

UP_AXES = tuple(_COLUMNS)
"""What `up` may be."""


def axis_vector(axis: str) -> Float[np.ndarray, "3"]:
    """The unit vector of an axis written as `x` or `-x`."""
    sign = -1.0 if axis.startswith("-") else 1.0
    return sign * np.eye(3)["xyz".index(axis[-1])]


def world_from_upright(up: str) -> Float[np.ndarray, "3 3"]:
    """The rotation from the upright frame (x forward, y left, z up) to a world whose vertical is `up`."""
    return np.stack([axis_vector(axis) for axis in _COLUMNS[up]], axis=1)


def forward_axis(up: str) -> str:
    """Which axis of a world with the vertical `up` an upright body looks along."""
    return _COLUMNS[up][0]
