"""Which turns a body's blobs tell: a sphere looks the same however it is turned."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.model.body import Body
from sogjax.model.compiled import compiled_hastily

TOLD = 4.5
"""Reach of a turn from which on pictures tell it. Of rendered people (`experiments/degrees.py`) wrists (3.8), head (1.3
to 2.6), sole (2.5) and the turn of forearms (0.4) are off by 0.9 to 2.2 of what they truly move (standard deviation),
ankles (5 to 6), the turn of upper arms (7) and of thighs (12) and elbows (17) by 0.2 to 0.7 of it."""


def reach(moved: Float[np.ndarray, "*times blob 3"], sigmas: Float[np.ndarray, "blob"]) -> Float[np.ndarray, "*times"]:
    """How far a turn moves blobs, in units of their sizes: the root of the sum of squares over the blobs.

    `moved` are the blobs' velocities where the turn goes on by a radian a second (metres), `sigmas` their sizes.
    """
    return np.sqrt(((moved / sigmas[:, None]) ** 2).sum(axis=(-2, -1)))


def told_dofs(body: Body) -> Bool[np.ndarray, "dof"]:
    """Which degrees of freedom the blobs tell where elbows and knees are bent; what slides they always tell.

    One may turn more than a segment: `neck_bend` of the default body bends neck and head, and is told.
    """
    return (reaches(body) >= TOLD) | ~body.skeleton.turning


def reaches(body: Body) -> Float[np.ndarray, "dof"]:
    """The reach of each degree of freedom where those with limits are in the middle between them."""
    skeleton = body.skeleton
    lower, upper = np.asarray(skeleton.dof_lower, float), np.asarray(skeleton.dof_upper, float)
    limited = np.isfinite(lower) & np.isfinite(upper)
    middle = 0.5 * (np.where(limited, lower, 0.0) + np.where(limited, upper, 0.0))
    pose = jnp.asarray(np.where(limited, middle, np.asarray(body.poses["rest"])), skeleton.offsets.dtype)
    moved = np.asarray(_blob_velocities(body, pose), float)
    return reach(np.moveaxis(moved, -1, 0), np.asarray(body.blob_sigmas, float))


@compiled_hastily
def _blob_velocities(body: Body, pose: Float[Array, "dof"]) -> Float[Array, "blob 3 dof"]:
    """How the blobs move (metres a unit of each degree of freedom)."""
    frames = body.skeleton.world_from_joint(pose)
    return body.skeleton.point_jacobian(frames, body.blobs.joints, body.blobs.points_world(frames))
