"""Folders of other programs that are recordings as they are: projects of Pose2Sim, recordings of FreeMoCap."""

import tomllib
from collections import Counter
from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from sogjax.errors import InputError
from sogjax.io.calibration.load import find_calibrations
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.camera_names import matched_names
from sogjax.io.files import read_parsed
from sogjax.io.keypoint_files import files_in, json_files, number_in
from sogjax.io.recording_files import POSE, POSE_SYNC, PROJECT, SYNCHRONIZED
from sogjax.io.recording_settings import DEFAULT_UP, FASTEST, RecordingSettings

CONFIG = PROJECT.name
"""A trial's stands in its folder, those of participant and session in the folders around it."""


@dataclass(frozen=True)
class Project:
    """What a folder says by the form that another program gave it, where recording.yaml does not; usually nothing."""

    calibrations: tuple[Path, ...] = ()
    unit: str | None = None
    """The unit of the calibration's lengths."""
    up: str | None = None
    fps: float | None = None
    doubt: str = ""
    """A sentence on what may be wrong."""
    frame_range: tuple[int, int] | None = None
    """First frame to use and the one after the last; None: all."""

    @property
    def found(self) -> bool:
        """Whether another program made the folder."""
        return self.up is not None

    def filled_in(self, settings: RecordingSettings) -> RecordingSettings:
        """The settings of recording.yaml with the project's where a key is absent."""
        unit, up, fps = settings.unit or self.unit, settings.up or self.up, settings.fps or self.fps
        return replace(settings, unit=unit, up=up, fps=fps)

    def within(self, settings: RecordingSettings, num_frames: int) -> RecordingSettings:
        """The settings with the project's frames, as far as there are so many, where recording.yaml names none."""
        if self.frame_range is None or settings.first_frame is not None or settings.last_frame is not None:
            return settings
        first, stop = self.frame_range[0], min(self.frame_range[1], num_frames)
        return replace(settings, first_frame=first, last_frame=stop - 1) if first < stop else settings


def project_in(path: Path) -> Project:
    """What another program's project in a folder says.

    Raises:
        InputError: its configuration cannot be read.
    """
    if (path / CONFIG).is_file():
        return _pose2sim(path)
    if SYNCHRONIZED.of(path).is_dir():
        return _freemocap(path)
    return Project(doubt=f"{path}: does not give the vertical; {DEFAULT_UP} is assumed (`up:` in recording.yaml)")


def calibrations_of(path: Path, project: Project) -> list[Path]:
    """The calibrations of a recording: in its folder, else where the project has them."""
    return find_calibrations(path) or [*project.calibrations]


def named_calibration(path: Path, name: str, project: Project) -> Path:
    """The calibration that recording.yaml names: in the recording's folder, or where the project has it."""
    others = () if (path / name).is_file() else project.calibrations
    return next((file for file in others if file.name == name), path / name)


def named_as_sources(rig: CameraRig, sources: dict[str, Path], project: Project) -> CameraRig:
    """The rig of a project with cameras named as their videos are: `cam01` where the calibration has int_cam01_img."""
    if not project.found:
        return rig
    names = {calibrated: video for video, calibrated in matched_names(sources, rig.names).items()}
    return CameraRig(tuple(names.get(name, name) for name in rig.names), rig.cameras)


def _pose2sim(path: Path) -> Project:
    settings = _toml(path / CONFIG).get("project", {})
    rate = settings.get("frame_rate") if isinstance(settings, dict) else None
    rate = float(rate) if isinstance(rate, int | float) else None  # else `auto`
    if rate is not None and not 0.0 < rate <= FASTEST:
        raise InputError(f"{path / CONFIG}: frame_rate = {rate} is no frame rate; write 'auto' or frames per second")
    frames = _frame_range(path / CONFIG, settings.get("frame_range") if isinstance(settings, dict) else None)
    return Project(_pose2sim_calibrations(path), up=DEFAULT_UP, fps=rate, frame_range=frames)


def _frame_range(path: Path, value: Any) -> tuple[int, int] | None:
    """`[10, 300]`, the second not included; 'all', 'auto' and an empty list are all frames."""
    if not isinstance(value, list) or not value:
        return None
    whole = all(isinstance(number, int) and not isinstance(number, bool) for number in value)
    if len(value) != 2 or not whole or not 0 <= value[0] < value[1]:
        raise InputError(f"{path}: frame_range = {value} is none; write [FIRST, STOP] with 0 <= FIRST < STOP, or 'all'")
    return value[0], value[1]


def _pose2sim_calibrations(path: Path) -> tuple[Path, ...]:
    """The calibrations in a folder with `calib` in its name, of the project or of the session around it."""
    here = path.resolve()
    around = [folder for folder in here.parents[:2] if (folder / CONFIG).is_file()]
    for folder in (path, *around):
        inside = sorted(part for part in folder.iterdir() if part.is_dir() and "calib" in part.name.lower())
        files = [file for part in inside for file in find_calibrations(part)]
        own = [file for file in files if file.suffix.lower() == ".toml"]  # made by Pose2Sim of the other one
        if files:
            return tuple(own or files)
    return ()


def _freemocap(path: Path) -> Project:
    """Millimetres; the world is the board's on the floor, or the first camera's."""
    tables = [_toml(file).get("metadata") for file in find_calibrations(path) if file.suffix.lower() == ".toml"]
    if any(isinstance(table, dict) and table.get("groundplane_calibration") is True for table in tables):
        return Project((), "mm", "z")
    doubt = (
        f"{path}: was calibrated without a ground plane, so its first camera is taken to be level; write the vertical "
        "as `up:` into recording.yaml if it is not -y"
    )
    return Project((), "mm", "-y", doubt=doubt)


def _toml(path: Path) -> dict[str, Any]:
    return read_parsed(path, "TOML", tomllib.loads, "correct it", max_bytes=2**20)


class Shifts(NamedTuple):
    """What Pose2Sim's files tell of the cameras' offsets."""

    offsets: dict[str, int]
    """The `frame_offset` of each camera: by how much more its pictures are numbered in `pose/`."""
    untold: tuple[str, ...]
    """Cameras of which that cannot be told."""

    def without(self, cameras: Collection[str]) -> "Shifts":
        """What is told of the other cameras."""
        offsets = {camera: offset for camera, offset in self.offsets.items() if camera not in cameras}
        return Shifts(offsets, tuple(camera for camera in self.untold if camera not in cameras))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on what is shifted, and on what is not known."""
        found = []
        shown = ", ".join(f"{camera} by {offset:+d}" for camera, offset in self.offsets.items() if offset)
        if shown:
            remedy = "write `frame_offset` into recording.yaml if that is wrong"
            found.append(f"frames are shifted as in {POSE_SYNC.name}/ ({shown}); {remedy}")
        if self.untold:
            found.append(
                f"{POSE_SYNC.name}/ does not tell by how much frames of {', '.join(self.untold)} are shifted, since "
                f"its files there are not those of {POSE.name}/ under other numbers: none are; synchronise again, or "
                "write `frame_offset` into recording.yaml"
            )
        return tuple(found)


def pose2sims_shifts(path: Path, project: Project, cameras: Iterable[str]) -> Shifts:
    """What the files of a project say of these cameras; nothing where Pose2Sim has not synchronised it."""
    if not project.found:
        return Shifts({}, ())
    before, after = (files_in(part.of(path)) for part in (POSE, POSE_SYNC))
    if before is None or after is None:
        return Shifts({}, ())
    cameras = [*cameras]
    names, shifted = (matched_names(cameras, found.by_name) for found in (before, after))
    told = {
        camera: _offset(before.by_name[names[camera]], after.by_name[shifted[camera]])
        for camera in cameras
        if camera in names and camera in shifted
    }
    offsets = {camera: offset for camera, offset in told.items() if offset is not None}
    return Shifts(offsets, tuple(camera for camera in cameras if camera in names and camera not in offsets))


def _offset(before: Path, after: Path) -> int | None:
    """What most of the shifted files say, if anything; the largest are looked at: pictures of nobody are all alike."""
    if not (before.is_dir() and after.is_dir()):
        return None
    compared, most_bytes = 5, 2**20
    shifted = sorted(json_files(after), key=lambda file: -file.stat().st_size)[:compared]
    by_size: dict[int, list[Path]] = {file.stat().st_size: [] for file in shifted}
    for file in json_files(before):
        by_size.get(file.stat().st_size, []).append(file)
    votes: Counter[int] = Counter()
    for file in shifted:
        size = file.stat().st_size
        same = [other for other in by_size[size] if size < most_bytes and other.read_bytes() == file.read_bytes()]
        numbers = number_in(same[0].name) if len(same) == 1 else None, number_in(file.name)
        if None not in numbers:
            votes[numbers[0] - numbers[1]] += 1  # pyright: ignore[reportOperatorIssue]
    best = votes.most_common(1)
    return best[0][0] if best and best[0][1] > sum(votes.values()) // 2 else None
