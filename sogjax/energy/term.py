"""A term of the energy: a small module with a weight and a value."""

import abc
import re
from dataclasses import fields
from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.posed import Frame, Moving, Posed
from sogjax.solve.quadratic import QuadraticModel


class Term(eqx.Module):
    """Something that the energy gains: it adds `weight` times `value`.

    Your own term is a subclass with a method `value`, differentiable by jax. Its further fields are numbers or
    arrays, which can be swept and differentiated by (numbers become arrays), or static ones (`eqx.field(static=True)`).
    Solvers that use curvature take it from autodiff, unless the subclass has a better `quadratic`.
    """

    weight: Float[Array, ""] = eqx.field(converter=lambda weight: jnp.asarray(weight, jnp.result_type(float)))
    name: str = eqx.field(static=True, kw_only=True, default="")
    """Under which its value is reported; default: the name of the class, as in `free_space` of `FreeSpace`."""

    sign: ClassVar[float] = 1.0

    def __post_init__(self) -> None:
        self.name = self.name or _snake_case(type(self).__name__)
        for entry in fields(self):
            value = getattr(self, entry.name)
            if entry.metadata.get("static", False) or isinstance(value, bool) or not isinstance(value, int | float):
                continue
            whole = isinstance(value, int) and entry.type not in (float, "float")
            setattr(self, entry.name, jnp.asarray(value if whole else float(value)))

    @abc.abstractmethod
    def value(self, posed: Posed, frame: Frame) -> Float[Array, ""]:
        """The value without its weight, of a body in a pose in a frame."""

    @property
    def signed_weight(self) -> Float[Array, ""]:
        """What the value is multiplied with in the energy, which is maximised."""
        return self.sign * self.weight

    def part(self, posed: Posed, frame: Frame) -> Float[Array, ""]:
        """What the term adds to the energy."""
        return self.signed_weight * self.value(posed, frame)

    def quadratic(self, posed: Posed, frame: Frame) -> QuadraticModel:
        """A model of `part` by the pose, whose curvature is positive semi-definite.

        Generalised Gauss-Newton: the value bends as it does by what it is made of (`Moving`), while that is taken to
        move in straight lines, and directions in which it bends the other way count as straight.
        """
        rates = posed.rates()
        part = lambda moving: self.part(posed.moved_to(moving), frame)
        value, slope = jax.value_and_grad(part)(posed.moving)
        _, bend = jax.linearize(jax.grad(part), posed.moving)
        return QuadraticModel(value, _along(rates, slope), _positive_part(-_across(rates, jax.vmap(bend)(rates))))


class Penalty(Term):
    """Something that the energy loses: it subtracts `weight` times `value`, which is positive where a pose is bad."""

    sign: ClassVar[float] = -1.0


Terms = tuple[Term, ...]


def _along(rates: Moving, slope: Moving) -> Float[Array, "dof"]:
    """The gradient by the pose from that by all that moves with it."""
    product = lambda rate, by: jnp.matmul(rate.reshape(rate.shape[0], -1), by.reshape(-1), precision="highest")
    return sum(map(product, rates[1:], slope[1:]), product(rates[0], slope[0]))


def _across(rates: Moving, bends: Moving) -> Float[Array, "dof dof"]:
    """The second derivatives by the pose from those along all that moves with it."""
    flat = lambda leaf: leaf.reshape(leaf.shape[0], -1)
    product = lambda rate, bend: jnp.matmul(flat(rate), flat(bend).T, precision="highest")
    return sum(map(product, rates[1:], bends[1:]), product(rates[0], bends[0]))


def _positive_part(matrix: Float[Array, "dof dof"]) -> Float[Array, "dof dof"]:
    """The matrix without its negative eigenvalues."""
    values, vectors = jnp.linalg.eigh(matrix)
    return jnp.matmul(vectors * jnp.maximum(values, 0.0)[None, :], vectors.T, precision="highest")


def _snake_case(name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
