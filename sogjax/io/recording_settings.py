"""The content of `recording.yaml`; every key is optional.

Whom a recording shows: by these names its takes share actor files.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sogjax.io.calibration.rig import METRES_PER_UNIT
from sogjax.io.example_poses import ExampleSettings, read_examples
from sogjax.io.files import objection
from sogjax.io.image_file import ColorGains
from sogjax.io.yaml_entry import Entry, read_yaml
from sogjax.model.rotation import UP_AXES

LARGEST_GAIN = 8.0
"""Of a camera's colours; a larger one is taken for a mistake."""

FASTEST = 10_000.0
"""Frames per second; a faster camera is taken for a mistake."""

LARGEST_OFFSET = 1e6
"""Frames; a larger one is taken for a mistake."""

_KEYS = (
    "fps",
    "calibration",
    "unit",
    "up",
    "cameras",
    "frame_offset",
    "first_frame",
    "last_frame",
    "time_stamps",
    "fewest_cameras",
    "missing",
    "color_gains",
    "example_poses",
    "keypoint_scheme",
    "subject",
)


@dataclass(frozen=True)
class RecordingSettings:
    """The content of `recording.yaml`; None where a key is absent."""

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
    """By camera the first and last frame of each while in which its pictures are not to be used."""
    color_gains: dict[str, ColorGains] = field(default_factory=dict)
    """By camera."""
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
    entries = {} if entry.value is None else entry.fields((), _KEYS)
    given = {key: value for key, value in entries.items() if value.value is not None}
    return RecordingSettings(
        fps=_positive(given["fps"]) if "fps" in given else None,
        calibration=_file_name(given["calibration"]) if "calibration" in given else None,
        unit=given["unit"].choice(METRES_PER_UNIT, "a unit of length") if "unit" in given else None,
        up=given["up"].choice(UP_AXES, "an axis") if "up" in given else None,
        cameras=_camera_names(given["cameras"]) if "cameras" in given else None,
        frame_offset=_offsets(given["frame_offset"]) if "frame_offset" in given else {},
        first_frame=_whole(given["first_frame"]) if "first_frame" in given else None,
        last_frame=_whole(given["last_frame"]) if "last_frame" in given else None,
        time_stamps=_yes_or_no(given["time_stamps"]) if "time_stamps" in given else False,
        fewest_cameras=_count(given["fewest_cameras"]) if "fewest_cameras" in given else None,
        missing=_missing(given["missing"]) if "missing" in given else {},
        color_gains=_gains(given["color_gains"]) if "color_gains" in given else {},
        example_poses=read_examples(given["example_poses"]) if "example_poses" in given else None,
        keypoint_scheme=_file_name(given["keypoint_scheme"]) if "keypoint_scheme" in given else None,
        subject=_subjects(given["subject"]) if "subject" in given else (),
    )


def _positive(entry: Entry) -> float:
    expected = f"a positive number of frames per second, at most {FASTEST:g}"
    result = entry.number(expected)
    if not 0.0 < result <= FASTEST:
        raise entry.error(expected)
    return result


def _whole(entry: Entry) -> int:
    if isinstance(entry.value, bool) or not isinstance(entry.value, int):
        raise entry.error("a whole number of frames")
    return entry.value


def _yes_or_no(entry: Entry) -> bool:
    if not isinstance(entry.value, bool):
        raise entry.error("true or false")
    return entry.value


def _file_name(entry: Entry) -> str:
    """A name that may become one of a file: it leads into no other folder."""
    name = entry.text()
    if (wanted := objection(name)) is not None:
        raise entry.error(wanted)
    return name


def _subjects(entry: Entry) -> tuple[str, ...]:
    """One name or several, each once: they become names of files."""
    names = tuple(map(_file_name, entry.items() if isinstance(entry.value, list) else [entry]))
    if not names or len(set(names)) < len(names):
        raise entry.error("the name of whom the recording shows, or a list of names, each once")
    return names


def _camera_names(entry: Entry) -> tuple[str, ...]:
    names = tuple(item.text() for item in entry.items())
    if not names or len(set(names)) < len(names):
        raise entry.error("the names of at least one camera, each once")
    return names


def _offsets(entry: Entry) -> dict[str, float]:
    expected = f"a number of frames, at most {LARGEST_OFFSET:g}"
    offsets = {camera: offset.number(expected) for camera, offset in entry.mapping().items()}
    for camera, offset in entry.mapping().items():
        if not abs(offsets[camera]) <= LARGEST_OFFSET:
            raise offset.error(expected)
    return offsets


def _gains(entry: Entry) -> dict[str, ColorGains]:
    return {camera: _three_gains(gains) for camera, gains in entry.mapping().items()}


def _three_gains(entry: Entry) -> ColorGains:
    expected = f"three factors of red, green and blue light between {1 / LARGEST_GAIN:g} and {LARGEST_GAIN:g}"
    gains = tuple(item.number(expected) for item in entry.items())
    if len(gains) != 3 or not all(1 / LARGEST_GAIN <= gain <= LARGEST_GAIN for gain in gains):
        raise entry.error(expected)
    return gains[0], gains[1], gains[2]


def _count(entry: Entry) -> int:
    if _whole(entry) < 1:
        raise entry.error("a number of cameras, at least 1")
    return _whole(entry)


def _missing(entry: Entry) -> dict[str, tuple[tuple[int, int], ...]]:
    return {camera: tuple(_span(span) for span in spans.items()) for camera, spans in entry.mapping().items()}


def _span(entry: Entry) -> tuple[int, int]:
    ends = tuple(_whole(end) for end in entry.items())
    if len(ends) != 2 or ends[1] < ends[0]:
        raise entry.error("the first and the last frame of a while, such as [120, 180]")
    return ends[0], ends[1]


OWN_ACTOR = "actor.yaml"
"""The actor file that lies beside a recording's videos."""


def named_subjects(recording: Path) -> tuple[str, ...]:
    """The `subject` of recording.yaml; empty where nobody is named.

    The `actor` of an example pose does not count: it only tells people of one recording apart, and somebody of the same
    name in another recording may wear other clothes.

    Raises:
        InputError: recording.yaml cannot be read.
    """
    return read_recording_settings(recording / "recording.yaml").subject


def posed_subjects(recording: Path) -> tuple[str | None, ...]:
    """Of whom a recording has example poses; None stands for a subject without a name.

    Raises:
        InputError: recording.yaml cannot be read.
    """
    examples = read_recording_settings(recording / "recording.yaml").example_poses
    if examples is None:
        folder = recording / "example_poses"
        return (None,) if folder.is_dir() and any(folder.iterdir()) else ()
    return tuple(dict.fromkeys(example.actor for example in examples))


def actor_files(folder: Path, subjects: tuple[str, ...]) -> list[Path]:
    """The actor file of each subject in a folder of them, there or not."""
    return [folder / f"{subject}.yaml" for subject in subjects]
