"""What a setting is: a field of a dataclass with its default and its help text."""

from collections.abc import Callable
from dataclasses import field, fields, is_dataclass
from typing import Any

REQUIRED: Any = "???"
"""In place of a default: the setting must be given. (OmegaConf's own mark.)"""


def option(default: Any, help_text: str) -> Any:
    """A config field with its default and the text that `--help` prints."""
    return field(default=default, metadata={"help": help_text})


def group(schema: Callable[[], Any], help_text: str) -> Any:
    """A config group, or a list, made by a schema or function."""
    return field(default_factory=schema, metadata={"help": help_text})


def option_key(name: str) -> str:
    """The key of a field on the command line: Python's own words stand in the schemas with a line after them."""
    return name.removesuffix("_")


def help_lines(schema: type, prefix: str = "") -> list[tuple[str, str, str]]:
    """(key, default, text) of every option of a schema, groups unfolded."""
    lines: list[tuple[str, str, str]] = []
    example = schema()
    for entry in fields(schema):
        default = getattr(example, entry.name)
        if is_dataclass(default):
            lines += help_lines(type(default), f"{prefix}{entry.name}.")
        else:
            shown = "required" if default == REQUIRED else "null" if default is None else str(default)
            lines.append((prefix + option_key(entry.name), shown, entry.metadata["help"]))
    return lines
