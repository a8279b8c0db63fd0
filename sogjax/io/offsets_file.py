"""Writing keys such as `frame_offset` into a recording.yaml without changing anything else in it."""

import json
from collections.abc import Mapping
from pathlib import Path

import yaml

from sogjax.errors import InputError
from sogjax.io.files import atomic_path
from sogjax.io.recording_settings import read_recording_settings

KEY = "frame_offset"


def offsets_line(offsets: Mapping[str, float | int]) -> str:
    """What recording.yaml says of offsets: whole numbers where they are whole, else with two decimals."""
    shown = {name: int(offset) if float(offset).is_integer() else round(offset, 2) for name, offset in offsets.items()}
    return f"{KEY}: {{{', '.join(f'{json.dumps(name)}: {offset}' for name, offset in shown.items())}}}"


def with_entries(path: Path, text: str, lines: Mapping[str, str]) -> str:
    """The text of a recording.yaml with lines in place of what it said of their keys, or at its end.

    Args:
        path: of the file, for complaints.
        text: of the file.
        lines: by key.

    Raises:
        InputError: a file whose entries cannot be replaced line by line.
    """
    for key, line in lines.items():
        text = _replaced(path, text, key, line)
    return text


def write_frame_offsets(path: Path, offsets: Mapping[str, float | int]) -> Path | None:
    """Write `frame_offset` to `path`, replacing an older one; comments and other keys stay.

    Returns:
        The path of the kept old file, None if there was none.

    Raises:
        InputError: a file that is no recording.yaml, or a folder that cannot be written.
    """
    line = offsets_line(offsets)
    if not path.exists():
        _write(path, line + "\n")
        return None
    read_recording_settings(path)
    before = path.read_text(encoding="utf-8-sig")
    kept = _free_name(path)
    _write(kept, before)
    _write(path, _replaced(path, before, KEY, line))
    return kept


def _replaced(path: Path, text: str, wanted: str, line: str) -> str:
    """The text with the line in place of the old entry, or at its end."""
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    if root is None:
        return text + ("" if text.endswith("\n") or not text else "\n") + line + "\n"
    if root.flow_style:
        raise InputError(f"{path}: is written in braces; write `{line}` into it by hand")
    for key, value in root.value:
        if key.value == wanted:
            block = isinstance(value, yaml.MappingNode) and not value.flow_style  # it ends where the next key begins
            return text[: key.start_mark.index] + line + ("\n" if block else "") + text[value.end_mark.index :]
    return text[: root.end_mark.index].rstrip("\n") + "\n" + line + "\n" + text[root.end_mark.index :]


def _write(path: Path, text: str) -> None:
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _free_name(path: Path) -> Path:
    """A name beside the file that is not taken."""
    number = 1
    while (kept := path.with_name(f"{path.name}.{number}.old")).exists():
        number += 1
    return kept
