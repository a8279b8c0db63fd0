"""What is wrong with a setting, in plain sentences."""

import difflib
import re

from sogjax.settings.option import help_lines

_EXPECTED = (
    (r"could not be converted to Integer", "must be a whole number"),
    (r"could not be converted to Float", "must be a number"),
    (r"is not a valid bool", "must be true or false"),
    (r"is not Optional", "cannot be null"),
    (r"is not a ListConfig", "must be a list; write key=[a,b]"),
    (r"Cannot convert '(?:list|dict)' to string", "must be one value, no list"),
)


def unknown_key(key: str, schema: type, see: str) -> str:
    """An unknown key, with the nearest known one, or else where to look."""
    known = [name for name, _, _ in help_lines(schema)]
    near = difflib.get_close_matches(key, known, 1)
    # The last word alone may be right: `limit_weight` for `energy.limit_weight`.
    near = near or [name for name in known if name.rpartition(".")[2] == key.rpartition(".")[2]]
    hint = f"did you mean {near[0]}?" if near else f"{see} for the keys"
    return f"unknown config key {key}; {hint}"


def no_such_choice(key: str, value: object, choices: list[str]) -> str:
    """An unknown choice, with the known ones."""
    return f"{key}={value}: no such choice; use one of {', '.join(choices)}"


def unfit_value(key: str, value: object, complaint: str, see: str) -> str:
    """A value of the wrong kind, from the error of OmegaConf."""
    expected = next((words for pattern, words in _EXPECTED if re.search(pattern, complaint)), "does not fit")
    return f"{key}={value}: {expected.replace('key', key)} ({see})"
