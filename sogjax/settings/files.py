"""The YAML files of `conf/`: where they are, and the sets of options that they offer."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml


def conf_dir() -> Path:
    """The folder of the YAML files: inside the installed package, or `conf/` of a checkout."""
    package = Path(__file__).resolve().parents[1]
    packaged = package / "conf"
    return packaged if packaged.is_dir() else package.parent / "conf"


def default_choices(command: str, named: Mapping[str, str] | None = None) -> dict[str, str]:
    """The config groups of a command, in the order in which they count, and the choice of each by default.

    A group may bring others, as a preset does: those of the choice that is named, where one is. A command without a
    file has none.
    """
    choices: dict[str, str] = {}
    path = conf_dir() / f"{command}.yaml"
    for group, choice in _choices(_read(path)["defaults"]).items() if path.is_file() else ():
        choices |= {group: choice, **option_set(group, (named or {}).get(group, choice))[1]}
    return choices


def choices_of(group: str) -> list[str]:
    """The names of the sets of options of a config group."""
    return sorted(path.stem for path in (conf_dir() / group).glob("*.yaml"))


def option_set(group: str, choice: str) -> tuple[dict[str, Any], dict[str, str]]:
    """The options of a choice, and the other groups that it brings, with its choices."""
    options = _read(conf_dir() / group / f"{choice}.yaml")
    return options, _choices(options.pop("defaults", []))


def _choices(defaults: list[Any]) -> dict[str, str]:
    """The groups and choices in one of Hydra's lists of defaults."""
    pairs = (pair for entry in defaults if isinstance(entry, dict) for pair in entry.items())
    return {str(key).lstrip("/"): str(choice) for key, choice in pairs}


def _read(path: Path) -> dict[str, Any]:
    return yaml.safe_load(path.read_text(encoding="utf-8")) or {}
