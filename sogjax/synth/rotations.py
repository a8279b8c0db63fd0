"""Rotations of the rendered figure, in plain numpy: about the axes, between frames, parts of a twist."""

from collections.abc import Iterable
from math import cos, radians, sin

import numpy as np
from jaxtyping import Float

Matrix = Float[np.ndarray, "3 3"]
Vector = Float[np.ndarray, "3"]

_PLANES = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}


def about(axis: str, angle: float) -> Matrix:
    """Rotation by `angle` (radians) about the coordinate axis `x`, `y` or `z`."""
    return _about(axis, cos(angle), sin(angle))


def turned(*turns: tuple[str, float]) -> Matrix:
    """The product of rotations about coordinate axes, angles in degrees; the last one acts first."""
    rotation = np.eye(3)
    for axis, degrees in turns:
        if degrees != 0.0:
            rotation = rotation @ _about(axis, cos(radians(degrees)), sin(radians(degrees)))
    return rotation


def _about(axis: str, cosine: float, sine: float) -> np.ndarray:
    rotation = np.eye(3)
    i, j = _PLANES[axis]
    rotation[i, i] = rotation[j, j] = cosine
    rotation[j, i], rotation[i, j] = sine, -sine
    return rotation


def mirrored(rotation: Matrix) -> Matrix:
    """The same turn on the other side of a body whose axes point forward, left and up."""
    mirror = np.diag([1.0, -1.0, 1.0])
    return mirror @ rotation @ mirror


def ahead_and_left(turn: float) -> tuple[Vector, Vector]:
    """The horizontal directions ahead and to the left of who faces `turn` (radians from x)."""
    return np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([-np.sin(turn), np.cos(turn), 0.0])


def frame(z: Iterable[float], towards_x: Iterable[float]) -> Matrix:
    """The right-handed frame whose z axis is along `z` and whose x axis leans towards `towards_x`."""
    z_axis = unit(np.asarray(z, float))
    y_axis = unit(np.cross(z_axis, np.asarray(towards_x, float)))
    return np.stack([np.cross(y_axis, z_axis), y_axis, z_axis], axis=1)


def unit(vector: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
    """The vectors at length one; a zero vector stays zero."""
    x, y, z = (vector[..., k : k + 1] for k in range(3))
    return vector / np.maximum(np.sqrt(x * x + y * y + z * z), 1e-12)


def partial_twist(rotation: Matrix, share: float) -> Matrix:
    """The rotation with only `share` of its twist about the z axis, its swing kept.

    The swing-twist decomposition through quaternions: R = swing * twist_z.
    """
    trace = rotation[0, 0] + rotation[1, 1] + rotation[2, 2]
    # (1 + trace, R10 - R01) is 4 w (w, z) of the quaternion; half the twist angle is atan2(z, w).
    half = np.arctan2(rotation[1, 0] - rotation[0, 1], 1.0 + trace)
    return rotation @ about("z", -2.0 * (1.0 - share) * half)


def between(a: Matrix, b: Matrix, share: float) -> Matrix:
    """A rotation on the way from `a` to `b`."""
    u, _, vt = np.linalg.svd((1.0 - share) * a + share * b)
    return u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt
