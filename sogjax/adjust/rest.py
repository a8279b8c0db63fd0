"""Poses near rest: joints that hardly move in anybody, such as collar bones, stay about where they are at rest."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.actor.silhouette_fit import pose_spread
from sogjax.energy.posed import Frame, Posed
from sogjax.energy.term import Penalty
from sogjax.model.body import Body
from sogjax.solve.quadratic import QuadraticModel


class RestPenalty(Penalty):
    """Squared distance from the rest pose, in units of how far each joint is expected from it (`pose_spread`).

    While tracking such joints take up whatever is wrong with the body: raised shoulders, for a shoulder joint that lies
    too high.
    """

    def value(self, posed: Posed, frame: Frame) -> Float[Array, ""]:
        """The sum over the degrees of freedom that have limits."""
        return jnp.sum(_inverse(posed.body) * _away(posed) ** 2)

    def quadratic(self, posed: Posed, frame: Frame) -> QuadraticModel:
        """Exact."""
        slope = 2.0 * self.weight * _inverse(posed.body)
        return QuadraticModel(self.part(posed, frame), -slope * _away(posed), jnp.diag(slope))


def _away(posed: Posed) -> Float[Array, "dof"]:
    return posed.pose - posed.body.poses["rest"]


def _inverse(body: Body) -> Float[Array, "dof"]:
    """One over the squared expected distances; 0 where there are no limits."""
    return 1.0 / pose_spread(body.skeleton) ** 2
