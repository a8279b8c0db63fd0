"""The quadratic model of an objective near some parameters."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

Params = Float[Array, "param"]


class QuadraticModel(eqx.Module):
    """value + gradient . d - d . curvature d / 2, a model of an objective at a distance d from some parameters.

    The models of summands add up to the model of their sum.
    """

    value: Float[Array, ""]
    gradient: Params
    curvature: Float[Array, "param param"]
    """Positive semi-definite where the model is to be climbed."""

    def __add__(self, other: "QuadraticModel") -> "QuadraticModel":
        return jax.tree.map(jnp.add, self, other)

    def finite(self) -> Bool[Array, ""]:
        """Whether every number is finite."""
        return jnp.isfinite(self.value) & jnp.all(jnp.isfinite(self.gradient)) & jnp.all(jnp.isfinite(self.curvature))

    def step(self, damping: Float[Array, ""], common: Float[Array, ""], bounds: Params) -> Params:
        """The step to the maximum of the damped model, shortened as a whole where a part of it exceeds its bound."""
        # In units of the bounds, so that angles and translations are alike.
        curvature = self.curvature * bounds[:, None] * bounds[None, :]
        diagonal = jnp.diag(curvature)
        held = jnp.maximum(diagonal + common * jnp.mean(diagonal), jnp.finfo(diagonal.dtype).tiny)
        damped = curvature + jnp.diag(damping * held)
        factor = jax.scipy.linalg.cho_factor(damped)
        step = jax.scipy.linalg.cho_solve(factor, self.gradient * bounds)
        return bounds * step / jnp.maximum(jnp.max(jnp.abs(step)), 1.0)

    def expected_gain(self, step: Params) -> Float[Array, ""]:
        """How far the model rises along a step."""
        bend = jnp.matmul(self.curvature, step, precision="highest")
        return jnp.sum(step * (self.gradient - 0.5 * bend))
