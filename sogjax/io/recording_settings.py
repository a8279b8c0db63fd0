"""`recording.yaml`: its keys, all of them optional, and writing some without changing anything else in it."""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Any

import yaml

from sogjax.errors import InputError
from sogjax.io.calibration.rig import METRES_PER_UNIT
from sogjax.io.example_poses import ExampleSettings, read_examples
from sogjax.io.files import write_file
from sogjax.io.image_file import ColorGains
from sogjax.io.yaml_entry import Entry, read_yaml
from sogjax.model.rotation import UP_AXES

DEFAULT_UP = "z"
"""The vertical of a recording that does not give it."""
FASTEST = 10_000.0
"""Frames per second; a faster camera is taken for a mistake."""


@dataclass(frozen=True)
class RecordingSettings:
    """The content of `recording.yaml`, a field for each key; None where a key is absent."""

    fps: float | None = None
    calibration: str | None = None
    unit: str | None = None
    up: str | None = None
    cameras: tuple[str, ...] | None = None
    frame_offset: dict[str, float] = field(default_factory=dict)
    first_frame: int | None = None
    last_frame: int | None = None
    time_stamps: bool = False
    """Whether images are selected by their times in the video files instead of counted."""
    fewest_cameras: int | None = None
    missing: dict[str, tuple[tuple[int, int], ...]] = field(default_factory=dict)
    """First and last frame of each while in which a camera's pictures are not to be used."""
    color_gains: dict[str, ColorGains] = field(default_factory=dict)
    example_poses: tuple[ExampleSettings, ...] | None = None
    keypoint_scheme: str | None = None
    subject: tuple[str, ...] = ()
    """Whom the recording shows, as their actor files are named; empty where nobody is named."""

    @property
    def by_camera(self) -> dict[str, dict[str, Any]]:
        """What is given for cameras by their names, by key."""
        return {"frame_offset": {**self.frame_offset}, "missing": {**self.missing}, "color_gains": {**self.color_gains}}


def read_recording_settings(path: Path) -> RecordingSettings:
    """Read `recording.yaml`; a missing file counts as empty.

    Raises:
        InputError: no YAML, an unknown key, or a value of the wrong kind.
    """
    entry = read_yaml(path) if path.exists() else Entry(path, "", None)
    given = {} if entry.value is None else entry.given(_READERS)
    return RecordingSettings(**{key: _READERS[key](value) for key, value in given.items()})


def _fps(entry: Entry) -> float:
    expected = f"a positive number of frames per second, at most {FASTEST:g}"
    rate = entry.number(expected, 0.0, FASTEST)
    if rate == 0.0:
        raise entry.error(expected)
    return rate


def _frame(entry: Entry) -> int:
    return entry.whole("a whole number of frames")


def _yes_or_no(entry: Entry) -> bool:
    if not isinstance(entry.value, bool):
        raise entry.error("true or false")
    return entry.value


def _camera_names(entry: Entry) -> tuple[str, ...]:
    return _each_once(entry, [item.text() for item in entry.items()], "the names of at least one camera, each once")


def _subjects(entry: Entry) -> tuple[str, ...]:
    """The names, one or several, which become names of files."""
    names = [item.file_name() for item in (entry.items() if isinstance(entry.value, list) else [entry])]
    return _each_once(entry, names, "the name of whom the recording shows, or a list of names, each once")


def _each_once(entry: Entry, names: list[str], expected: str) -> tuple[str, ...]:
    if not names or len(set(names)) < len(names):
        raise entry.error(expected)
    return tuple(names)


def _offset(entry: Entry) -> float:
    largest = 1e6  # frames; a larger offset is taken for a mistake
    return entry.number(f"a number of frames, at most {largest:g}", -largest, largest)


def _gains(entry: Entry) -> ColorGains:
    largest = 8.0  # a larger factor is taken for a mistake
    expected = f"three factors of red, green and blue light between {1 / largest:g} and {largest:g}"
    red, green, blue = entry.numbers(expected, lowest=1 / largest, highest=largest)
    return red, green, blue


def _spans(entry: Entry) -> tuple[tuple[int, int], ...]:
    return tuple(map(_span, entry.items()))


def _span(entry: Entry) -> tuple[int, int]:
    ends = [_frame(end) for end in entry.items()]
    if len(ends) != 2 or ends[1] < ends[0]:
        raise entry.error("the first and the last frame of a while, such as [120, 180]")
    return ends[0], ends[1]


def _by_camera(read: Callable[[Entry], Any]) -> Callable[[Entry], dict[str, Any]]:
    return lambda entry: {camera: read(value) for camera, value in entry.mapping().items()}


_READERS: dict[str, Callable[[Entry], Any]] = {
    "fps": _fps,
    "calibration": Entry.file_name,
    "unit": lambda entry: entry.choice(METRES_PER_UNIT, "a unit of length"),
    "up": lambda entry: entry.choice(UP_AXES, "an axis"),
    "cameras": _camera_names,
    "frame_offset": _by_camera(_offset),
    "first_frame": _frame,
    "last_frame": _frame,
    "time_stamps": _yes_or_no,
    "fewest_cameras": lambda entry: entry.whole("a number of cameras, at least 1", lowest=1),
    "missing": _by_camera(_spans),
    "color_gains": _by_camera(_gains),
    "example_poses": read_examples,
    "keypoint_scheme": Entry.file_name,
    "subject": _subjects,
}
"""What reads the value of each key of the file; the keys are also the fields' names."""


def offsets_line(offsets: Mapping[str, float | int]) -> str:
    """What recording.yaml says of offsets: whole numbers where they are whole, else with two decimals."""
    shown = {name: int(offset) if float(offset).is_integer() else round(offset, 2) for name, offset in offsets.items()}
    return f"frame_offset: {{{', '.join(f'{json.dumps(name)}: {offset}' for name, offset in shown.items())}}}"


def write_frame_offsets(path: Path, offsets: Mapping[str, float | int]) -> Path | None:
    """Write `frame_offset` to `path`, replacing an older one; comments and other keys stay.

    Returns:
        The path of the kept old file, None if there was none.

    Raises:
        InputError: a file that is no recording.yaml, or a folder that cannot be written.
    """
    line = offsets_line(offsets)
    if not path.exists():
        write_file(path, line + "\n")
        return None
    read_recording_settings(path)
    before = path.read_text(encoding="utf-8-sig")
    names = (path.with_name(f"{path.name}.{number}.old") for number in count(1))
    kept = next(name for name in names if not name.exists())
    write_file(kept, before)
    write_file(path, with_entries(path, before, {"frame_offset": line}))
    return kept


def with_entries(path: Path, text: str, lines: Mapping[str, str]) -> str:
    """The text of the recording.yaml at `path` with lines in place of what it said of their keys, or at its end.

    Raises:
        InputError: a file whose entries cannot be replaced line by line.
    """
    for key, line in lines.items():
        text = _with_entry(path, text, key, line)
    return text


def _with_entry(path: Path, text: str, wanted: str, line: str) -> str:
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
