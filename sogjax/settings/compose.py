"""Settings composed from a preset, sets of options and single values, and sentences about those that are wrong."""

import difflib
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import yaml
from omegaconf import OmegaConf
from omegaconf.errors import ConfigAttributeError, ConfigKeyError, OmegaConfBaseException

from sogjax.errors import InputError
from sogjax.settings.files import choices_of, default_choices, option_set
from sogjax.settings.option import help_lines, option_key
from sogjax.settings.run import TrackConfig

Schema = TypeVar("Schema")
Pair = tuple[str, Any]
"""A key, `a.b` for the setting b of the group a, and its value."""

PRESET = "preset"
"""The config group whose options belong to all groups."""


def track_config(words: Sequence[str] = (), /, **keywords: Any) -> TrackConfig:
    """The settings of a track.

    Args:
        words: `key=value`, as on a command line, values in YAML.
        keywords: the same as values, groups as nested mappings or by the name of a set of options:
            `solver="lbfgs", energy={"limit_weight": 2.0}`. They count more than `words`.

    Raises:
        InputError: an unknown key (with the nearest known one), or an invalid value.
    """
    return composed_config(TrackConfig, "track", [*map(pair_of, words), *keywords.items()])


def pair_of(word: str) -> Pair:
    """The key and the value, in YAML, of `key=value`.

    Raises:
        InputError: it is not of this form.
    """
    key, equals, text = word.partition("=")
    if not equals or not key:
        raise InputError(f"{word}: is not an option; write key=value")
    try:
        return key, yaml.safe_load(text)
    except yaml.YAMLError as error:
        raise InputError(f"{word}: cannot be read; put a value with special characters in quotes") from error


def composed_config(schema: type[Schema], command: str, pairs: Iterable[Pair]) -> Schema:
    """The config object of a command from what is chosen; the rest is as its sets of options and defaults say.

    Args:
        schema: a dataclass with all settings and their defaults.
        command: whose file in `conf/` lists the sets of options; an empty text for a script, which has none.
        pairs: what is chosen, later pairs count more. A group's value is a mapping, or the name of a set of options,
            which counts less than any single value.

    Raises:
        InputError: an unknown key (with the nearest known one), an invalid value, or a required one that is missing.
    """
    pairs, choices = list(pairs), default_choices(command)
    named: dict[str, str] = {}
    for key, value in pairs:
        if key in choices and not isinstance(value, Mapping):
            if value not in choices_of(key):
                raise InputError(no_such_choice(key, value, choices_of(key)))
            named[key] = value
    tree = OmegaConf.structured(schema)
    for group, choice in (default_choices(command, named) | named).items():
        options = option_set(group, choice)[0]
        tree = OmegaConf.merge(tree, options if group == PRESET else {group: options})
    for key, value in pairs:
        if key not in choices or isinstance(value, Mapping):
            _update(tree, key, _plain(value), schema, command)
    return as_object(tree, command)  # pyright: ignore[reportReturnType]


def _update(tree: Any, key: str, value: Any, schema: type, command: str) -> None:
    try:
        OmegaConf.update(tree, key, value)
    except (ConfigKeyError, ConfigAttributeError) as error:
        raise InputError(unknown_key(str(error.full_key or key), schema, _see(command))) from error
    except (OmegaConfBaseException, ValueError) as error:
        inner = str(getattr(error, "full_key", None) or key)
        wrong = (inner, getattr(error, "value", value)) if inner.startswith(f"{key}.") else (key, value)
        raise InputError(unfit_value(*wrong, str(error), _see(command))) from error


def as_object(tree: Any, command: str) -> Any:
    """The schema object of a composed config.

    Raises:
        InputError: a missing required key, a reference to none, or a number that is not finite.
    """
    try:
        missing = sorted(option_key(key) for key in OmegaConf.missing_keys(tree))
        if missing:
            examples = " ".join(f"{key}=..." for key in missing)
            raise InputError(f"{command or 'the script'} needs {', '.join(missing)}; add {examples} ({_see(command)})")
        config = OmegaConf.to_object(tree)
    except OmegaConfBaseException as error:
        raise InputError(f"{str(error).splitlines()[0]} ({_see(command)})") from error
    for key, value in _numbers(config):
        if not math.isfinite(value):
            raise InputError(f"{key}={value}: must be a finite number")
    return config


def without_removed(tree: Any) -> Any:
    """The settings of a file that an older program wrote, without those that are none any more."""
    for group, _, name in (key.rpartition(".") for key in REMOVED if "." in key):
        if OmegaConf.is_dict(part := tree.get(group)):
            part.pop(name, None)
    return tree


def _see(command: str) -> str:
    return f"see sogjax {command} --help" if command else "see --help"


def _plain(value: Any) -> Any:
    """A value as OmegaConf takes it."""
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    if isinstance(value, Path):
        return str(value)
    return value.item() if isinstance(value, np.generic) else value


def _numbers(config: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """Every floating-point number of a config object, with its key."""
    for entry in fields(config):
        value = getattr(config, entry.name)
        if is_dataclass(value):
            yield from _numbers(value, f"{prefix}{entry.name}.")
        elif isinstance(value, float):
            yield prefix + entry.name, value


_ASCENT = "the ascent's step sizes are {}; leave it out"
REMOVED = {
    "tracking.repair": "limbs in doubt are tracked both ways (tracking.both_ways); leave it out",
    "images.box_enlargement": "the border around an actor's box is 0.15 of its size; leave it out",
    "energy": "actors are made with the energy's defaults; leave it out, or set it for track",
    "energy.gradient": "the derivative is in closed form; leave it out",
    "solver.grow": _ASCENT.format("multiplied by the paper's mu+ of 1.2"),
    "solver.shrink": _ASCENT.format("multiplied by the paper's mu- of 0.5"),
    "solver.first_angle": _ASCENT.format("0.02 rad at first"),
    "solver.first_translation": _ASCENT.format("0.01 m at first"),
    "solver.largest_angle": "a step turns no angle by more than 0.15 rad; leave it out",
    "solver.largest_translation": "a step moves nothing by more than 0.05 m; leave it out",
    "outputs.markers": "metrics.json has both rules; sogjax evaluate markers=closest prints the paper's",
    "outputs.worst": "worst.png is written with every motion, unless outputs.motion_only=true; leave it out",
}
"""Why settings, and groups of them, that old commands and files may name are gone, and what to do instead."""

_EXPECTED = (
    (r"could not be converted to Integer", "must be a whole number"),
    (r"could not be converted to Float", "must be a number"),
    (r"is not a valid bool", "must be true or false"),
    (r"is not Optional|Incompatible value 'None'", "cannot be null"),
    (r"is not a ListConfig|with ListConfig", "must be a list; write key=[a,b]"),
    (r"Cannot convert '(?:list|dict|ListConfig|DictConfig)' to string", "must be one value, no list"),
)


def unknown_key(key: str, schema: type, see: str) -> str:
    """An unknown key, with why it is none any more, the nearest known one, or else where to look."""
    known = [line.key for line in help_lines(schema)]
    for name in (key, key.partition(".")[0]):
        if name in REMOVED and not any(f"{other}.".startswith(f"{name}.") for other in known):
            return f"{name}: is not a setting any more: {REMOVED[name]}"
    near = difflib.get_close_matches(key, known, 1)
    # The last word alone may be right: `limit_weight` for `energy.limit_weight`.
    near = near or [name for name in known if name.rpartition(".")[2] == key.rpartition(".")[2]]
    hint = f"did you mean {near[0]}?" if near else f"{see} for the keys"
    return f"unknown config key {key}; {hint}"


def no_such_choice(key: str, value: object, choices: list[str]) -> str:
    """An unknown choice, with the known ones."""
    return f"{key}={_written(value)}: no such choice; use one of {', '.join(choices)}"


def unfit_value(key: str, value: object, complaint: str, see: str) -> str:
    """A value of the wrong kind, from the error of OmegaConf."""
    expected = next((words for pattern, words in _EXPECTED if re.search(pattern, complaint)), "does not fit")
    return f"{key}={_written(value)}: {expected.replace('key', key)} ({see})"


def _written(value: object) -> str:
    """A value as on a command line."""
    if isinstance(value, Mapping):
        return "{" + ",".join(f"{key}:{_written(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return f"[{','.join(map(_written, value))}]"
    return "null" if value is None else str(value).lower() if isinstance(value, bool) else str(value)
