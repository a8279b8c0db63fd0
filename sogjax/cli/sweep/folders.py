"""Which recordings a command names: one, several, or a pattern of folders."""

import glob
import os
from collections.abc import Iterable, Sequence
from itertools import takewhile
from pathlib import Path
from typing import Any

from hydra.core.override_parser.types import ChoiceSweep

from sogjax.cli.words import parsed, quoted_value
from sogjax.errors import InputError, counted
from sogjax.io.projects import calibrations_of, project_in
from sogjax.io.recording_files import SETTINGS
from sogjax.io.source import find_sources
from sogjax.run.terminal import say

KEY = "recording"
ACTORS = "actors"
"""The folder of the actors that were made, beside the results of the recordings."""


def with_folders(words: Sequence[str]) -> tuple[list[str], Path | None]:
    """The words of a sweep, `recording=glob(PATTERN)` as the list of the recordings that it matches; and its root.

    The root is the folder that the patterns begin in, their parts before the first wildcard; None without a pattern.
    What a pattern matches may change with every recording that is added; the root does not.

    Raises:
        InputError: the pattern cannot be read, or matches no recording.
    """
    found, root = [], None
    for word in words:
        if word.startswith(f"{KEY}=glob("):
            patterns = _parsed(word)
            word, root = _expanded(word, patterns), _common(map(_fixed_part, _spelled_out(patterns.include)))
        found.append(word)
    return found, root


def recordings_in(words: Sequence[str]) -> list[str]:
    """The recordings that a sweep names, in order; one of them, or none, where it has no list of them."""
    for word in reversed(words):
        if word.partition("=")[0] == KEY:
            value = _parsed(word)
            return [_text(item) for item in value.list] if isinstance(value, ChoiceSweep) else [_text(value)]
    return []


def whole_path(path: str | Path) -> Path:
    """A path from the root, without `..`, so that two spellings of it are one; links stay as they are."""
    return Path(os.path.abspath(path))  # noqa: PTH100  resolve() follows links, absolute() keeps `..`


def places_of(recordings: Sequence[Path], root: Path | None = None) -> list[str]:
    """A name for each recording: its path from `root`, or else from the folder that they have in common.

    Raises:
        InputError: a recording is named twice, lies within another one, or would lie among the actors.
    """
    whole = [whole_path(path) for path in recordings]
    repeated = next((path for k, path in enumerate(whole) if path in whole[:k]), None)
    if repeated is not None:
        raise InputError(f"recording={repeated}: is named twice; name each recording once")
    around = next((path for path in whole if any(path in other.parents for other in whole)), None)
    if around is not None:
        raise InputError(f"recording={around}: another of the recordings lies in this folder; leave one of them out")
    parents = [path.parent for path in whole]
    common = _common(parents if root is None else [*parents, root])
    places = [path.relative_to(common) for path in whole]
    if clash := next((path for path, place in zip(whole, places, strict=True) if place.parts[:1] == (ACTORS,)), None):
        raise InputError(
            f"recording={clash}: its results would lie in the folder {ACTORS}, which is for the actors of all; rename "
            "the recording's folder, or leave it out"
        )
    return [str(place) for place in places]


def _common(folders: Iterable[Path]) -> Path:
    return Path(os.path.commonpath([*folders]))


def _fixed_part(pattern: str) -> Path:
    """The folder that a pattern begins in; of a recording without any wildcard the one around it."""
    parts = whole_path(pattern).parts
    return Path(*takewhile(lambda part: not glob.has_magic(part), parts[:-1] or parts))


def _expanded(word: str, value: Any) -> str:
    """A word with a pattern as the list of the recordings that it matches; folders that are none are named."""
    included, excluded = (_matching(patterns) for patterns in (value.include, value.exclude))
    found = sorted(included[path] for path in included.keys() - excluded.keys())
    recordings = [path for path in found if _is_recording(Path(path))]
    if not recordings:
        what = f"matches {counted(len(found), 'folder')}, none of them a recording" if found else "matches no folder"
        raise InputError(f"{word}: {what}; a recording has videos/ or images/, and a calibration")
    if passed := [whole_path(path).name for path in found if path not in recordings]:
        say(f"{word}: {', '.join(passed)}: passed over, as no recording")
    return f"{KEY}=" + ",".join(quoted_value(path) for path in recordings)


def _matching(patterns: Sequence[object]) -> dict[Path, str]:
    """The folders that some patterns match as in a shell, as they are spelled by their whole paths."""
    listed = (glob.glob(pattern, recursive=True) for pattern in _spelled_out(patterns))  # noqa: PTH207  Path's fails on "."
    found = (Path(path) for paths in listed for path in paths)
    return {whole_path(path): str(path) for path in found if path.is_dir()}


def _spelled_out(patterns: Sequence[object]) -> list[str]:
    """The patterns that Hydra parsed, with the home folder for `~`."""
    return [os.path.expanduser(_text(pattern)) for pattern in patterns]  # noqa: PTH111  Path's raises for no user


def _is_recording(path: Path) -> bool:
    """Whether a folder has anything of a recording, whole or not."""
    if SETTINGS.of(path).exists():
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
    try:
        return parsed([word])[0].value()
    except InputError as error:
        raise InputError(
            f"{word}: cannot be read; write \"recording=glob('/data/*')\", or several patterns as "
            "\"recording=glob(['/a/*','/b/*'],exclude='/a/old*')\""
        ) from error


def _text(value: object) -> str:
    """An element as Hydra parsed it, without its quotes."""
    return str(getattr(value, "text", value))
