"""How sure a pose is: a standard deviation of every degree of freedom and every joint, from the energy's curvature."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.model.skeleton import Skeleton

FREE_RANGE = (12.0**0.5, 2.0 * jnp.pi)
"""Range of a degree of freedom without limits, for the prior: metres (a standard deviation of 1 m) and radians."""


class Deviations(eqx.Module):
    """Standard deviations of one frame."""

    pose: Float[Array, "dof"]
    """Radians and metres."""
    joints: Float[Array, "joint"]
    """Metres: the root of the mean squared distance of a joint from where it was found."""


class Laplace(eqx.Module):
    """The pose as a Gaussian around the optimum of Eq. 10: exp(energy / temperature) (Laplace's approximation).

    The curvature is that of the springs (`FrameEnergy.quadratic`), which is never negative. Its penalties are part of
    it, and each degree of freedom keeps the width of its limits as a prior, so that what no picture tells stays
    bounded. Errors of the model, such as wrong bone lengths, are known to it only as far as the temperature was
    calibrated on recordings that have them.
    """

    temperature: Float[Array, ""] = eqx.field(converter=jnp.asarray)
    """The energy is no log-likelihood: this number makes it one."""

    def deviations(
        self, skeleton: Skeleton, curvature: Float[Array, "dof dof"], pose: Float[Array, "dof"]
    ) -> Deviations:
        """At the optimum of a frame, whose energy has this curvature there (negated: never negative)."""
        covariance = self.covariance(curvature, skeleton)
        frames = skeleton.world_from_joint(pose)
        jacobian = skeleton.point_jacobian(frames, tuple(range(skeleton.num_joints)), frames[:, :3, 3])
        spread = jnp.einsum("jid,de,jie->j", jacobian, covariance, jacobian, precision="highest")
        return Deviations(_root(jnp.diagonal(covariance)), _root(spread))

    def covariance(self, curvature: Float[Array, "dof dof"], skeleton: Skeleton) -> Float[Array, "dof dof"]:
        """Of the pose."""
        precision = curvature / self.temperature + jnp.diag(range_precision(skeleton))
        # Angles and translations differ by orders of magnitude: unit diagonal before the inversion.
        scale = jnp.sqrt(1.0 / jnp.diagonal(precision))
        return scale[:, None] * jnp.linalg.inv(precision * scale[:, None] * scale[None, :]) * scale[None, :]


def range_precision(skeleton: Skeleton) -> Float[Array, "dof"]:
    """Inverse variance of each degree of freedom that may be anywhere within its limits."""
    width = skeleton.dof_upper - skeleton.dof_lower
    turns = jnp.any((jnp.abs(skeleton.parameter_transform) > 0.0) & skeleton.revolute[:, None], axis=0)
    free = jnp.where(turns, FREE_RANGE[1], FREE_RANGE[0])
    width = jnp.minimum(jnp.where(jnp.isfinite(width), width, free), free)
    return 12.0 / jnp.maximum(width, 1e-3) ** 2


def _root(values: Float[Array, "_"]) -> Float[Array, "_"]:
    return jnp.sqrt(jnp.maximum(values, 0.0))
