"""Which recordings a command names: one, several, or a pattern of folders."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sogjax.app.config.overrides import quoted_value
from sogjax.data.projects import calibrations_of, project_in
from sogjax.data.source import find_sources
from sogjax.engine.terminal import say
from sogjax.errors import InputError
from sogjax.sentences import counted

KEY = "recording"


def with_folders(words: Sequence[str]) -> list[str]:
    """The words of a sweep, `recording=glob(PATTERN)` as the list of the recordings that it matches.

    Raises:
        InputError: the pattern cannot be read, or matches no recording.
    """
    return [_expanded(word) if word.startswith(f"{KEY}=glob(") else word for word in words]


def recordings_in(words: Sequence[str]) -> list[str]:
    """The recordings that a sweep names, in order; one of them, or none, where it has no list of them."""
    from hydra.core.override_parser.types import ChoiceSweep

    for word in reversed(words):
        if word.partition("=")[0] == KEY:
            value = _parsed(word)
            return [_text(item) for item in value.list] if isinstance(value, ChoiceSweep) else [_text(value)]
    return []


def places_of(recordings: Sequence[Path]) -> list[str]:
    """A name for each recording: its path from the folder that they have in common.

    Raises:
        InputError: a recording is named twice, or lies within another one.
    """
    whole = [path.absolute() for path in recordings]
    repeated = next((path for k, path in enumerate(whole) if path in whole[:k]), None)
    if repeated is not None:
        raise InputError(f"recording={repeated}: is named twice; name each recording once")
    around = next((path for path in whole if any(path in other.parents for other in whole)), None)
    if around is not None:
        raise InputError(f"recording={around}: another of the recordings lies in this folder; leave one of them out")
    common = Path(os.path.commonpath([path.parent for path in whole]))
    return [str(path.relative_to(common)) for path in whole]


def _expanded(word: str) -> str:
    value = _parsed(word)
    included = {path for pattern in value.include for path in _matching(_text(pattern))}
    found = sorted(included - {path for pattern in value.exclude for path in _matching(_text(pattern))})
    recordings = [path for path in found if _is_recording(Path(path))]
    if not recordings:
        what = f"matches {counted(len(found), 'folder')}, none of them a recording" if found else "matches no folder"
        raise InputError(f"{word}: {what}; a recording has videos/ or images/, and a calibration")
    if passed := [Path(path).name for path in found if path not in recordings]:
        say(f"{word}: {', '.join(passed)}: passed over, as no recording")
    return f"{KEY}=" + ",".join(quoted_value(path) for path in recordings)


def _matching(pattern: str) -> list[str]:
    """The folders that a pattern matches, without hidden ones."""
    path = Path(pattern)
    found = Path(path.anchor).glob(str(path.relative_to(path.anchor)))
    return [str(folder) for folder in found if folder.is_dir() and not folder.name.startswith(".")]


def _is_recording(path: Path) -> bool:
    """Whether a folder has anything of a recording, whole or not."""
    if (path / "recording.yaml").exists():
        return True
    try:
        return bool(calibrations_of(path, project_in(path)) or find_sources(path))
    except InputError:
        return False


def _parsed(word: str) -> Any:
    """The value as Hydra reads it.

    Raises:
        InputError: it cannot be read.
    """
    from hydra.core.override_parser.overrides_parser import OverridesParser
    from hydra.errors import HydraException

    try:
        return OverridesParser.create().parse_override(word).value()
    except HydraException as error:
        raise InputError(
            f"{word}: cannot be read; write \"recording=glob('/data/*')\", or several patterns as "
            "\"recording=glob(['/a/*','/b/*'],exclude='/a/old*')\""
        ) from error


def _text(value: object) -> str:
    """Of an element as Hydra parsed it, without its quotes."""
    return str(getattr(value, "text", value))
