"""Skeletons of one-axis joints: parameter transform M (Eq. 1), limits, and forward kinematics with its derivative.

A joint that turns gives whatever hangs on it the velocity axis x (point - origin), one that slides gives it the
velocity of its axis. Summed over the ancestors of a joint this is one matrix product, in whichever direction it is
differentiated; plain autodiff would go back through every product of transforms.
"""

from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Bool, Float, Int

from sogjax.model.compiled import applied, product
from sogjax.model.rotation import cross_matrix, rigid_transform, rotation_about_axis

Parents = tuple[int, ...]
Frames = Float[Array, "joint 4 4"]


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
    def turning(self) -> Bool[np.ndarray, "dof"]:
        """Which degrees of freedom are angles: those that move no sliding joint."""
        used = np.asarray(self.parameter_transform) != 0.0
        return ~(used & ~np.asarray(self.revolute)[:, None]).any(axis=0)

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
        joints: tuple[int, ...] | Int[Array, "point"],
        points_world: Float[Array, "point 3"],
        dofs: Int[Array, "dof"] | None = None,
    ) -> Float[Array, "point 3 dof"]:
        """Derivatives by the pose, or by `dofs`, of points fixed to `joints`, which lie at `points_world` (metres)."""
        by_joint_param = point_jacobian(self.parents, self.revolute, self.axes, world_from_joint, joints, points_world)
        transform = self.parameter_transform if dofs is None else self.parameter_transform[:, dofs]
        return jnp.matmul(by_joint_param, transform, precision="highest")


@partial(jax.custom_jvp, nondiff_argnums=(0,))
def forward_kinematics(
    parents: Parents,
    revolute: Bool[Array, "joint"],
    offsets: Float[Array, "joint 3"],
    axes: Float[Array, "joint 3"],
    joint_params: Float[Array, "joint"],
) -> Frames:
    """The frame of every joint in the world, from joint parameters (radians, or metres for joints that slide)."""
    return _composed(parents, revolute, offsets, axes, joint_params)


def _composed(parents, revolute, offsets, axes, joint_params) -> Frames:
    """Transforms are composed by pointer doubling: round k joins each joint's chain of 2^k ancestors with the next 2^k.

    So 61 joints in a chain of any shape take six batched products, however deep the tree is.
    """
    angles = jnp.where(revolute, joint_params, 0.0)
    slides = jnp.where(revolute, 0.0, joint_params)
    local = rigid_transform(rotation_about_axis(axes, angles), offsets + slides[:, None] * axes)
    transforms = jnp.concatenate([local, jnp.eye(4, dtype=local.dtype)[None]])
    for ancestors in _doubled_ancestors(parents):
        transforms = product(transforms[ancestors], transforms)
    return transforms[:-1]


def _velocities(parents, primals, tangents):
    revolute, offsets, axes, joint_params = primals
    frames = forward_kinematics(parents, *primals)
    _, offset_rates, axis_rates, param_rates = tangents
    rates = jnp.zeros_like(frames)
    if not isinstance(param_rates, SymbolicZero):
        rates = _frame_rates(parents, revolute, axes, frames, param_rates)
    if not (isinstance(offset_rates, SymbolicZero) and isinstance(axis_rates, SymbolicZero)):
        # A change of the skeleton itself (its shape) is left to autodiff.
        composed = lambda offsets, axes: _composed(parents, revolute, offsets, axes, joint_params)
        solid = lambda rate, like: jnp.zeros_like(like) if isinstance(rate, SymbolicZero) else rate
        shape_rates = (solid(offset_rates, offsets), solid(axis_rates, axes))
        rates = rates + jax.jvp(composed, (offsets, axes), shape_rates)[1]
    return frames, rates


forward_kinematics.defjvp(_velocities, symbolic_zeros=True)


def _frame_rates(parents, revolute, axes, frames, param_rates) -> Frames:
    """Velocities of all frames where the joint parameters change at given rates; linear in the rates."""
    turning, sliding = _screws(revolute, axes, frames)
    below = jnp.asarray(ancestor_table(parents), frames.dtype)
    sums = jnp.matmul(below, jnp.concatenate([turning, sliding], axis=1) * param_rates[:, None], precision="highest")
    across = cross_matrix(sums[:, :3])
    arms = frames[:, :3, 3] - frames[:1, :3, 3]
    moved = applied(across, arms) + sums[:, 3:]
    turned = product(across, frames[:, :3, :3])
    upper = jnp.concatenate([turned, moved[:, :, None]], axis=2)
    return jnp.concatenate([upper, jnp.zeros_like(upper[:, :1, :])], axis=1)


def _screws(revolute, axes, frames) -> tuple[Float[Array, "joint 3"], Float[Array, "joint 3"]]:
    """Angular velocity that each joint gives, and the velocity it gives to a point at the first joint's origin."""
    axes_world = applied(frames[:, :3, :3], axes)
    turning = jnp.where(revolute[:, None], axes_world, 0.0)
    arms = frames[:, :3, 3] - frames[:1, :3, 3]
    return turning, jnp.where(revolute[:, None], jnp.cross(arms, turning), axes_world)


def point_jacobian(
    parents: Parents,
    revolute: Bool[Array, "joint"],
    axes: Float[Array, "joint 3"],
    world_from_joint: Frames,
    joints: tuple[int, ...] | Int[Array, "point"],
    points_world: Float[Array, "point 3"],
) -> Float[Array, "point 3 joint"]:
    """Derivatives by the joint parameters of points fixed to `joints`, which lie at `points_world` (metres)."""
    turning, sliding = _screws(revolute, axes, world_from_joint)
    moved = jnp.asarray(ancestor_table(parents), axes.dtype)[jnp.asarray(joints, int)]
    arms = points_world - world_from_joint[:1, :3, 3]
    velocities = jnp.cross(turning[None, :, :], arms[:, None, :]) + sliding[None, :, :]
    return jnp.swapaxes(velocities * moved[:, :, None], 1, 2)


def ancestor_table(parents: Parents) -> Bool[np.ndarray, "joint joint"]:
    """Row j marks the joints that move joint j: itself and its ancestors."""
    table = np.eye(len(parents), dtype=bool)
    for joint, parent in enumerate(parents):
        if parent >= 0:
            table[joint] |= table[parent]
    return table


def _doubled_ancestors(parents: Parents) -> list[Int[np.ndarray, "joint_and_world"]]:
    """For each round of pointer doubling the ancestor of every joint; the last slot is the world."""
    world = len(parents)
    ancestors = np.array([world if parent < 0 else parent for parent in parents] + [world])
    rounds = []
    while (ancestors != world).any():
        rounds.append(ancestors)
        ancestors = ancestors[ancestors]
    return rounds
