"""Poses near rest: joints that hardly move in anybody, such as collar bones, stay about where they are at rest."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.posed import Frame, Posed
from sogjax.energy.term import Penalty
from sogjax.model.body import Body
from sogjax.model.skeleton import Skeleton
from sogjax.solve.quadratic import QuadraticModel

REST_SPREAD = 0.15
"""A joint of a range of one radian is expected to lie so far (radians) from its place in `rest`; it grows with the
square of the range: a collar bone hardly moves, an elbow may be anywhere."""
LEAST_SPREAD = 0.01
"""Radians or metres: also of a joint that its limits hold in one place."""


class RestPenalty(Penalty):
    """Squared distance from the rest pose, in units of how far each joint is expected from it (`pose_spread`).

    Without it joints that no camera tells much of take up whatever is wrong with the body: raised shoulders, for a
    shoulder joint that lies too high, or a head bent to its limit, for dark hair before a dark wall.
    """

    def value(self, posed: Posed, frame: Frame) -> Float[Array, ""]:
        """The sum over the degrees of freedom that have limits."""
        return jnp.sum(_inverse(posed.body) * _away(posed) ** 2)

    def quadratic(self, posed: Posed, frame: Frame) -> QuadraticModel:
        """Exact."""
        slope = 2.0 * self.weight * _inverse(posed.body)
        return QuadraticModel(self.part(posed, frame), -slope * _away(posed), jnp.diag(slope))


def pose_spread(skeleton: Skeleton) -> Float[Array, "dof"]:
    """How far each degree of freedom is expected to lie from `rest`; infinite without limits."""
    return jnp.maximum(REST_SPREAD * (skeleton.dof_upper - skeleton.dof_lower) ** 2, LEAST_SPREAD)


def _away(posed: Posed) -> Float[Array, "dof"]:
    return posed.pose - posed.body.poses["rest"]


def _inverse(body: Body) -> Float[Array, "dof"]:
    """One over the squared expected distances; 0 where there are no limits."""
    return 1.0 / pose_spread(body.skeleton) ** 2
