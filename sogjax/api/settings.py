"""The settings of a track, as keywords."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from sogjax.engine import build
from sogjax.errors import InputError
from sogjax.settings import OutputsConfig, TrackConfig
from sogjax.settings.compose import track_config

_NOT_HERE = {
    "recording": "is a separate argument, not a setting",
    "actor": "is a separate argument, not a setting",
    "actors": "is a setting of make_actor; give track a list of actors",
    "body": "is a setting of make_actor",
    "out": "no file is written; use motion.save(path)",
    "resume": "no file is written, so nothing can be resumed; use the command `sogjax track`",
    "overwrite": "no file is written, so nothing is overwritten",
}
"""Options of the command that have no meaning without its files, and why."""
_KEPT_OUTPUTS = ("confidence",)
"""Outputs that are a part of the motion, and no files."""


def track_settings(**settings: Any) -> TrackConfig:
    """The settings that `track` and `make_tracker` use, every value filled in and checked.

    Names, defaults and errors are those of `sogjax track`, whose `--help` says the meaning and unit of each.

    Args:
        settings: values as keywords, groups as mappings or as the name of a set of options:
            `track_settings(preset="paper", stop=40, solver="lbfgs", energy={"limit_weight": 2.0})`.

    Raises:
        InputError: an unknown setting (with the nearest known one), a wrong value, or an option that only concerns
            the files of the command.
    """
    for key, reason in _NOT_HERE.items():
        if key in settings:
            raise InputError(f"{key}: {reason}")
    config = track_config(recording="", **settings)
    build.check(config)
    outputs = settings.get("outputs")
    for entry in fields(OutputsConfig):
        if isinstance(outputs, Mapping) and entry.name in outputs and entry.name not in _KEPT_OUTPUTS:
            raise InputError(f"outputs.{entry.name}: no file is written; use motion.save(path) or sogjax.write_rerun")
    return config
