"""Terms of the energy: small modules with a weight and a value, those that a user names in the settings too."""

import abc
import importlib
import inspect
import math
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.posed import Frame, Moving, Posed
from sogjax.errors import InputError
from sogjax.solve.linear import eigen
from sogjax.solve.solution import QuadraticModel


class Term(eqx.Module):
    """Something that the energy gains: it adds `weight` times `value`.

    Your own term is a subclass with a method `value`, differentiable by jax. Its further fields are numbers or
    arrays, which can be swept and differentiated by (numbers become arrays), or static ones (`eqx.field(static=True)`).
    Solvers that use curvature take it from autodiff, unless the subclass has a better `quadratic`.
    """

    weight: Float[Array, ""] = eqx.field(converter=lambda weight: jnp.asarray(weight, jnp.result_type(float)))
    name: str = eqx.field(static=True, kw_only=True, default="")
    """The name under which its value is reported; default: that of the class, as in `free_space` of `FreeSpace`."""

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
    values, vectors = eigen(matrix)
    return jnp.matmul(vectors * jnp.maximum(values, 0.0)[None, :], vectors.T, precision="highest")


def _snake_case(name: str) -> str:
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


CLASS = "term"
"""Key of an entry under which the class stands; the other keys are its arguments."""


def added_terms(key: str, entries: Any, taken: Sequence[str]) -> Terms:
    """A term for each entry, `NAME: {term: MODULE.CLASS, weight: 1.0, ...}`, called NAME.

    Modules are looked for where Python does, and in the current folder.

    Args:
        key: of the entries in the configuration, for messages.
        entries: the terms by name; None: there are none.
        taken: names that other terms have.

    Raises:
        InputError: no such class, a class that is not a term, or arguments that it does not take.
    """
    if entries is None:
        return ()
    if not isinstance(entries, Mapping):
        raise InputError(f"{key}={entries}: must be terms by name, {{NAME: {{{CLASS}: MODULE.CLASS, weight: 1.0}}}}")
    for name in entries:
        if name in taken:
            raise InputError(f"{key}.{name}: the energy has a term of this name already; choose another name")
    return tuple(_term(f"{key}.{name}", name, entry) for name, entry in entries.items())


def _term(key: str, name: str, entry: Any) -> Term:
    if not isinstance(entry, Mapping) or not isinstance(entry.get(CLASS), str):
        raise InputError(f"{key}: is not a term; write {{{CLASS}: MODULE.CLASS, weight: 1.0}}")
    made_by = _class(key, entry[CLASS])
    arguments = {word: value for word, value in entry.items() if word != CLASS}
    for word, value in arguments.items():
        if not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(f"{key}.{word}={value}: must be a finite number")
    try:
        inspect.signature(made_by).bind(**arguments, name=name)
        return made_by(**arguments, name=name)
    except (TypeError, ValueError) as error:
        takes = ", ".join(word for word in inspect.signature(made_by).parameters if word != "name")
        raise InputError(f"{key}: {entry[CLASS]} cannot be made ({error}); it takes {takes}") from error


def _class(key: str, path: str) -> type[Term]:
    """The class that a dotted path names."""
    module, dot, name = path.rpartition(".")
    if not dot:
        raise InputError(f"{key}.{CLASS}={path}: must name a module and a class in it, as MODULE.CLASS")
    try:
        found = getattr(_module(module), name, None)
    except Exception as error:  # whatever goes wrong in somebody's own module
        raise InputError(f"{key}.{CLASS}={path}: the module {module} cannot be imported ({error})") from error
    if not (inspect.isclass(found) and issubclass(found, Term)):
        what = "has no such class" if found is None else "is not a sogjax.Term"
        raise InputError(f"{key}.{CLASS}={path}: {module if found is None else path} {what}")
    if inspect.isabstract(found):
        raise InputError(f"{key}.{CLASS}={path}: has no method `value`; add it to the class")
    return found


def _module(name: str) -> Any:
    here = str(Path.cwd())
    if here in sys.path or "" in sys.path:
        return importlib.import_module(name)
    sys.path.append(here)
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(here)
