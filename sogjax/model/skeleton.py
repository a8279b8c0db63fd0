"""Skeletons of one-axis joints: parameter transform M (Eq. 1), limits, forward kinematics."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from sogjax.model.kinematics import forward_kinematics, point_jacobian


class Skeleton(eqx.Module):
    """A tree of joints that each turn about, or slide along, one axis.

    Joint l has one joint parameter Lambda_l (radians or metres): its frame is the parent's frame, moved by
    `offsets[l]` (metres, in the parent's frame), then turned about or moved along `axes[l]`.
    Parents come before their children; a root's parent is -1 (the world).
    """

    names: tuple[str, ...] = eqx.field(static=True)
    parents: tuple[int, ...] = eqx.field(static=True)
    dof_names: tuple[str, ...] = eqx.field(static=True)
    offsets: Float[Array, "joint 3"]
    axes: Float[Array, "joint 3"]
    revolute: Bool[Array, "joint"]
    parameter_transform: Float[Array, "joint dof"]
    """M of Eq. 1: joint parameters = M @ pose."""
    dof_lower: Float[Array, "dof"]
    dof_upper: Float[Array, "dof"]
    """Limits of the degrees of freedom; -inf and inf where there are none."""

    @property
    def num_joints(self) -> int:
        """Number of one-axis joints, which is also the number of joint parameters."""
        return len(self.names)

    @property
    def num_dofs(self) -> int:
        """Number of pose parameters."""
        return len(self.dof_names)

    @property
    def trees(self) -> tuple[int, ...]:
        """For every joint the number of its tree, which is an actor; trees are counted by their roots."""
        numbers: list[int] = []
        for parent in self.parents:
            numbers.append(max(numbers, default=-1) + 1 if parent < 0 else numbers[parent])
        return tuple(numbers)

    def joint_params(self, pose: Float[Array, "dof"]) -> Float[Array, "joint"]:
        """Lambda = M Theta (Eq. 1)."""
        return jnp.matmul(self.parameter_transform, pose, precision="highest")

    def joint_limits(self) -> tuple[Float[Array, "joint"], Float[Array, "joint"]]:
        """Lower and upper limits l_l, l_h of the joint parameters, from those of the degrees of freedom."""
        weights = self.parameter_transform
        used = weights != 0.0
        at_lower = jnp.where(used, weights, 1.0) * self.dof_lower[None, :]
        at_upper = jnp.where(used, weights, 1.0) * self.dof_upper[None, :]
        lower = jnp.sum(jnp.where(used, jnp.minimum(at_lower, at_upper), 0.0), axis=1)
        upper = jnp.sum(jnp.where(used, jnp.maximum(at_lower, at_upper), 0.0), axis=1)
        return lower, upper

    def world_from_joint(self, pose: Float[Array, "dof"]) -> Float[Array, "joint 4 4"]:
        """Forward kinematics: the frame of every joint in the world."""
        return forward_kinematics(self.parents, self.revolute, self.offsets, self.axes, self.joint_params(pose))

    def point_jacobian(
        self,
        world_from_joint: Float[Array, "joint 4 4"],
        joints: tuple[int, ...],
        points_world: Float[Array, "point 3"],
    ) -> Float[Array, "point 3 dof"]:
        """Derivatives by the pose of points fixed to `joints`, which lie at `points_world` (metres)."""
        by_joint_param = point_jacobian(self.parents, self.revolute, self.axes, world_from_joint, joints, points_world)
        return jnp.matmul(by_joint_param, self.parameter_transform, precision="highest")
