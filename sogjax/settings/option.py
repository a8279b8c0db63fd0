"""What a setting is: a field of a dataclass with its default and its help text."""

from collections.abc import Callable
from dataclasses import Field, field, fields, is_dataclass
from typing import Any, NamedTuple

REQUIRED: Any = "???"
"""In place of a default: the setting must be given. (OmegaConf's own mark.)"""


class HelpLine(NamedTuple):
    """What `--help` says of a setting."""

    key: str
    default: str
    text: str
    expert: bool
    """Whether only `--help all` lists it."""


def option(default: Any, help_text: str, *, inert: bool = False, expert: bool = False) -> Any:
    """A setting with its default and the text that `--help` prints.

    An `inert` one changes no number of a motion: it is about files, or about how the work is done.
    """
    return field(default=default, metadata={"help": help_text, "inert": inert, "expert": expert})


def expert(default: Any, help_text: str, *, inert: bool = False) -> Any:
    """A setting that few need, so that only `--help all` prints it."""
    return option(default, help_text, inert=inert, expert=True)


def is_inert(entry: Field) -> bool:
    """Whether a setting is known to change no number of a motion."""
    return entry.metadata.get("inert", False)


def telling_settings(config: Any, prefix: str = "") -> dict[str, Any]:
    """The settings that are not inert, by key, groups unfolded."""
    found: dict[str, Any] = {}
    for entry in fields(config):
        value = getattr(config, entry.name)
        if is_dataclass(value):
            found |= telling_settings(value, f"{prefix}{entry.name}.")
        elif not is_inert(entry):
            found[prefix + entry.name] = value
    return found


def group(schema: Callable[[], Any], help_text: str) -> Any:
    """A config group, or a list, made by a schema or function."""
    return field(default_factory=schema, metadata={"help": help_text})


def option_key(name: str) -> str:
    """The key of a field on the command line: Python's own words stand in the schemas with a line after them."""
    return name.removesuffix("_")


def help_lines(schema: type, prefix: str = "") -> list[HelpLine]:
    """The settings of a schema, groups unfolded."""
    lines: list[HelpLine] = []
    example = schema()
    for entry in fields(schema):
        default, said = getattr(example, entry.name), entry.metadata
        if is_dataclass(default):
            lines += help_lines(type(default), f"{prefix}{entry.name}.")
        else:
            shown = "required" if default == REQUIRED else "null" if default is None else str(default)
            key = prefix + option_key(entry.name)
            lines.append(HelpLine(key, shown, said.get("help", ""), said.get("expert", False)))
    return lines
