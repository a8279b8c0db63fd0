"""Joint limits: how far a pose is beyond them (E_lim of Eq. 10)."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.posed import Frame, Posed
from sogjax.energy.term import Penalty
from sogjax.solve.quadratic import QuadraticModel


class LimitPenalty(Penalty):
    """E_lim, in squared radians and metres; its weight is w_l."""

    def value(self, posed: Posed, frame: Frame) -> Float[Array, ""]:
        """`limit_penalty` of the joint parameters."""
        return limit_penalty(posed.joint_params, *posed.body.skeleton.joint_limits())

    def quadratic(self, posed: Posed, frame: Frame) -> QuadraticModel:
        """Exact: the penalty is quadratic beyond a limit, and 0 within."""
        return self.model(posed)

    def model(self, posed: Posed) -> QuadraticModel:
        """The same, whatever the frame."""
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
