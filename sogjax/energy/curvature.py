"""Eq. 10 as the objective of a tracked frame: its value, and its quadratic model for Gauss-Newton steps.

Each image blob that is not at its cap pulls at the body blobs it resembles, as a spring whose stiffness is the weight
of the pair at the current pose. Springs only ever hold: the curvature is positive semi-definite wherever the pose is.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.objective import EnergyWeights, History, Views, energy, image_caps, penalties
from sogjax.energy.overlap import Pulls, overlap_pulls, self_overlaps
from sogjax.energy.pairs import DensePairs
from sogjax.model.body import Body
from sogjax.model.camera import project, projection_jacobian
from sogjax.model.sog import Sog


class QuadraticModel(NamedTuple):
    """Value, gradient and curvature of an objective at some parameters: value + gradient . d - d . curvature d / 2."""

    value: Float[Array, ""]
    gradient: Float[Array, "param"]
    curvature: Float[Array, "param param"]


class FrameEnergy(eqx.Module):
    """Eq. 10 of one frame as a function of the pose."""

    body: Body
    views: Views
    history: History
    weights: EnergyWeights

    def __call__(self, pose: Float[Array, "dof"]) -> Float[Array, ""]:
        """The energy at a pose."""
        return energy(self.body, pose, self.views, self.history, self.weights)

    def quadratic(self, pose: Float[Array, "dof"]) -> QuadraticModel:
        """Value, gradient and curvature at a pose, the exponentials computed once."""
        skeleton = self.body.skeleton
        frames = skeleton.world_from_joint(pose)
        means = self.body.blobs.points_world(frames)
        blobs = Sog(means, self.body.blob_sigmas, self.body.blob_colors, jnp.ones(means.shape[0], bool))
        value, by_mean, stiffness = _springs(blobs, self.views, self.weights)
        jacobian = skeleton.point_jacobian(frames, self.body.blobs.joints, means)
        stretched = jnp.einsum("bij,bjd->bid", stiffness, jacobian, precision="highest")
        flat = lambda array: array.reshape(-1, array.shape[-1])
        prior = self._priors(pose)
        return QuadraticModel(
            value=value + prior.value,
            gradient=jnp.matmul(by_mean.reshape(-1), flat(jacobian), precision="highest") + prior.gradient,
            curvature=jnp.matmul(flat(jacobian).T, flat(stretched), precision="highest") + prior.curvature,
        )

    def _priors(self, pose: Float[Array, "dof"]) -> QuadraticModel:
        """The penalties of Eq. 10, which are quadratic as they are: their curvature is exact."""
        skeleton = self.body.skeleton
        lower, upper = skeleton.joint_limits()

        def penalty(pose: Float[Array, "dof"]) -> Float[Array, ""]:
            limits, acceleration = penalties(self.body, pose, self.history)
            return self.weights.limit_weight * limits + self.weights.acceleration_weight * acceleration

        value, gradient = jax.value_and_grad(penalty)(pose)
        joint_params = skeleton.joint_params(pose)
        beyond = jnp.where((joint_params < lower) | (joint_params > upper), 2.0, 0.0)
        transform = skeleton.parameter_transform
        limits = jnp.matmul(transform.T, beyond[:, None] * transform, precision="highest")
        smooth = jnp.where(self.history.known, 0.5, 0.0) * jnp.eye(pose.shape[0], dtype=pose.dtype)
        curvature = self.weights.limit_weight * limits + self.weights.acceleration_weight * smooth
        return QuadraticModel(-value, -gradient, curvature)


def _springs(
    blobs: Sog, views: Views, weights: EnergyWeights
) -> tuple[Float[Array, ""], Float[Array, "blob 3"], Float[Array, "blob 3 3"]]:
    """Eq. 9 with its gradient and its stiffness by the blobs' means in the world."""

    def projected(means: Float[Array, "blob 3"]) -> tuple[tuple[Array, Array], Sog]:
        seen = jax.vmap(project, in_axes=(0, None))(views.cameras, eqx.tree_at(lambda b: b.means, blobs, means))
        return (seen.means, seen.sigmas), seen

    _, pull_back, seen = jax.vjp(projected, blobs.means, has_aux=True)
    pulls = _pulls(seen, views, weights)
    scale = 1.0 / (views.normalizers * views.normalizers.shape[0])
    (by_mean,) = pull_back((pulls.by_mean * scale[:, None, None], pulls.by_sigma * scale[:, None]))
    across = jax.vmap(projection_jacobian, in_axes=(0, None))(views.cameras, blobs.means)
    springs = jnp.where(seen.mask, pulls.stiffness, 0.0) * scale[:, None]
    stretched = across * springs[:, :, None, None]
    stiffness = jnp.einsum("cbki,cbkj->bij", across, stretched, precision="highest")
    return jnp.sum(pulls.value * scale), by_mean, stiffness


def _pulls(seen: Sog, views: Views, weights: EnergyWeights) -> Pulls:
    """Pulls of the image blobs at the projected body blobs, for each camera."""
    if views.pairs is not None:
        caps = image_caps(views, views.pairs)
        return overlap_pulls(views.pairs, caps, seen, weights.exponent, capped=weights.capped)

    def one_camera(image: Sog, similarities: Float[Array, "blob image"], seen: Sog) -> Pulls:
        pairs = DensePairs.from_image(image, similarities)
        return overlap_pulls(pairs, self_overlaps(image), seen, weights.exponent, capped=weights.capped)

    return jax.vmap(one_camera)(views.images, views.color_similarities, seen)
