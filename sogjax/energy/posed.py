"""What a term of the energy looks at: a body in a pose, and a frame."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from sogjax.energy.views import Views
from sogjax.model.body import Body
from sogjax.model.sog import Sog


class History(eqx.Module):
    """The poses of the two frames before; `known` is False where there are none (no acceleration penalty)."""

    previous: Float[Array, "dof"]
    before_previous: Float[Array, "dof"]
    known: Bool[Array, ""]

    @classmethod
    def unknown(cls, pose: Float[Array, "dof"]) -> "History":
        """The history of a frame that has none; `pose` only says how long a pose is."""
        return cls(pose, pose, jnp.asarray(False))


class Frame(eqx.Module):
    """What is known of a frame without a pose: its pictures, and the poses before."""

    views: Views
    history: History


class Moving(NamedTuple):
    """What of a posed body changes with the pose (or, with a leading axis, the rates at which it does)."""

    pose: Array
    joint_params: Array
    world_from_joint: Array
    means: Array


class Posed(eqx.Module):
    """A body in a pose: lengths in metres, angles in radians, everything in the world."""

    body: Body
    pose: Float[Array, "dof"]
    joint_params: Float[Array, "joint"]
    """Lambda of Eq. 1."""
    world_from_joint: Float[Array, "joint 4 4"]
    """The frame of every joint; its last column is where the joint lies."""
    blobs: Sog
    """SRGB colours."""

    @classmethod
    def from_pose(cls, body: Body, pose: Float[Array, "dof"]) -> "Posed":
        """Forward kinematics, once for all terms."""
        frames = body.skeleton.world_from_joint(pose)
        means = body.blobs.points_world(frames)
        blobs = Sog(means, body.blob_sigmas, body.blob_colors, jnp.ones(body.num_blobs, bool))
        return cls(body, pose, body.skeleton.joint_params(pose), frames, blobs)

    @property
    def moving(self) -> Moving:
        """What changes with the pose."""
        return Moving(self.pose, self.joint_params, self.world_from_joint, self.blobs.means)

    def moved_to(self, moving: Moving) -> "Posed":
        """This body with what changes with the pose put elsewhere."""
        return eqx.tree_at(lambda p: (p.pose, p.joint_params, p.world_from_joint, p.blobs.means), self, moving)

    def rates(self) -> Moving:
        """Derivatives by the degrees of freedom, along the first axis."""
        _, push = jax.linearize(lambda pose: Posed.from_pose(self.body, pose).moving, self.pose)
        return jax.vmap(push)(jnp.eye(self.pose.shape[0], dtype=self.pose.dtype))

    def point_jacobian(self) -> Float[Array, "blob 3 dof"]:
        """Derivatives of the blobs' means by the pose, in closed form."""
        skeleton = self.body.skeleton
        return skeleton.point_jacobian(self.world_from_joint, self.body.blobs.joints, self.blobs.means)
