"""A body's lengths from keypoints in space: what bones measure over a clip, and what people's proportions allow."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from sogjax.io.keypoints.scheme import KeypointScheme
from sogjax.model.shape import ShapeModel
from sogjax.search.keypoint_pose import measured_lengths
from sogjax.solve.gauss_newton import GaussNewton, LeastSquares
from sogjax.solve.solution import Scales

LENGTH_NOISE = 0.04
"""Expected deviation of a measured length, as a share of it: detectors' joints are not quite the body's."""
EPSILON, DAMPING, LARGEST_STEP = 1e-4, 1e-7, 0.5
"""Of the fit, in logarithms of scale factors: lengths are products of factors, so the first step nearly solves it."""


def shape_of_keypoints(
    model: ShapeModel, scheme: KeypointScheme, points: Float[np.ndarray, "frame keypoint 3"]
) -> Float[np.ndarray, "shape"] | None:
    """Shape parameters whose bones are as long as those of a person's keypoints (metres; NaN where unknown).

    What no bone tells follows the whole body's size. None where no bone is seen.
    """
    measured = measured_lengths(model.body, scheme, points)
    if not measured:
        return None
    on = scheme.on(model.body.landmarks.names)
    pairs = jnp.asarray(np.array([[on[a], on[b]] for (a, b, _), _ in measured]))
    lengths = jnp.asarray(np.array([length for _, length in measured]), model.spread.dtype)
    return np.asarray(_fitted(_BoneLengths(model, pairs, lengths)))


class _BoneLengths(LeastSquares):
    """How far the bones of a body are from measured lengths, and the shape from what is expected."""

    model: ShapeModel
    pairs: Int[Array, "bone 2"]
    """The landmarks at the ends of each bone."""
    lengths: Float[Array, "bone"]

    def residuals(self, params: Float[Array, "shape"]) -> Float[Array, "residual"]:
        """Logarithms of lengths, and shape parameters, in units of their expected deviations."""
        points = self.model.shaped(params).posed_landmarks(self.model.body.poses["rest"])
        own = jnp.linalg.norm(points[self.pairs[:, 0]] - points[self.pairs[:, 1]], axis=-1)
        return jnp.concatenate([jnp.log(own / self.lengths) / LENGTH_NOISE, params / self.model.spread])


@eqx.filter_jit
def _fitted(fit: _BoneLengths) -> Float[Array, "shape"]:
    start = jnp.zeros_like(fit.model.spread)
    solver = GaussNewton(epsilon=EPSILON, first_damping=DAMPING, smallest_damping=DAMPING, common_damping=0.0)
    steps = jnp.asarray([LARGEST_STEP], start.dtype)
    return solver.maximize(fit, start, Scales(jnp.zeros(start.shape, jnp.int32), steps, steps)).params
