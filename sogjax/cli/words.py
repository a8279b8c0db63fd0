"""From the words of a command line, in Hydra's grammar, to a config object."""

import re
from collections.abc import Sequence
from keyword import iskeyword
from pathlib import Path
from typing import Any

from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import ChoiceSweep, Override
from hydra.errors import HydraException

from sogjax.cli.schemas import CALIBRATIONS, ENDINGS, FORMATS, MOTIONS, SCHEMAS
from sogjax.errors import InputError
from sogjax.settings.compose import composed_config

SWEPT = "track"
"""The command that `-m` runs for several values."""
PATH_KEYS = (
    *("recording", "out", "actor", "body", "motion", "truth", "to", "calibration", "from", "dof", "images.cache"),
    *("record", "json", "rerun"),
    "hydra.sweep.dir",
)
"""Options whose values are paths, which may need quotes in Hydra's grammar."""

_PLAIN = re.compile(r"[\w./\\:%+@?|-]*", re.ASCII)
_OWN_SYNTAX = ("'", '"', "[", "{", "$")


def composed(command: str, words: Sequence[str]) -> Any:
    """The config object of a command.

    Raises:
        InputError: an unknown key, a value of the wrong type, a required key that is missing.
    """
    overrides = parsed(ready_for_hydra(words, command, sweep=False))
    config = composed_config(SCHEMAS[command], command, [_pair(override, command) for override in overrides])
    check_endings(command, config)
    return config


def ready_for_hydra(words: Sequence[str], command: str, sweep: bool) -> list[str]:
    """The words of a command, paths quoted where they need it.

    Raises:
        InputError: a word that is no `key=value`.
    """
    return [_quoted(_checked(word, command, sweep)) for word in words]


def parsed(words: Sequence[str]) -> list[Override]:
    """The words as Hydra reads them.

    Raises:
        InputError: one that cannot be read.
    """
    try:
        return OverridesParser.create().parse_overrides(list(words))
    except HydraException as error:
        word = getattr(error, "override", None) or " ".join(words)
        remedy = "write key=value, a value with special characters in quotes: key=\"'a (b)'\""
        raise InputError(f"{word}: cannot be read; {remedy}") from error


def quoted_value(value: str) -> str:
    """A value quoted for Hydra's grammar."""
    escaped = value.replace("\\", "\\\\").replace("'", "\\'")
    return f"'{escaped}'"


def check_endings(command: str, config: Any) -> None:
    """Refuse files to write whose ending nothing can be written to, and formats that there are not.

    Raises:
        InputError: such an ending or format.
    """
    options = dict(ENDINGS.get(command, {}))
    if command == "export" and (config.calibration is None) != (config.motion is None):
        options["to"] = MOTIONS if config.calibration is None else CALIBRATIONS
    for key, endings in options.items():
        value = getattr(config, key)
        if value is not None and not Path(value).is_dir() and Path(value).suffix.lower() not in endings:
            listed = f"{'one of ' if len(endings) > 1 else ''}{' '.join(endings)}"
            raise InputError(f"{key}={value}: cannot be written with this ending; use {listed}")
    for name in getattr(getattr(config, "outputs", None), "formats", None) or []:
        if name not in FORMATS:
            raise InputError(f"outputs.formats={name}: no such format; use some of {', '.join(FORMATS)}")


def _pair(override: Override, command: str) -> tuple[str, Any]:
    """The key and value of an override; keys that are words of Python have a line after them in the schemas."""
    key = override.get_key_element()
    if override.is_sweep_override():
        line, values = str(override.input_line), override.value()
        asked = f"write several values as {key}=[{line.partition('=')[2]}]"
        asked = asked if isinstance(values, ChoiceSweep) and values.simple_form else "names several values; give one"
        raise InputError(f"{line}: {asked}{', or add -m to sweep over them' if command == SWEPT else ''}")
    return f"{key}_" if iskeyword(key) else key, override.value()


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


def _quoted(word: str) -> str:
    """Values of path options in quotes, unless they are plain, lists, or quoted already."""
    key, _, value = word.partition("=")
    if key not in PATH_KEYS or "," in value or _PLAIN.fullmatch(value) or value.startswith(_OWN_SYNTAX):
        return word
    return f"{key}={quoted_value(value)}"
