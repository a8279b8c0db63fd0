"""All example poses and one shape, fitted to the edges of the masks by Gauss-Newton steps."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.actor.coverage import Silhouettes, mismatch, mismatch_equations
from sogjax.actor.shape import ShapeModel
from sogjax.energy.limits import limit_penalty
from sogjax.energy.rest import pose_spread
from sogjax.solve import GaussNewton, QuadraticModel, Scales, Solution

NOISE = 1e-3
"""Weight of the priors: the mismatch (as a part of the mask's area) that tells as little as half a squared standard
deviation of a prior. It is what blobs, being round, cannot fit, and by far the largest part of the noise."""
MAX_ITERATIONS = 60
EPSILON = 0.02
"""Length of the step of some two hundred parameters (radians, metres, logarithms) below which the fit ends."""
DAMPING = 1e-3
"""Least damping: the problem is well posed by its priors, and flat valleys want long steps."""


class SilhouetteFit(eqx.Module):
    """Minus the mismatch of all example poses, less priors, as a function of the poses and the shape parameters.

    The parameters are the poses one after the other, then the shape.
    """

    model: ShapeModel
    silhouettes: Silhouettes
    """With a leading axis for the poses."""

    @property
    def num_poses(self) -> int:
        """Number of example poses."""
        return self.silhouettes.mask.shape[0]

    def split(self, params: Float[Array, "param"]) -> tuple[Float[Array, "pose dof"], Float[Array, "shape"]]:
        """Poses and shape parameters."""
        num = self.num_poses * self.model.body.skeleton.num_dofs
        return params[:num].reshape(self.num_poses, -1), params[num:]

    def __call__(self, params: Float[Array, "param"]) -> Float[Array, ""]:
        """Minus the mean mismatch of the poses, less the priors."""
        poses, shape = self.split(params)
        one_pose = lambda pose, silhouettes: mismatch(_blobs(self.model, pose, shape), silhouettes)
        misses = jax.lax.map(lambda item: one_pose(*item), (poses, self.silhouettes))
        penalties = jax.vmap(self._pose_penalty)(poses)
        return -jnp.mean(misses + penalties) - self._shape_penalty(shape)

    def quadratic(self, params: Float[Array, "param"]) -> QuadraticModel:
        """Value, gradient, and a curvature that is positive semi-definite."""
        poses, shape = self.split(params)
        parts = jax.lax.map(lambda item: self._pose_equations(item[0], shape, item[1]), (poses, self.silhouettes))
        gradient, curvature = parts.gradient, parts.curvature
        dofs = poses.shape[1]
        prior_value, prior_slope = jax.value_and_grad(self._shape_penalty)(shape)
        own = jax.scipy.linalg.block_diag(*curvature[:, :dofs, :dofs])
        shared = curvature[:, :dofs, dofs:].reshape(-1, shape.shape[0])
        corner = jnp.mean(curvature[:, dofs:, dofs:], axis=0) + jax.hessian(self._shape_penalty)(shape)
        scale = 1.0 / self.num_poses
        return QuadraticModel(
            -jnp.mean(parts.value) - prior_value,
            -jnp.concatenate(
                [scale * gradient[:, :dofs].reshape(-1), jnp.mean(gradient[:, dofs:], axis=0) + prior_slope]
            ),
            jnp.block([[scale * own, scale * shared], [scale * shared.T, corner]]),
        )

    def _pose_equations(self, pose, shape, silhouettes) -> QuadraticModel:
        """One pose's part of the cost (not the objective), by its degrees of freedom and the shape."""
        dofs = pose.shape[0]
        of_params = lambda params: _blobs(self.model, params[:dofs], params[dofs:])
        params = jnp.concatenate([pose, shape])
        parts = mismatch_equations(of_params(params), jax.jacfwd(of_params)(params), silhouettes)
        value, slope = jax.value_and_grad(self._pose_penalty)(pose)
        return QuadraticModel(
            parts.value + value,
            (2.0 * parts.gradient).at[:dofs].add(slope),
            (2.0 * parts.matrix).at[:dofs, :dofs].add(jax.hessian(self._pose_penalty)(pose)),
        )

    def _pose_penalty(self, pose: Float[Array, "dof"]) -> Float[Array, ""]:
        skeleton = self.model.body.skeleton
        lower, upper = skeleton.joint_limits()
        unusual = jnp.sum(((pose - self.model.body.poses["rest"]) / pose_spread(skeleton)) ** 2)
        return limit_penalty(skeleton.joint_params(pose), lower, upper) + NOISE * unusual

    def _shape_penalty(self, shape: Float[Array, "shape"]) -> Float[Array, ""]:
        return NOISE * jnp.sum((shape / self.model.spread) ** 2)

    def deviations(self, params: Float[Array, "param"]) -> Float[Array, "param"]:
        """Standard deviation of every parameter given all pictures and the priors, from the curvature.

        What no picture determines keeps the deviation of its prior.
        """
        curvature = self.quadratic(params).curvature
        return jnp.sqrt(2.0 * NOISE * jnp.maximum(jnp.diag(jnp.linalg.pinv(curvature, hermitian=True)), 0.0))


def fitted(fit: SilhouetteFit, start: Float[Array, "param"], pose_scales: Scales) -> Solution:
    """The best poses and shape near a start."""
    num_shape = fit.model.num_shape_params
    scales = scales_with_shape(pose_scales, fit.num_poses, num_shape)
    return _fitted(fit, start, scales)


@eqx.filter_jit
def _fitted(fit: SilhouetteFit, start: Float[Array, "param"], scales: Scales) -> Solution:
    solver = GaussNewton(
        epsilon=EPSILON, max_iterations=MAX_ITERATIONS, first_damping=0.1, smallest_damping=DAMPING, common_damping=0.0
    )
    return solver.maximize(fit, start, scales)


def scales_with_shape(pose: Scales, num_poses: int, num_shape_params: int) -> Scales:
    """The pose's scales for every example pose, and one more kind for the shape parameters."""
    kinds, num_kinds = np.asarray(pose.kinds), pose.first_steps.shape[0]
    return Scales(
        kinds=jnp.asarray(np.append(np.tile(kinds, num_poses), np.full(num_shape_params, num_kinds, kinds.dtype))),
        first_steps=jnp.append(pose.first_steps, 0.01),
        largest_steps=jnp.append(pose.largest_steps, 0.05),
    )


def _blobs(model: ShapeModel, pose: Float[Array, "dof"], shape: Float[Array, "shape"]) -> Float[Array, "blob 4"]:
    """Means and sigmas (metres, world)."""
    blobs = model.shaped(shape).posed_blobs(pose)
    return jnp.concatenate([blobs.means, blobs.sigmas[:, None]], axis=1)
