"""What is wrong with a setting, in plain sentences; and the settings that there were once."""

import difflib
import re
from collections.abc import Mapping

from sogjax.settings.option import help_lines

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
