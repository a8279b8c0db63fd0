"""What every solver takes and returns."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from sogjax.solve.quadratic import Params, QuadraticModel

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

    def maximize(self, objective: Objective, start: Params, scales: Scales) -> Solution:
        """Climb from `start`."""
        ...
