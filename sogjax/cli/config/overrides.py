"""The words of a command line: prepared for Hydra, and Hydra's errors in plain sentences."""

import re
from collections.abc import Iterator, Sequence
from keyword import iskeyword

from sogjax.errors import InputError
from sogjax.settings.wrong_values import no_such_choice, unfit_value, unknown_key

SWEPT = "track"
"""The command that `-m` runs for several values."""
PATH_KEYS = (
    *("recording", "out", "actor", "body", "motion", "truth", "to", "calibration", "from", "dof", "images.cache"),
    "hydra.sweep.dir",
)
"""Options whose values are paths, which may need quotes in Hydra's grammar."""

_PLAIN = re.compile(r"[\w./\\:%+@?|-]*", re.ASCII)
_OWN_SYNTAX = ("'", '"', "[", "{", "$")


def ready_for_hydra(words: Sequence[str], command: str, sweep: bool) -> list[str]:
    """The overrides of a command, paths quoted where they need it.

    Raises:
        InputError: a word that is no `key=value`.
    """
    return [_for_schema(_quoted(_checked(word, command, sweep))) for word in words]


def _checked(word: str, command: str, sweep: bool) -> str:
    key, equals, value = word.partition("=")
    for_hydra = key.lstrip("+~").startswith("hydra")
    if key.startswith("-"):
        remedy = f"{key.lstrip('-')}={value or 'VALUE'}"
        raise InputError(f"{word}: options are written without dashes; write {remedy}")
    if not equals or not key:
        raise InputError(f"{word}: is not an option; write key=value")
    if for_hydra and not sweep:
        remedy = "add -m or leave it out" if command == SWEPT else "leave it out"
        raise InputError(f"{word}: Hydra's own settings only count in a sweep; {remedy}")
    if not sweep and word.startswith("recording=glob("):
        remedy = "add -m" if command == SWEPT else f"{command} takes one, as recording=FOLDER"
        raise InputError(f"{word}: names several recordings; {remedy}")
    if key[0] in "+~" and not for_hydra:
        raise InputError(f"{word}: options cannot be added or removed; write key=value")
    return word


def _for_schema(word: str) -> str:
    """Keys that are Python keywords have a trailing underscore in the schemas."""
    key, _, value = word.partition("=")
    return f"{key}_={value}" if iskeyword(key) else word


def _quoted(word: str) -> str:
    """Values of path options in quotes, unless they are plain, lists, or quoted already."""
    key, _, value = word.partition("=")
    if key not in PATH_KEYS or "," in value or _PLAIN.fullmatch(value) or value.startswith(_OWN_SYNTAX):
        return word
    return f"{key}={quoted_value(value)}"


def quoted_value(value: str) -> str:
    """A value quoted for Hydra's grammar."""
    escaped = value.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"


def plain_sentence(command: str, schema: type, error: BaseException) -> str:
    """Hydra's error as one sentence with the option, its value and the remedy."""
    text = "\n".join(str(cause) for cause in _causes(error))
    see = f"see sogjax {command} --help"
    if found := re.search(r"Could not override '([^']*)'", text):
        return unknown_key(found[1], schema, see)
    if found := re.search(r"Could not find '([^'/]+)/([^']*)'", text):
        return no_such_choice(found[1], found[2], re.findall(r"^\t(\w+)$", text, re.MULTILINE))
    if found := re.search(r"Ambiguous value for argument '([^']*)'", text):
        key, _, value = found[1].partition("=")
        sweep = ", or add -m to sweep over them" if command == SWEPT else ""
        return f"{found[1]}: write several values as {key}=[{value}]{sweep}"
    if found := re.search(r"Error merging override (.*)", text):
        key, _, value = found[1].partition("=")
        return unfit_value(key, value, text, see)
    if word := getattr(error, "override", None):
        return f"{word}: cannot be read; write key=value, a value with special characters in quotes: key=\"'a (b)'\""
    return f"{text.splitlines()[0]} ({see})"


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__
