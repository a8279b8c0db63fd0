"""Smooth motion: how suddenly a pose departs from the two before (E_acc of Eq. 10)."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.posed import Frame, Posed
from sogjax.energy.term import Penalty
from sogjax.solve.quadratic import QuadraticModel


class AccelerationPenalty(Penalty):
    """E_acc, in squared radians and metres, 0 where there is no history; its weight is w_a."""

    def value(self, posed: Posed, frame: Frame) -> Float[Array, ""]:
        """`acceleration_penalty` of the pose and the two before."""
        history = frame.history
        bend = acceleration_penalty(posed.pose, history.previous, history.before_previous)
        return jnp.where(history.known, bend, 0.0)

    def quadratic(self, posed: Posed, frame: Frame) -> QuadraticModel:
        """Exact: the penalty is quadratic."""
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
