"""The words of a command line: made ready for Hydra, and Hydra's complaints about them in plain sentences."""

import difflib
import re
from collections.abc import Iterator, Sequence
from keyword import iskeyword

from sogjax.app.configs import help_lines
from sogjax.errors import InputError

PATH_KEYS = (
    *("recording", "out", "actor", "body", "motion", "truth", "to", "calibration", "from", "dof", "images.cache"),
    "hydra.sweep.dir",
)
"""Options whose values are paths, which may hold characters that Hydra's grammar does not take unquoted."""

_PLAIN = re.compile(r"[\w./\\:%+@?|-]*", re.ASCII)
_OWN_SYNTAX = ("'", '"', "[", "{", "$")
_EXPECTED = (
    (r"could not be converted to Integer", "must be a whole number"),
    (r"could not be converted to Float", "must be a number"),
    (r"is not a valid bool", "must be true or false"),
    (r"is not Optional", "cannot be null"),
    (r"is not a ListConfig", "must be a list; write key=[a,b]"),
    (r"Cannot convert '(?:list|dict)' to string", "must be one value, no list"),
)


def ready_for_hydra(words: Sequence[str], sweep: bool) -> list[str]:
    """The overrides, paths quoted where they need it.

    Raises:
        InputError: a word that is no `key=value`.
    """
    return [_for_schema(_quoted(_checked(word, sweep))) for word in words]


def _checked(word: str, sweep: bool) -> str:
    key, equals, value = word.partition("=")
    for_hydra = key.lstrip("+~").startswith("hydra")
    if key.startswith("-"):
        remedy = f"{key.lstrip('-')}={value or 'VALUE'}"
        raise InputError(f"{word}: options are written without dashes; write {remedy}")
    if not equals or not key:
        raise InputError(f"{word}: is no option; write key=value")
    if for_hydra and not sweep:
        raise InputError(f"{word}: Hydra's own settings only count in a sweep; add -m or leave it out")
    if key[0] in "+~" and not for_hydra:
        raise InputError(f"{word}: nothing can be added to the options or taken from them; write key=value")
    return word


def _for_schema(word: str) -> str:
    """Keys that are words of Python have a line after them in the schemas."""
    key, _, value = word.partition("=")
    return f"{key}_={value}" if iskeyword(key) else word


def _quoted(word: str) -> str:
    """Values of path options in quotes, unless they are plain, lists, or quoted already."""
    key, _, value = word.partition("=")
    if key not in PATH_KEYS or "," in value or _PLAIN.fullmatch(value) or value.startswith(_OWN_SYNTAX):
        return word
    return f"{key}={quoted_value(value)}"


def quoted_value(value: str) -> str:
    """A value as Hydra's grammar takes it, whatever characters it has."""
    escaped = value.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"


def plain_sentence(command: str, schema: type, error: BaseException) -> str:
    """What Hydra complains of, as one sentence with the option, its value and the remedy."""
    text = "\n".join(str(cause) for cause in _causes(error))
    see = f"see sogjax {command} --help"
    if found := re.search(r"Could not override '([^']*)'", text):
        return _unknown_key(found[1], schema, see)
    if found := re.search(r"Could not find '([^'/]+)/([^']*)'", text):
        choices = ", ".join(re.findall(r"^\t(\w+)$", text, re.MULTILINE))
        return f"{found[1]}={found[2]}: no such choice; use one of {choices}"
    if found := re.search(r"Ambiguous value for argument '([^']*)'", text):
        key, _, value = found[1].partition("=")
        return f"{found[1]}: write several values as {key}=[{value}], or add -m to sweep over them"
    if found := re.search(r"Error merging override (.*)", text):
        expected = next((words for pattern, words in _EXPECTED if re.search(pattern, text)), "does not fit")
        return f"{found[1]}: {expected.replace('key', found[1].partition('=')[0])} ({see})"
    if word := getattr(error, "override", None):
        return f"{word}: cannot be read; write key=value, a value with special characters in quotes: key=\"'a (b)'\""
    return f"{text.splitlines()[0]} ({see})"


def _unknown_key(key: str, schema: type, see: str) -> str:
    known = [name for name, _, _ in help_lines(schema)]
    near = difflib.get_close_matches(key, known, 1)
    # The last word alone may be right: `limit_weight` for `energy.limit_weight`.
    near = near or [name for name in known if name.rpartition(".")[2] == key.rpartition(".")[2]]
    hint = f"did you mean {near[0]}?" if near else f"{see} for the keys"
    return f"unknown config key {key}; {hint}"


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__
