"""Optimistix's minimisers behind the interface of the ascent: BFGS, L-BFGS and nonlinear conjugate gradients."""

from collections.abc import Callable
from typing import Any, Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float, Int

from sogjax.solve.solution import Objective, Params, Scales, Solution

Method = Literal["bfgs", "lbfgs", "nonlinear_cg"]


def _nonlinear_cg(rtol: Any, atol: Any) -> optx.NonlinearCG:
    """Conjugate gradients whose step length is carried on, since nothing else tells them how far to go.

    Optimistix's own line search starts every step at the length of the gradient, which shrinks towards the optimum:
    it stops far from it.
    """
    search = optx.LinearTrustRegion(high_cutoff=0.6, low_cutoff=0.1, high_constant=2.0, low_constant=0.5)
    return optx.NonlinearCG(rtol=rtol, atol=atol, search=search)


_MINIMISERS: dict[str, Callable] = {"bfgs": optx.BFGS, "lbfgs": optx.LBFGS, "nonlinear_cg": _nonlinear_cg}


class OptimistixSolver(eqx.Module):
    """One of optimistix's minimisers, with a line search of its own.

    The parameters are measured in `Scales.first_steps`, so that one unit means the same for angles and translations,
    and the objective in its change over the first step along its gradient, which makes the tolerances
    (`epsilon` on steps, in radians and metres) and the first step those of the ascent.
    """

    method: Method = eqx.field(static=True, default="bfgs")
    epsilon: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=0.002)
    max_iterations: Int[Array, ""] = eqx.field(converter=jnp.asarray, default=200)

    def maximize(self, objective: Objective, start: Params, scales: Scales) -> Solution:
        """Minimise the negative objective from `start`; line-search steps count as iterations."""
        with_gradient = jax.value_and_grad(objective)
        first_value, gradient = with_gradient(start)
        units = scales.first_steps[scales.kinds]
        largest = jnp.max(jnp.abs(gradient * units))
        gain = jnp.where(largest > 0.0, largest, 1.0)
        cost = lambda z: (first_value - objective(start + z * units)) / gain
        tolerance = self.epsilon / jnp.max(units)
        best_of = optx.BestSoFarMinimiser(_MINIMISERS[self.method](rtol=0.0, atol=tolerance))
        solver = _Bounded(
            minimiser=best_of, most=self.max_iterations, rtol=best_of.rtol, atol=best_of.atol, norm=best_of.norm
        )
        result = optx.minimise(lambda z, _: cost(z), solver, jnp.zeros_like(start), max_steps=None, throw=False)
        params = start + result.value * units
        value = objective(params)
        usable = jnp.isfinite(value) & (value >= first_value)
        steps = jnp.asarray(result.stats["num_steps"])
        return Solution(
            params=jnp.where(usable, params, start),
            value=jnp.where(usable, value, first_value),
            iterations=steps,
            evaluations=steps + 2,
            converged=(result.result == optx.RESULTS.successful) & usable,
        )


class _Bounded(optx.AbstractMinimiser):
    """A minimiser that stops after some steps, a number that need not be known when it is compiled."""

    minimiser: optx.AbstractMinimiser
    most: Int[Array, ""]
    rtol: Any
    atol: Any
    norm: Any

    def init(
        self, fn: Any, y: Any, args: Any, options: Any, f_struct: Any, aux_struct: Any, tags: Any
    ) -> tuple[Any, Int[Array, ""]]:
        return self.minimiser.init(fn, y, args, options, f_struct, aux_struct, tags), jnp.asarray(0)

    def step(self, fn: Any, y: Any, args: Any, options: Any, state: Any, tags: Any) -> tuple[Any, Any, Any]:
        inner, count = state
        y, inner, aux = self.minimiser.step(fn, y, args, options, inner, tags)
        return y, (inner, count + 1), aux

    def terminate(
        self, fn: Any, y: Any, args: Any, options: Any, state: Any, tags: Any
    ) -> tuple[Bool[Array, ""], optx.RESULTS]:
        inner, count = state
        done, result = self.minimiser.terminate(fn, y, args, options, inner, tags)
        full = ~done & (count >= self.most)
        return done | full, optx.RESULTS.where(full, optx.RESULTS.nonlinear_max_steps_reached, result)

    def postprocess(
        self, fn: Any, y: Any, aux: Any, args: Any, options: Any, state: Any, tags: Any, result: Any
    ) -> tuple[Any, Any, dict[str, Any]]:
        return self.minimiser.postprocess(fn, y, aux, args, options, state[0], tags, result)
