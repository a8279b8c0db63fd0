"""Terms of the energy that a user names: imported, looked at, and made."""

import importlib
import inspect
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from sogjax.energy.term import Term, Terms
from sogjax.errors import InputError

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
