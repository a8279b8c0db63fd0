"""A recording: a folder with synchronised videos, their calibration, and what else is known of them."""

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sogjax.errors import InputError
from sogjax.io.calibration.load import load_calibration
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.camera_names import chosen_cameras, folder_around
from sogjax.io.example_poses import ExamplePose, check_size, find_background, find_example_poses
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.image_file import ColorGains
from sogjax.io.initial_pose import read_initial_poses
from sogjax.io.projects import (
    Project,
    Shifts,
    calibrations_of,
    named_as_sources,
    named_calibration,
    pose2sims_shifts,
    project_in,
)
from sogjax.io.recording_frames import TimedImages, frame_rate, frames_in_common, images_by_time, uneven
from sogjax.io.recording_settings import RecordingSettings, read_recording_settings
from sogjax.io.source import find_sources, look_at_source

FAR_CAMERA = 100.0
"""Metres from the origin at which a camera's place is suspected to be in other units."""

DEFAULT_UP = "z"


@dataclass(frozen=True)
class Recording:
    """A recording whose files were checked and fit together; images are read by `sogjax.io.video`."""

    path: Path
    name: str
    rig: CameraRig
    fps: float
    up: str
    """The world's vertical, one of `sogjax.model.rotation.UP_AXES`."""
    first_frame: int
    """Frame t of a camera is frame t + frame_offset of its file."""
    num_frames: int
    sources: dict[str, Path]
    """By camera: a video, or a folder of images."""
    frame_offset: dict[str, int]
    """By camera, 0 where the recording names none; the nearest whole number."""
    background: dict[str, Path]
    """By camera: the empty scene, where there is such an image."""
    example_poses: tuple[ExamplePose, ...]
    initial_poses: Path | None
    ground_truth: Path | None
    warnings: tuple[str, ...]
    """One sentence each."""
    frame_part: dict[str, float] = field(default_factory=dict)
    """By camera what its offset is beyond `frame_offset`, -0.5 to 0.5: it shows what was so much earlier; without
    an entry 0."""
    num_images: dict[str, int] = field(default_factory=dict)
    """By camera the number of its images; a camera without an entry has one for every frame."""
    picked: dict[str, tuple[int, ...]] = field(default_factory=dict)
    """By camera the image of its file that each of its frames is, where time stamps were asked for; else frame k is
    image k."""
    missing: dict[str, tuple[tuple[int, int], ...]] = field(default_factory=dict)
    """By camera the first and last frame (its own numbers) of each while in which its pictures are not to be used."""
    color_gains: dict[str, ColorGains] = field(default_factory=dict)
    """By camera the factors of its pictures; without an entry they stay as recorded."""
    keypoint_scheme: str | None = None
    """Name or file of the scheme that keypoint files beside it follow; None: told by their content."""
    fewest_cameras: int | None = None
    """Frames that so many cameras have are used; None: only those that all have."""

    @property
    def complete(self) -> bool:
        """Whether every camera has a picture of every frame."""
        return self.fewest_cameras is None and not any(self.missing.get(name) for name in self.rig.names)

    def has_image(self, camera: str, frame: int) -> bool:
        """Whether a camera's file holds a frame, counted from the recording's first."""
        number = self.first_frame + frame + self.frame_offset[camera]
        return 0 <= number < self.num_images.get(camera, number + 1)

    def is_missing(self, camera: str, frame: int) -> bool:
        """Whether a camera's picture of a frame, counted from the recording's first, is not to be used."""
        number = self.first_frame + frame
        return any(first <= number <= last for first, last in self.missing.get(camera, ()))

    def num_missing(self, frames: Iterable[int]) -> dict[str, int]:
        """By camera how many of the frames (as in `has_image`) it has no picture of; none where it has all."""
        shown = lambda camera, frame: self.has_image(camera, frame) and not self.is_missing(camera, frame)
        frames = [] if self.complete else list(frames)
        counts = {camera: sum(not shown(camera, frame) for frame in frames) for camera in self.rig.names}
        return {camera: count for camera, count in counts.items() if count}


def open_recording(path: Path) -> Recording:
    """The recording in the folder `path`, with everything in it checked.

    Raises:
        InputError: something is missing, unreadable, or does not fit together.
    """
    if not path.is_dir():
        what = "this is a file" if path.is_file() else "there is no such folder"
        raise InputError(f"{path}: {what}; {folder_around(path) or 'give the folder of a recording'}")
    given, project = read_recording_settings(path / "recording.yaml"), project_in(path)
    settings = project.filled_in(given) if project else given
    calibration = _calibration(path, settings, project)
    sources = find_sources(path)
    calibrated = named_as_sources(load_calibration(calibration, settings.unit), sources, project)
    cameras = chosen_cameras(path, calibration, settings, calibrated.names, sources)
    rig = calibrated.select(cameras)
    sources = {camera: sources[camera] for camera in cameras}
    for key, by_camera in settings.by_camera.items():
        strange = next((camera for camera in by_camera if camera not in calibrated.names), None)
        if strange is not None:
            raise InputError(
                f"{path / 'recording.yaml'}: {key}: there is no camera {strange!r} in the calibration; "
                f"its cameras are: {', '.join(calibrated.names)}"
            )
    shifts = (pose2sims_shifts(path, cameras) if project else Shifts({}, ())).without(settings.frame_offset)
    exact = {camera: settings.frame_offset.get(camera, shifts.offsets.get(camera, 0)) for camera in cameras}
    offsets = {camera: round(offset) for camera, offset in exact.items()}
    with ThreadPoolExecutor() as pool:
        infos = dict(zip(cameras, pool.map(look_at_source, sources.values()), strict=True))
    rig = rig.with_sizes({camera: info.size for camera, info in infos.items()})
    for camera in cameras:
        check_size(sources[camera], infos[camera].size, rig, camera)
    fps = frame_rate(path, settings, infos)
    timed = images_by_time(sources, infos, fps) if settings.time_stamps else {}
    counts = {camera: len(timed[camera].picked) if camera in timed else infos[camera].num_frames for camera in cameras}
    if project is not None:
        settings = project.within(settings, min(counts[camera] - offsets[camera] for camera in cameras))
    first, count, warnings = frames_in_common(path, settings, counts, offsets)
    return Recording(
        path=path,
        name=path.resolve().name,
        rig=rig,
        fps=fps,
        up=settings.up or DEFAULT_UP,
        first_frame=first,
        num_frames=count,
        sources=sources,
        frame_offset=offsets,
        frame_part={camera: exact[camera] - offset for camera, offset in offsets.items() if exact[camera] != offset},
        background=find_background(path / "background", rig, calibrated.names),
        example_poses=find_example_poses(
            path / "example_poses", rig, calibrated.names, settings.example_poses, range(first, first + count)
        ),
        initial_poses=_initial_poses(path / "initial_pose.yaml"),
        ground_truth=_ground_truth(path / "ground_truth.npz"),
        warnings=(
            *warnings,
            *(f"{path}: {warning}" for warning in shifts.warnings),
            *_doubts(path, given, rig, project),
            *uneven(sources, infos, timed, settings.fewest_cameras),
        ),
        num_images=counts,
        picked={camera: images.picked for camera, images in timed.items()},
        missing=_missing(settings, cameras, timed, offsets),
        color_gains={camera: settings.color_gains[camera] for camera in cameras if camera in settings.color_gains},
        keypoint_scheme=_scheme(path, settings.keypoint_scheme),
        fewest_cameras=settings.fewest_cameras,
    )


ADD_CALIBRATION = "add calibration.toml, or a calibration of another program (README, Formats)"


def _calibration(path: Path, settings: RecordingSettings, project: Project | None) -> Path:
    if settings.calibration is not None:
        named = named_calibration(path, settings.calibration, project)
        if not named.is_file():
            raise InputError(f"{path / 'recording.yaml'}: calibration: there is no file {named}; correct the name")
        return named
    found = calibrations_of(path, project)
    if not found:
        raise InputError(f"{path}: holds no calibration file; {folder_around(path) or ADD_CALIBRATION}")
    if len(found) > 1:
        names = ", ".join(file.name for file in found)
        raise InputError(f"{path}: holds several calibrations ({names}); name one as `calibration:` in recording.yaml")
    return found[0]


def _missing(
    settings: RecordingSettings, cameras: tuple[str, ...], timed: dict[str, TimedImages], offsets: dict[str, int]
) -> dict[str, tuple[tuple[int, int], ...]]:
    """What recording.yaml leaves out and, where cameras may be missing, frames whose own image was lost."""
    missing = {camera: settings.missing[camera] for camera in cameras if camera in settings.missing}
    if settings.fewest_cameras is not None:
        for camera, images in timed.items():
            lost = tuple((frame - offsets[camera], frame - offsets[camera]) for frame in images.lost)
            missing |= {camera: missing.get(camera, ()) + lost} if lost else {}
    return missing


def _scheme(path: Path, named: str | None) -> str | None:
    """The scheme that recording.yaml names, a file beside it by its path."""
    return str(path / named) if named is not None and (path / named).is_file() else named


def _initial_poses(path: Path) -> Path | None:
    if not path.exists():
        return None
    read_initial_poses(path)
    return path


def _ground_truth(path: Path) -> Path | None:
    if not path.exists():
        return None
    load_ground_truth(path)
    return path


def _doubts(path: Path, settings: RecordingSettings, rig: CameraRig, project: Project | None) -> tuple[str, ...]:
    """Sentences on what may be wrong; `settings` are those of recording.yaml alone."""
    doubts = []
    if project is not None and settings.up is None:
        doubts += [project.doubt] if project.doubt else []
    elif settings.up is None:
        doubts.append(f"{path}: does not give the vertical; {DEFAULT_UP} is assumed (`up:` in recording.yaml)")
    distances = np.linalg.norm(np.asarray(rig.cameras.camera_from_world)[:, :3, 3], axis=-1)
    if distances.max() > FAR_CAMERA:
        doubts.append(
            f"{path}: camera {rig.names[int(distances.argmax())]!r} stands {distances.max():.0f} m "
            "from the origin; if the calibration is in millimetres, write `unit: mm` into recording.yaml"
        )
    return tuple(doubts)
