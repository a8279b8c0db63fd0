"""What every solver takes and returns: objectives, their quadratic models, scales of steps, solutions."""

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from sogjax.solve.linear import solve_positive

Params = Float[Array, "param"]


class QuadraticModel(eqx.Module):
    """value + gradient . d - d . curvature d / 2, a model of an objective at a distance d from some parameters.

    The models of summands add up to the model of their sum.
    """

    value: Float[Array, ""]
    gradient: Params
    curvature: Float[Array, "param param"]
    """Positive semi-definite where the model is to be climbed."""

    @classmethod
    def unknown(cls, params: Params) -> "QuadraticModel":
        """The model of an objective that was not looked at yet: lower than any other, and no way to go."""
        size, dtype = params.shape[0], params.dtype
        return cls(jnp.asarray(-jnp.inf, dtype), jnp.zeros_like(params), jnp.eye(size, dtype=dtype))

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
        step = solve_positive(damped, self.gradient * bounds)
        return bounds * step / jnp.maximum(jnp.max(jnp.abs(step)), 1.0)

    def expected_gain(self, step: Params) -> Float[Array, ""]:
        """How far the model rises along a step."""
        bend = jnp.matmul(self.curvature, step, precision="highest")
        return jnp.sum(step * (self.gradient - 0.5 * bend))


Objective = Callable[[Params], Float[Array, ""]]


@runtime_checkable
class CurvedObjective(Protocol):
    """An objective that also gives a quadratic model of itself, for solvers that use curvature."""

    def __call__(self, params: Params) -> Float[Array, ""]:
        """The objective."""
        ...

    def quadratic(self, params: Params) -> QuadraticModel:
        """The model near `params`, whose curvature is positive semi-definite."""
        ...


class Scales(eqx.Module):
    """How far parameters may move: kinds of parameters that are alike (angles, translations) share a first step.

    Angles are in radians, translations in metres.
    """

    kinds: Int[Array, "param"]
    """Which kind a parameter is of: 0 .. num_kinds - 1."""
    first_steps: Float[Array, "kind"]
    """Length of the first step along the parameter of each kind that has the largest gradient."""
    largest_steps: Float[Array, "kind"]
    """Bound on every later step of a parameter."""

    @property
    def step_bounds(self) -> Params:
        """The bound on the step of every parameter."""
        return self.largest_steps[self.kinds]

    def first_step_sizes(self, gradient: Params) -> Params:
        """sigma_0 of Eq. 11: the largest gradient of each kind makes a step of `first_steps`."""
        kinds = jnp.arange(self.first_steps.shape[0], dtype=self.kinds.dtype)
        same_kind = self.kinds[:, None] == kinds[None, :]
        largest = jnp.max(jnp.where(same_kind, jnp.abs(gradient)[:, None], 0.0), axis=0)
        sizes = self.first_steps / jnp.where(largest > 0.0, largest, 1.0)
        return sizes[self.kinds]


class Solution(eqx.Module):
    """The best parameters seen, and how they were found."""

    params: Params
    value: Float[Array, ""]
    iterations: Int[Array, ""]
    evaluations: Int[Array, ""]
    converged: Bool[Array, ""]
    """False: the solver gave up at its iteration cap, or met a value that is not finite."""


@runtime_checkable
class Solver(Protocol):
    """Maximises a smooth function from a start; pure, and usable under jit and vmap."""

    @property
    def max_iterations(self) -> Any:
        """The most iterations of a climb, a scalar; type checkers take a converted field for what converts it."""
        ...

    def maximize(self, objective: Objective, start: Params, scales: Scales) -> Solution:
        """Climb from `start`."""
        ...


def bounded(solver: Solver, most: Int[Array, ""] | None) -> Solver:
    """A solver that makes so many iterations at most; None: as many as it may."""
    return solver if most is None else eqx.tree_at(lambda each: each.max_iterations, solver, most)
