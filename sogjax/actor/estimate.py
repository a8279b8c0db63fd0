"""An actor from example poses (Section 5.2): all poses and one set of shape parameters, climbed together."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.actor.shape import ShapeModel
from sogjax.energy.objective import EnergyWeights, Views, similarity
from sogjax.energy.priors import limit_penalty
from sogjax.model.body import Body
from sogjax.solve import ConditionedAscent, Scales
from sogjax.track.scales import pose_scales

SHAPE_SPREAD = 0.10
"""Expected deviation of a group's scale factor from the whole body's (logarithm)."""
SHAPE_WEIGHT = 0.00003
"""Weight of one squared deviation of that size, in units of the similarity of Eq. 9."""


class Estimate(eqx.Module):
    """The poses of the example pictures and the shape parameters they share."""

    poses: Float[Array, "pose dof"]
    shape_params: Float[Array, "shape"]
    score: Float[Array, ""]
    """The mean of Eq. 9 over the poses, less the limits' and the shape's penalties."""
    iterations: Array


def estimate_shape(
    model: ShapeModel,
    poses: Float[Array, "pose dof"],
    shape_params: Float[Array, "shape"],
    views: Views,
    weights: EnergyWeights,
    max_iterations: int = 150,
) -> Estimate:
    """Climb the mean of Eq. 9 over the example poses, from rough poses and shape parameters.

    `views` has a leading axis for the poses (`stack_views`).
    """
    scales = _scales(pose_scales(model.body.skeleton), poses.shape[0], shape_params.shape[0])
    return _climb(model, poses, shape_params, views, weights, scales, max_iterations)


@eqx.filter_jit
def _climb(model, poses, shape_params, views, weights, scales, max_iterations) -> Estimate:
    num_poses, num_dofs = poses.shape

    def objective(params: Float[Array, "param"]) -> Float[Array, ""]:
        poses = params[: num_poses * num_dofs].reshape(num_poses, num_dofs)
        shape = params[num_poses * num_dofs :]
        body = model.shaped(shape)
        scores = jax.vmap(pose_score, in_axes=(None, 0, 0, None))(body, poses, views, weights)
        unusual = jnp.sum((shape[1:] / SHAPE_SPREAD) ** 2)
        return jnp.mean(scores) - SHAPE_WEIGHT * unusual

    start = jnp.concatenate([poses.reshape(-1), shape_params])
    solver = ConditionedAscent(max_iterations=max_iterations)
    solution = solver.maximize(objective, start, scales)
    return Estimate(
        solution.params[: num_poses * num_dofs].reshape(num_poses, num_dofs),
        solution.params[num_poses * num_dofs :],
        solution.value,
        solution.iterations,
    )


def pose_score(body: Body, pose: Float[Array, "dof"], views: Views, weights: EnergyWeights) -> Float[Array, ""]:
    """Eq. 9 with the limits of Eq. 10: there is no motion to be smooth."""
    lower, upper = body.skeleton.joint_limits()
    limits = limit_penalty(body.skeleton.joint_params(pose), lower, upper)
    return similarity(body.posed_blobs(pose), views, weights) - weights.limit_weight * limits


def _scales(pose: Scales, num_poses: int, num_shape_params: int) -> Scales:
    """The pose's scales for every example pose, and one more kind for the shape parameters."""
    num_kinds = pose.first_steps.shape[0]
    return Scales(
        kinds=jnp.concatenate(
            [jnp.tile(pose.kinds, num_poses), jnp.full(num_shape_params, num_kinds, pose.kinds.dtype)]
        ),
        first_steps=jnp.append(pose.first_steps, 0.01),
        largest_steps=jnp.append(pose.largest_steps, 0.05),
    )
