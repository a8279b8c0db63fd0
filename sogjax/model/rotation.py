"""Rotations about fixed axes, rigid transforms, and the vertical of bodies and of a recording's world."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.model.compiled import applied, product


def cross_matrix(vectors: Float[Array, "*batch 3"]) -> Float[Array, "*batch 3 3"]:
    """The matrix of the cross product with each vector from the left."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    zero = jnp.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return jnp.stack([jnp.stack(row, -1) for row in rows], -2)


def rotation_about_axis(axes: Float[Array, "*batch 3"], angles: Float[Array, "*batch"]) -> Float[Array, "*batch 3 3"]:
    """Rotation by `angles` (radians) about unit `axes` (Rodrigues); smooth at zero, the axis being constant."""
    cross = cross_matrix(axes)
    sine, cosine = jnp.sin(angles)[..., None, None], jnp.cos(angles)[..., None, None]
    eye = jnp.broadcast_to(jnp.eye(3, dtype=axes.dtype), cross.shape)
    return eye + sine * cross + (1.0 - cosine) * product(cross, cross)


def rigid_transform(
    rotation: Float[Array, "*batch 3 3"], translation: Float[Array, "*batch 3"]
) -> Float[Array, "*batch 4 4"]:
    """The 4x4 matrix of a rotation followed by a translation."""
    upper = jnp.concatenate([rotation, translation[..., None]], -1)
    last = jnp.broadcast_to(jnp.array([0.0, 0.0, 0.0, 1.0], rotation.dtype), (*upper.shape[:-2], 1, 4))
    return jnp.concatenate([upper, last], -2)


def transform_points(
    b_from_a: Float[Array, "*batch 4 4"], points: Float[Array, "*batch 3"]
) -> Float[Array, "*batch 3"]:
    """Points of frame a, expressed in frame b; one transform per point."""
    rotated = applied(b_from_a[..., :3, :3], points)
    return rotated + b_from_a[..., :3, 3]


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
