"""Functions that are compiled programs; a keeper may hold them between processes, ready to run.

jax keeps what XLA compiled, but to ask for it a function has to be traced and lowered again, which takes longer than
reading it: a third of a warm start.
"""

from collections.abc import Callable
from functools import wraps
from types import FunctionType
from typing import Any, ParamSpec, Protocol, TypeVar, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
from jax._src.core import trace_state_clean

Arguments = ParamSpec("Arguments")
Results = TypeVar("Results")


@runtime_checkable
class Keeper(Protocol):
    """Holds programs."""

    def program(
        self, function: Callable[..., Any], options: dict[str, Any], given: tuple[tuple, dict]
    ) -> Callable[[list[jax.Array]], Any] | None:
        """What computes a function from the arrays among what it is given; None: it is not held."""
        ...

    def forget(self) -> None:
        """Hold nothing in memory."""
        ...


_keepers: list[Keeper] = []


def keep_programs(keeper: Keeper | None) -> None:
    """From now on ask a keeper for programs; None: nobody."""
    _keepers[:] = [] if keeper is None else [keeper]


def keeper() -> Keeper | None:
    """Who is asked for programs."""
    return _keepers[0] if _keepers else None


def forget_programs() -> None:
    """Drop all programs of this process, jax's as well: they are read or compiled again when needed."""
    for keeper in _keepers:
        keeper.forget()
    jax.clear_caches()


def compiled(function: Callable[Arguments, Results], **options: Any) -> Callable[Arguments, Results]:
    """The function as a compiled program for arrays, as `eqx.filter_jit`; `options` are the compiler's.

    Only plain functions of modules are kept: closures, local and wrapped functions stay what `eqx.filter_jit` makes.
    """
    plain = eqx.filter_jit(function, compiler_options=options or None)  # pyright: ignore[reportCallIssue]
    if not _of_module(function):
        return plain

    @wraps(function)
    def call(*arguments: Arguments.args, **keywords: Arguments.kwargs) -> Results:
        if not _keepers or not trace_state_clean():  # as a part of another program
            return plain(*arguments, **keywords)
        program = _keepers[0].program(function, options, (arguments, keywords))
        if program is None:
            return plain(*arguments, **keywords)
        arrays = [leaf for leaf in jax.tree.leaves((arguments, keywords)) if eqx.is_array(leaf)]
        return program([leaf if isinstance(leaf, jax.Array) else jnp.asarray(leaf) for leaf in arrays])

    return call


def _of_module(function: Callable[..., Any]) -> bool:
    """Whether a function's module and name say all that it does."""
    if not isinstance(function, FunctionType) or hasattr(function, "__wrapped__"):
        return False
    return not function.__closure__ and "<locals>" not in function.__qualname__
