"""Which endings the files of the commands may have, looked at before anything heavy is imported."""

from pathlib import Path
from typing import Any

from sogjax.errors import InputError

MOTIONS = (".bvh", ".c3d", ".csv", ".glb", ".mot", ".motion", ".npz", ".trc", ".yaml", ".yml")
CALIBRATIONS = (".toml", ".calibration")
ENDINGS: dict[str, dict[str, tuple[str, ...]]] = {
    "view": {"out": (".rrd", ".png")},
}
"""By command and option; an option that is not given is not looked at."""
FORMATS = tuple(ending[1:] for ending in MOTIONS if ending not in (".motion", ".npz", ".yaml", ".yml"))
"""Of `outputs.formats`."""


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
            raise InputError(f"{key}={value}: cannot be written with this ending; use {_listed(endings)}")
    for name in getattr(getattr(config, "outputs", None), "formats", None) or []:
        if name not in FORMATS:
            raise InputError(f"outputs.formats={name}: no such format; use some of {', '.join(FORMATS)}")


def _listed(endings: tuple[str, ...]) -> str:
    return f"{'one of ' if len(endings) > 1 else ''}{' '.join(endings)}"
