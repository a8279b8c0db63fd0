"""An actor from example poses (Section 5.2): all poses and one set of shape parameters, climbed together.

First Eq. 9 on the binary colours of the silhouettes, which forgives a start that is far off; then the edges of the
silhouettes themselves, which say exactly where limbs end.
"""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from sogjax.actor.coverage import Silhouettes
from sogjax.actor.shape import ShapeModel
from sogjax.actor.silhouette_fit import SilhouetteFit, fitted, scales_with_shape
from sogjax.energy.frame_energy import still_energy
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.solve import ConditionedAscent, Scales
from sogjax.tracking.scales import pose_scales

SHAPE_WEIGHT = 3e-5
"""Weight of the shape's prior in units of the similarity of Eq. 9."""
CLIMB_ITERATIONS = 150


class Estimate(eqx.Module):
    """The poses of the example pictures, the shape parameters they share, and how certain both are."""

    poses: Float[Array, "pose dof"]
    shape_params: Float[Array, "shape"]
    pose_deviations: Float[Array, "pose dof"]
    """Standard deviations, radians and metres."""
    shape_deviations: Float[Array, "shape"]
    """Standard deviations of the logarithms of scale factors."""
    mismatch: Float[Array, ""]
    """What was minimised: the area where body and masks differ as a part of the masks' area, with the priors."""
    iterations: Int[Array, ""]
    converged: Bool[Array, ""]


def estimate_shape(
    model: ShapeModel,
    poses: Float[Array, "pose dof"],
    views: Views,
    silhouettes: Silhouettes,
    terms: Terms,
) -> Estimate:
    """The poses and the one shape that fit all masks best, from rough poses.

    `views` and `silhouettes` have a leading axis for the poses.
    """
    scales = pose_scales(model.body.skeleton)
    no_shape = jnp.zeros(model.num_shape_params, poses.dtype)
    start = climbed_together(model, poses, no_shape, views, terms)
    fit = SilhouetteFit(model, silhouettes)
    solution = fitted(fit, start, scales)
    poses_deviation, shape_deviation = fit.split(_deviations(fit, solution.params))
    best_poses, shape = fit.split(solution.params)
    return Estimate(
        best_poses, shape, poses_deviation, shape_deviation, -solution.value, solution.iterations, solution.converged
    )


_deviations = eqx.filter_jit(SilhouetteFit.deviations)


def climbed_together(
    model: ShapeModel,
    poses: Float[Array, "pose dof"],
    shape_params: Float[Array, "shape"],
    views: Views,
    terms: Terms,
    max_iterations: int = CLIMB_ITERATIONS,
) -> Float[Array, "param"]:
    """The mean of Eq. 9 over the example poses, climbed; the poses one after the other, then the shape."""
    scales = scales_with_shape(pose_scales(model.body.skeleton), poses.shape[0], shape_params.shape[0])
    start = jnp.concatenate([poses.reshape(-1), shape_params])
    return _climb(model, start, poses.shape[0], views, terms, scales, max_iterations)


@eqx.filter_jit
def _climb(
    model: ShapeModel,
    start: Float[Array, "param"],
    num_poses: int,
    views: Views,
    terms: Terms,
    scales: Scales,
    max_iterations: Any,
) -> Float[Array, "param"]:
    num_pose_params = num_poses * model.body.skeleton.num_dofs

    def objective(params: Float[Array, "param"]) -> Float[Array, ""]:
        shape = params[num_pose_params:]
        poses = params[:num_pose_params].reshape(num_poses, -1)
        scores = jax.vmap(still_energy, in_axes=(None, 0, 0, None))(model.shaped(shape), poses, views, terms)
        return jnp.mean(scores) - SHAPE_WEIGHT * jnp.sum((shape / model.spread) ** 2)

    return ConditionedAscent(max_iterations=max_iterations).maximize(objective, start, scales).params
