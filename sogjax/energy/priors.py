"""Penalties of poses: joints beyond their limits (E_lim of Eq. 10), sudden motion (E_acc), joints far from rest."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.energy.posed import Frame, Posed
from sogjax.energy.term import Penalty
from sogjax.model.body import Body
from sogjax.model.reach import TOLD, reaches
from sogjax.solve.solution import QuadraticModel


class LimitPenalty(Penalty):
    """E_lim, in squared radians and metres; its weight is w_l."""

    def value(self, posed: Posed, frame: Frame) -> Float[Array, ""]:
        """`limit_penalty` of the joint parameters."""
        return limit_penalty(posed.joint_params, *posed.body.skeleton.joint_limits())

    def quadratic(self, posed: Posed, frame: Frame) -> QuadraticModel:
        """The exact model: the penalty is quadratic beyond a limit, and 0 within."""
        return self.model(posed)

    def model(self, posed: Posed) -> QuadraticModel:
        """The exact model, which no frame changes."""
        lower, upper = posed.body.skeleton.joint_limits()
        beyond = posed.joint_params - jnp.clip(posed.joint_params, lower, upper)
        transform = posed.body.skeleton.parameter_transform
        bends = jnp.where(beyond != 0.0, 2.0, 0.0)[:, None] * transform
        return QuadraticModel(
            value=self.signed_weight * limit_penalty(posed.joint_params, lower, upper),
            gradient=-self.weight * jnp.matmul(transform.T, 2.0 * beyond, precision="highest"),
            curvature=self.weight * jnp.matmul(transform.T, bends, precision="highest"),
        )


def limit_penalty(
    joint_params: Float[Array, "joint"], lower: Float[Array, "joint"], upper: Float[Array, "joint"]
) -> Float[Array, ""]:
    """E_lim: squared distances of the joint parameters Lambda from their limits; 0 within."""
    below = jnp.maximum(lower - joint_params, 0.0)
    above = jnp.maximum(joint_params - upper, 0.0)
    return jnp.sum(below**2) + jnp.sum(above**2)


class AccelerationPenalty(Penalty):
    """E_acc, in squared radians and metres, 0 where there is no history; its weight is w_a."""

    def value(self, posed: Posed, frame: Frame) -> Float[Array, ""]:
        """`acceleration_penalty` of the pose and the two before."""
        history = frame.history
        bend = acceleration_penalty(posed.pose, history.previous, history.before_previous)
        return jnp.where(history.known, bend, 0.0)

    def quadratic(self, posed: Posed, frame: Frame) -> QuadraticModel:
        """The exact model: the penalty is quadratic."""
        history = frame.history
        weight = jnp.where(history.known, self.weight, 0.0)
        middle = 0.5 * (history.before_previous + posed.pose)
        return QuadraticModel(
            value=self.part(posed, frame),
            gradient=-weight * (middle - history.previous),
            curvature=weight * 0.5 * jnp.eye(posed.pose.shape[0], dtype=posed.pose.dtype),
        )


def acceleration_penalty(
    pose: Float[Array, "dof"], previous: Float[Array, "dof"], before_previous: Float[Array, "dof"]
) -> Float[Array, ""]:
    """E_acc: squared distance of the previous pose from the middle of its neighbours in time."""
    return jnp.sum((0.5 * (before_previous + pose) - previous) ** 2)


REST_SPREAD = 0.15
"""A joint of a range of one radian is expected to lie so far (radians) from its place in `rest`; it grows with the
square of the range: a collar bone hardly moves, an elbow may be anywhere."""
WELL_TOLD = 2.0 * TOLD
"""Reach of a turn below which it is expected the nearer to rest the less pictures tell it: the turn of a head, hands or
feet is hardly seen, but takes up what is wrong with their shape or their masks."""
LEAST_PART = 0.2
"""How far a turn that pictures do not tell at all is expected, as a part of one that they do."""
LEAST_SPREAD = 0.01
"""Radians or metres: also of a joint that its limits hold in one place."""


class RestPenalty(Penalty):
    """Squared distance from the rest pose, in units of how far each joint is expected from it.

    Without it joints that no camera tells much of take up whatever is wrong with the body: raised shoulders, for a
    shoulder joint that lies too high, or a head bent to its limit, for dark hair before a dark wall.
    """

    spread: Float[Array, "dof"]
    """How far each degree of freedom is expected (`pose_spread`)."""

    def value(self, posed: Posed, frame: Frame) -> Float[Array, ""]:
        """The sum over the degrees of freedom that have limits."""
        return jnp.sum((_away(posed) / self.spread) ** 2)

    def quadratic(self, posed: Posed, frame: Frame) -> QuadraticModel:
        """The exact model: the penalty is quadratic."""
        slope = 2.0 * self.weight / self.spread**2
        return QuadraticModel(self.part(posed, frame), -slope * _away(posed), jnp.diag(slope))


def pose_spread(body: Body) -> Float[Array, "dof"]:
    """How far each degree of freedom is expected to lie from `rest`; infinite without limits."""
    skeleton = body.skeleton
    told = np.where(skeleton.turning, np.clip(reaches(body) / WELL_TOLD, LEAST_PART, 1.0), 1.0)
    ranges = np.asarray(skeleton.dof_upper, float) - np.asarray(skeleton.dof_lower, float)
    return jnp.asarray(np.maximum(REST_SPREAD * told * ranges**2, LEAST_SPREAD), skeleton.offsets.dtype)


def _away(posed: Posed) -> Float[Array, "dof"]:
    return posed.pose - posed.body.poses["rest"]
