"""Settings from a preset, sets of options and single values, as the commands compose them, but without Hydra."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import yaml
from omegaconf import OmegaConf
from omegaconf.errors import ConfigKeyError, OmegaConfBaseException

from sogjax.errors import InputError
from sogjax.settings.files import choices_of, default_choices, option_set
from sogjax.settings.option import option_key
from sogjax.settings.run import TrackConfig
from sogjax.settings.wrong_values import no_such_choice, unfit_value, unknown_key

Schema = TypeVar("Schema")

PRESET = "preset"
"""The config group whose options belong to all groups."""
SEE = "see sogjax {} --help"


def track_config(words: Sequence[str] = (), /, **keywords: Any) -> TrackConfig:
    """The settings of a track.

    Args:
        words: `key=value`, as on a command line, values in YAML.
        keywords: the same as values, groups as nested mappings or by the name of a set of options:
            `solver="lbfgs", energy={"limit_weight": 2.0}`. They count more than `words`.

    Raises:
        InputError: an unknown key (with the nearest known one), or an invalid value.
    """
    return composed_without_hydra(TrackConfig, "track", words, keywords)


def composed_without_hydra(
    schema: type[Schema], command: str, words: Sequence[str] = (), keywords: Mapping[str, Any] | None = None
) -> Schema:
    """The config object of a command from words and keywords, as `track_config` takes them.

    Raises:
        InputError: as there.
    """
    values = [*map(_of_word, words), *(_nested(key, _plain(value)) for key, value in (keywords or {}).items())]
    choices = default_choices(command)
    named = {
        key: value for entry in values for key, value in entry.items() if key in choices and isinstance(value, str)
    }
    for entry in values:
        for key, value in entry.items():
            if key in choices and not isinstance(value, str | Mapping):
                raise InputError(no_such_choice(key, value, choices_of(key)))
    tree = OmegaConf.structured(schema)
    for options in _option_sets(command, named):
        tree = OmegaConf.merge(tree, options)
    for entry in values:
        rest = {key: value for key, value in entry.items() if key not in named or not isinstance(value, str)}
        tree = _merged(tree, rest, schema, command)
    return as_object(tree, command)  # pyright: ignore[reportReturnType]


def as_object(tree: Any, command: str) -> Any:
    """The schema object of a composed config.

    Raises:
        InputError: a missing required key, or a number that is not finite.
    """
    missing = sorted(option_key(key) for key in OmegaConf.missing_keys(tree))
    if missing:
        examples = " ".join(f"{key}=..." for key in missing)
        raise InputError(f"{command} needs {', '.join(missing)}; add {examples} ({SEE.format(command)})")
    config = OmegaConf.to_object(tree)
    for key, value in _numbers(config):
        if not math.isfinite(value):
            raise InputError(f"{key}={value}: must be a finite number")
    return config


def _option_sets(command: str, named: dict[str, str]) -> Iterator[dict[str, Any]]:
    """The sets of options that are chosen, by default, by the preset or by name, in the order in which they count."""
    for group, choice in named.items():
        if choice not in choices_of(group):
            raise InputError(no_such_choice(group, choice, choices_of(group)))
    for group, choice in (default_choices(command, named) | named).items():
        options = option_set(group, choice)[0]
        yield options if group == PRESET else {group: options}


def _merged(tree: Any, values: Mapping[str, Any], schema: type, command: str) -> Any:
    see = SEE.format(command)
    try:
        return OmegaConf.merge(tree, OmegaConf.create(dict(values)))
    except ConfigKeyError as error:
        raise InputError(unknown_key(str(error.full_key or error.key), schema, see)) from error
    except (OmegaConfBaseException, ValueError) as error:
        key = str(getattr(error, "full_key", None) or next(iter(values)))
        raise InputError(unfit_value(key, _value_at(values, key), str(error), see)) from error


def _of_word(word: str) -> dict[str, Any]:
    """A nested mapping of one `key=value`."""
    key, equals, text = word.partition("=")
    if not equals or not key:
        raise InputError(f"{word}: is not an option; write key=value")
    try:
        value = yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise InputError(f"{word}: cannot be read; put a value with special characters in quotes") from error
    return _nested(key, value)


def _nested(key: str, value: Any) -> dict[str, Any]:
    """`a.b` and a value as {a: {b: value}}."""
    for part in reversed(key.split(".")):
        value = {part: value}
    return value


def _plain(value: Any) -> Any:
    """A value as OmegaConf takes it."""
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    if isinstance(value, Path):
        return str(value)
    return value.item() if isinstance(value, np.generic) else value


def _value_at(values: Mapping[str, Any], key: str) -> Any:
    found: Any = values
    for part in key.split("."):
        found = found.get(part) if isinstance(found, Mapping) else found
    return found


def _numbers(config: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """Every floating-point number of a config object, with its key."""
    for entry in fields(config):
        value = getattr(config, entry.name)
        if is_dataclass(value):
            yield from _numbers(value, f"{prefix}{entry.name}.")
        elif isinstance(value, float):
            yield prefix + entry.name, value
