"""Poses of a body whose landmarks lie near some points, a few of which may be far off."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from sogjax.model.body import Body
from sogjax.model.program import compiled
from sogjax.solve.gauss_newton import GaussNewton, LeastSquares
from sogjax.tracking.solving import pose_scales

ANYWHERE = 1e6
"""Times the noise, for points none of which is doubted."""
MAX_ITERATIONS = 60
EPSILON = 1e-3
"""Length of a step (radians, metres) below which a fit ends."""
DAMPING, SMALLEST_DAMPING = 1e-2, 1e-6
LARGEST_ANGLE, LARGEST_TRANSLATION = 0.5, 0.5
"""Bounds on a step (radians, metres)."""
LIMITS = 30.0
"""A joint a thirtieth of a radian beyond its limit counts as much as a point that is off by its noise."""


class Points(eqx.Module):
    """Where landmarks of a body should lie, and how much is known of it."""

    landmarks: Int[Array, "point"]
    """Their numbers in the body."""
    places: Float[Array, "point 3"]
    """Metres, world."""
    noise: Float[Array, "point"]
    """Metres that a point is expected to be off."""
    known: Float[Array, "point"]
    """1 or 0."""


class PointFit(LeastSquares):
    """Minus the squared distances from points, in units of their noise, by Cauchy's loss; within the joints' limits.

    A point `far` times its noise away counts half as much as by its square, and less beyond.
    """

    body: Body
    points: Points
    far: Float[Array, ""]
    start: Float[Array, "dof"]
    spread: Float[Array, "dof"]
    """How far each degree of freedom is expected to lie from the start."""

    def residuals(self, params: Float[Array, "dof"]) -> Float[Array, "residual"]:
        """The misses of the points, the way from the start, and how far joints are beyond their limits, at a pose."""
        pose, points, skeleton = params, self.points, self.body.skeleton
        misses = (self.body.posed_landmarks(pose)[points.landmarks] - points.places) / points.noise[:, None]
        squared = jnp.sum(misses**2, axis=-1) / self.far**2
        loss = jnp.where(squared > 1e-6, jnp.log1p(squared) / jnp.maximum(squared, 1e-6), 1.0)
        of_points = misses * (jnp.sqrt(loss) * points.known)[:, None]
        angles, (lower, upper) = skeleton.joint_params(pose), skeleton.joint_limits()
        beyond = jnp.maximum(lower - angles, 0.0) + jnp.maximum(angles - upper, 0.0)
        return jnp.concatenate([of_points.reshape(-1), (pose - self.start) / self.spread, LIMITS * beyond])


def fitted_to_points(
    body: Body, starts: Float[Array, "start dof"], points: Points, far: Float[Array, ""], spread: Float[Array, "dof"]
) -> tuple[Float[Array, "start dof"], Float[Array, "start"]]:
    """The best pose near each start, and what it costs; infinite where there is none."""
    scales = pose_scales(body.skeleton, largest_angle=LARGEST_ANGLE, largest_translation=LARGEST_TRANSLATION)
    return _fitted(body, starts, points, far, spread, scales)


@compiled
def _fitted(body, starts, points, far, spread, scales):
    solver = GaussNewton(
        epsilon=EPSILON,
        max_iterations=MAX_ITERATIONS,
        first_damping=DAMPING,
        smallest_damping=SMALLEST_DAMPING,
        common_damping=0.0,
    )
    climb = lambda start: solver.maximize(PointFit(body, points, far, start, spread), start, scales)
    found = jax.vmap(climb)(starts)
    return found.params, jnp.where(jnp.isfinite(found.value), -found.value, jnp.inf)
