"""Damped Gauss-Newton (Levenberg-Marquardt) ascent in one `lax.while_loop`, and sums of squares to be climbed."""

import abc

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from sogjax.solve.solution import CurvedObjective, Objective, Params, QuadraticModel, Scales, Solution


class LeastSquares(eqx.Module):
    """Minus a sum of squared residuals, with the curvature by Gauss and Newton; a `CurvedObjective`."""

    @abc.abstractmethod
    def residuals(self, params: Params) -> Float[Array, "residual"]:
        """What is squared and summed."""

    def __call__(self, params: Params) -> Float[Array, ""]:
        """Minus the sum of squares."""
        return -jnp.sum(self.residuals(params) ** 2)

    def quadratic(self, params: Params) -> QuadraticModel:
        """The value with its gradient, and the curvature as if the residuals were linear."""
        residuals, jacobian = self.residuals(params), jax.jacfwd(self.residuals)(params)
        product = lambda a, b: jnp.matmul(a, b, precision="highest")
        return QuadraticModel(
            -jnp.sum(residuals**2), -2.0 * product(jacobian.T, residuals), 2.0 * product(jacobian.T, jacobian)
        )


class GaussNewtonState(eqx.Module):
    """State before an iteration: the best parameters so far, the model there, and the damping to try next.

    Before iteration -1 there is no model: that one looks at the start, so that a program holds the objective once.
    """

    params: Params
    model: QuadraticModel
    damping: Float[Array, ""]
    iteration: Int[Array, ""]
    converged: Bool[Array, ""]
    finite: Bool[Array, ""]


class GaussNewton(eqx.Module):
    """Steps to the maximum of the objective's own quadratic model, accepted only where the objective rises.

    The damping (a part of the curvature) is divided by `relax` after a step that gained what it was
    expected to, and multiplied by `stiffen` after one that gained much less or was not taken. At least
    `min_iterations` are made; then the ascent stops when a step is shorter than `epsilon`, taken or not.
    """

    epsilon: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=0.01)
    first_damping: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=0.1)
    smallest_damping: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=0.1)
    common_damping: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=3.0)
    """Damping of every parameter by the mean curvature (measured in the parameters' largest steps), beside that by its
    own: parameters of which the objective says next to nothing stay about where they are."""
    relax: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=4.0)
    stiffen: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=4.0)
    min_iterations: Int[Array, ""] = eqx.field(converter=jnp.asarray, default=1)
    max_iterations: Int[Array, ""] = eqx.field(converter=jnp.asarray, default=50)

    def maximize(self, objective: Objective, start: Params, scales: Scales) -> Solution:
        """Climb from `start`.

        Raises:
            TypeError: the objective gives no quadratic model of itself.
        """
        end = self.climbed(objective, start, scales)
        converged = end.converged & end.finite
        return Solution(end.params, end.model.value, end.iteration, end.iteration + 1, converged)

    def climbed(self, objective: Objective, start: Params, scales: Scales) -> GaussNewtonState:
        """As `maximize`, but the state in which the climb ends: the model there tells how certain parameters are.

        Raises:
            TypeError: the objective gives no quadratic model of itself.
        """
        if not isinstance(objective, CurvedObjective):
            raise TypeError("Gauss-Newton needs an objective with a method `quadratic` (CurvedObjective)")
        state = GaussNewtonState(
            params=start,
            model=QuadraticModel.unknown(start),
            damping=jnp.asarray(self.first_damping, start.dtype),
            iteration=jnp.asarray(-1),
            converged=jnp.asarray(False),
            finite=jnp.asarray(True),
        )

        def unfinished(state: GaussNewtonState) -> Bool[Array, ""]:
            return ~state.converged & state.finite & (state.iteration < self.max_iterations)

        def climb(state: GaussNewtonState) -> GaussNewtonState:
            at_start = state.iteration < 0
            step = state.model.step(state.damping, self.common_damping, scales.step_bounds)
            tried = objective.quadratic(state.params + step)
            better = at_start | ((tried.value > state.model.value) & tried.finite())
            keep = lambda new, old: jnp.where(better, new, old)
            small = jnp.linalg.norm(step) < self.epsilon
            gain = (tried.value - state.model.value) / state.model.expected_gain(step)
            damping = self._next_damping(state.damping, jnp.where(better, gain, -1.0))
            return GaussNewtonState(
                params=keep(state.params + step, state.params),
                model=jax.tree.map(keep, tried, state.model),
                damping=jnp.where(at_start, state.damping, damping),
                iteration=state.iteration + 1,
                converged=~at_start & small & (state.iteration + 1 >= self.min_iterations),
                finite=jnp.all(jnp.isfinite(step)) & (~at_start | tried.finite()),
            )

        return jax.lax.while_loop(unfinished, climb, state)

    def _next_damping(self, damping: Float[Array, ""], gain: Float[Array, ""]) -> Float[Array, ""]:
        """Less where the objective rose by about as much as the model expected, more where by much less or not."""
        factor = jnp.where(gain > 0.75, 1.0 / self.relax, jnp.where(gain > 0.25, 1.0, self.stiffen))
        return jnp.maximum(damping * factor, self.smallest_damping)
