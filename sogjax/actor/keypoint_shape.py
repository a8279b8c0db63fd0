"""A body's lengths from keypoints in space: what bones measure over a clip, and what people's proportions allow."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from sogjax.io.keypoints.scheme import KeypointScheme
from sogjax.model.shape import ShapeModel
from sogjax.search.keypoint_pose import measured_lengths

LENGTH_NOISE = 0.04
"""Expected deviation of a measured length, as a share of it: detectors' joints are not quite the body's."""
ITERATIONS = 4
"""Of Gauss-Newton; lengths are products of factors, so the first one nearly solves it."""


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
    return np.asarray(_fitted(model, pairs, lengths))


@eqx.filter_jit
def _fitted(model: ShapeModel, pairs: Int[Array, "bone 2"], lengths: Float[Array, "bone"]) -> Float[Array, "shape"]:
    rest = model.body.poses["rest"]

    def residuals(shape_params):
        points = model.shaped(shape_params).posed_landmarks(rest)
        own = jnp.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=-1)
        return jnp.concatenate([jnp.log(own / lengths) / LENGTH_NOISE, shape_params / model.spread])

    shape_params = jnp.zeros_like(model.spread)
    for _ in range(ITERATIONS):
        jacobian, value = jax.jacfwd(residuals)(shape_params), residuals(shape_params)
        shape_params = shape_params - jnp.linalg.solve(jacobian.T @ jacobian, jacobian.T @ value)
    return shape_params
