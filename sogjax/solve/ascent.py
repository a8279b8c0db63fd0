"""Gradient ascent, conditioned as in Eq. 11 and 12 or plain, in one `lax.while_loop`."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from sogjax.solve.solution import Objective, Params, Scales, Solution


class AscentState(eqx.Module):
    """State before iteration `iteration`: the pose it starts from, with its value and gradient.

    Before iteration -1 nothing is known: that one looks at the start, so that a program holds the objective once.
    """

    params: Params
    value: Float[Array, ""]
    gradient: Params
    first_sizes: Params
    step_sizes: Params
    best_params: Params
    best_value: Float[Array, ""]
    iteration: Int[Array, ""]
    converged: Bool[Array, ""]
    finite: Bool[Array, ""]


class ConditionedAscent(eqx.Module):
    """Gradient ascent with a step size for each parameter (Eq. 11).

    A step size grows by `grow` (mu+) where the gradient keeps its sign and shrinks by `shrink` (mu-) where it does
    not (Eq. 12), never below `smallest_step_size` times its first value, since Eq. 12's "<= 0" would also halve it
    for ever where a gradient is exactly 0. At least `min_iterations` (n_iter) are made; then the ascent stops when the
    step is shorter than `epsilon`. With grow = shrink = 1 this is plain gradient ascent.
    """

    epsilon: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=0.002)
    grow: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=1.2)
    shrink: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=0.5)
    smallest_step_size: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=1e-3)
    min_iterations: Int[Array, ""] = eqx.field(converter=jnp.asarray, default=10)
    max_iterations: Int[Array, ""] = eqx.field(converter=jnp.asarray, default=200)

    def maximize(self, objective: Objective, start: Params, scales: Scales) -> Solution:
        """Climb from `start`; the best parameters seen are returned."""
        value_and_gradient = jax.value_and_grad(objective)
        unknown, nowhere = jnp.asarray(-jnp.inf, start.dtype), jnp.zeros_like(start)
        state = AscentState(
            params=start,
            value=unknown,
            gradient=nowhere,
            first_sizes=nowhere,
            step_sizes=nowhere,
            best_params=start,
            best_value=unknown,
            iteration=jnp.asarray(-1),
            converged=jnp.asarray(False),
            finite=jnp.asarray(True),
        )

        def unfinished(state: AscentState) -> Bool[Array, ""]:
            return ~state.converged & state.finite & (state.iteration < self.max_iterations)

        def climb(state: AscentState) -> AscentState:
            at_start = state.iteration < 0
            step = jnp.clip(state.gradient * state.step_sizes, -scales.step_bounds, scales.step_bounds)
            params = state.params + step
            value, gradient = value_and_gradient(params)
            first_sizes = jnp.where(at_start, scales.first_step_sizes(gradient), state.first_sizes)
            step_sizes = jnp.where(at_start, first_sizes, self._next_step_sizes(state, gradient))
            better = at_start | (value > state.best_value)
            small = jnp.linalg.norm(step) < self.epsilon
            return AscentState(
                params=params,
                value=value,
                gradient=gradient,
                first_sizes=first_sizes,
                step_sizes=step_sizes,
                best_params=jnp.where(better, params, state.best_params),
                best_value=jnp.where(better, value, state.best_value),
                iteration=state.iteration + 1,
                converged=~at_start & small & (state.iteration + 1 >= self.min_iterations),
                finite=_all_finite(value, gradient),
            )

        end = jax.lax.while_loop(unfinished, climb, state)
        return Solution(end.best_params, end.best_value, end.iteration, end.iteration + 1, end.converged & end.finite)

    def _next_step_sizes(self, state: AscentState, gradient: Params) -> Params:
        """Eq. 12."""
        same_sign = gradient * state.gradient > 0.0
        sizes = state.step_sizes * jnp.where(same_sign, self.grow, self.shrink)
        return jnp.maximum(sizes, self.smallest_step_size * state.first_sizes)


def gradient_ascent(epsilon: float = 0.002, min_iterations: int = 10, max_iterations: int = 400) -> ConditionedAscent:
    """Plain gradient ascent: the conditioned one whose step sizes stay as they are."""
    return ConditionedAscent(
        epsilon=epsilon, grow=1.0, shrink=1.0, min_iterations=min_iterations, max_iterations=max_iterations
    )


def _all_finite(value: Float[Array, ""], gradient: Params) -> Bool[Array, ""]:
    return jnp.isfinite(value) & jnp.all(jnp.isfinite(gradient))
