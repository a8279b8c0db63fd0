"""A recording: a folder with synchronised videos, their calibration, and what else is known of them."""

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sogjax.errors import InputError
from sogjax.io.calibration.load import load_calibration
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.camera_names import chosen_cameras
from sogjax.io.example_poses import ExamplePose, check_size, find_background, find_example_poses, find_occluders
from sogjax.io.image_file import ColorGains
from sogjax.io.projects import (
    Project,
    calibrations_of,
    named_as_sources,
    named_calibration,
    pose2sims_shifts,
    project_in,
)
from sogjax.io.recording_files import (
    BACKGROUND,
    EXAMPLE_POSES,
    GROUND_TRUTH,
    INITIAL_POSE,
    OCCLUDERS,
    SETTINGS,
    folder_around,
)
from sogjax.io.recording_frames import TimedImages, clip_frames, uneven
from sogjax.io.recording_settings import DEFAULT_UP, RecordingSettings, read_recording_settings
from sogjax.io.source import SourceInfo, find_sources, look_at_source


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
    """The video or the folder of images of each camera."""
    frame_offset: dict[str, int]
    """What a camera's numbers of frames are higher by: the nearest whole number, 0 where the recording names none."""
    background: dict[str, Path]
    """The image of the empty scene of each camera that has one."""
    example_poses: tuple[ExamplePose, ...]
    initial_poses: Path | None
    ground_truth: Path | None
    warnings: tuple[str, ...]
    """Sentences on what may be wrong."""
    frame_part: dict[str, float] = field(default_factory=dict)
    """What a camera's offset is beyond `frame_offset`, -0.5 to 0.5: it shows what was so much earlier; 0 without an
    entry."""
    num_images: dict[str, int] = field(default_factory=dict)
    """How many images a camera has; one without an entry has one for every frame."""
    picked: dict[str, tuple[int, ...]] = field(default_factory=dict)
    """The images of a camera's file that its frames are, where time stamps were asked for; else frame k is image k."""
    missing: dict[str, tuple[tuple[int, int], ...]] = field(default_factory=dict)
    """First and last frame (the recording's numbers) of each while in which a camera's pictures are not to be used."""
    color_gains: dict[str, ColorGains] = field(default_factory=dict)
    """The factors of a camera's pictures; without an entry they stay as recorded."""
    keypoint_scheme: str | None = None
    """Name or file of the scheme that keypoint files beside it follow; None: told by their content."""
    occluders: dict[str, Path] = field(default_factory=dict)
    """The picture of what stands in front of each camera that has one; white hides all behind it."""
    fewest_cameras: int | None = None
    """How many cameras must have a frame that is used; None: all."""

    @property
    def frames(self) -> range:
        """The numbers of its frames."""
        return range(self.first_frame, self.first_frame + self.num_frames)

    def times_of(self, frames: Iterable[int | None]) -> list[float | None]:
        """Seconds from the first frame to each of some frames; None: not of the clip."""
        return [None if frame is None else (frame - self.first_frame) / self.fps for frame in frames]

    @property
    def masked(self) -> bool:
        """Whether masks of example poses tell what its people look like."""
        return any(example.masks for example in self.example_poses)

    @property
    def complete(self) -> bool:
        """Whether every camera has a picture of every frame."""
        return self.fewest_cameras is None and not any(self.missing.get(name) for name in self.rig.names)

    def has_image(self, camera: str, frame: int) -> bool:
        """Whether a camera's file holds a frame."""
        number = frame + self.frame_offset[camera]
        return 0 <= number < self.num_images.get(camera, number + 1)

    def is_missing(self, camera: str, frame: int) -> bool:
        """Whether a camera's picture of a frame is not to be used."""
        return any(first <= frame <= last for first, last in self.missing.get(camera, ()))

    def num_missing(self, frames: Iterable[int]) -> dict[str, int]:
        """How many of the frames a camera has no picture of, without cameras that have all."""
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
    given, project = read_recording_settings(SETTINGS.of(path)), project_in(path)
    settings = project.filled_in(given)
    calibrated, sources = _calibrated(path, settings, project)
    _check_by_camera(path, settings, calibrated)
    shifts = pose2sims_shifts(path, project, sources).without(settings.frame_offset)
    exact = {camera: settings.frame_offset.get(camera, shifts.offsets.get(camera, 0)) for camera in sources}
    offsets = {camera: round(offset) for camera, offset in exact.items()}
    rig, infos = _sized(calibrated.select(tuple(sources)), sources)
    frames = clip_frames(path, settings, project, sources, infos, offsets)
    return Recording(
        path=path,
        name=path.resolve().name,
        rig=rig,
        fps=frames.fps,
        up=settings.up or DEFAULT_UP,
        first_frame=frames.numbers[0],
        num_frames=len(frames.numbers),
        sources=sources,
        frame_offset=offsets,
        frame_part={camera: exact[camera] - offset for camera, offset in offsets.items() if exact[camera] != offset},
        background=find_background(BACKGROUND.of(path), rig, calibrated.names),
        occluders=find_occluders(OCCLUDERS.of(path), rig, calibrated.names),
        example_poses=find_example_poses(
            EXAMPLE_POSES.of(path), rig, calibrated.names, settings.example_poses, frames.numbers
        ),
        initial_poses=INITIAL_POSE.checked(path),
        ground_truth=GROUND_TRUTH.checked(path),
        warnings=(
            *frames.warnings,
            *(f"{path}: {warning}" for warning in shifts.warnings),
            *_doubts(path, given, rig, project),
            *uneven(sources, infos, frames.timed, settings.fewest_cameras),
        ),
        num_images=frames.num_images,
        picked={camera: images.picked for camera, images in frames.timed.items()},
        missing=_missing(settings, frames.timed, offsets),
        color_gains={camera: settings.color_gains[camera] for camera in sources if camera in settings.color_gains},
        keypoint_scheme=_scheme(path, settings.keypoint_scheme),
        fewest_cameras=settings.fewest_cameras,
    )


def open_place(path: Path) -> Recording:
    """A recording without pictures: what is known of a place before its cameras begin.

    It has a calibration and, perhaps, recording.yaml, pictures of the background, and of what stands in front.

    Raises:
        InputError: something is missing, unreadable, or does not fit together; or no size of the pictures is known.
    """
    if not path.is_dir():
        raise InputError(f"{path}: there is no such folder; give one with the calibration of the cameras")
    given, project = read_recording_settings(SETTINGS.of(path)), project_in(path)
    settings = project.filled_in(given)
    rig = load_calibration(_calibration(path, settings, project), settings.unit)
    _check_by_camera(path, settings, rig)
    chosen = rig.names if settings.cameras is None else tuple(settings.cameras)
    strange = [name for name in chosen if name not in rig.names]
    if strange:
        raise InputError(
            f"{SETTINGS.of(path)}: cameras: there is no camera {strange[0]!r} in the calibration; its cameras are: "
            f"{', '.join(rig.names)}"
        )
    used = rig.select(chosen)
    if np.isnan(np.asarray(used.cameras.image_size)).any():
        raise InputError(f"{path}: the calibration does not say the size of the pictures; add it (image size, pixels)")
    return Recording(
        path=path,
        name=path.resolve().name,
        rig=used,
        fps=settings.fps or 0.0,
        up=settings.up or DEFAULT_UP,
        first_frame=0,
        num_frames=0,
        sources={},
        frame_offset=dict.fromkeys(used.names, 0),
        background=find_background(BACKGROUND.of(path), used, rig.names),
        occluders=find_occluders(OCCLUDERS.of(path), used, rig.names),
        example_poses=(),
        initial_poses=None,
        ground_truth=None,
        warnings=tuple(_doubts(path, given, used, project)),
        color_gains={name: settings.color_gains[name] for name in used.names if name in settings.color_gains},
    )


def _calibrated(path: Path, settings: RecordingSettings, project: Project) -> tuple[CameraRig, dict[str, Path]]:
    """All calibrated cameras, and the videos or folders of images of those that are used."""
    calibration = _calibration(path, settings, project)
    sources = find_sources(path)
    rig = named_as_sources(load_calibration(calibration, settings.unit), sources, project)
    cameras = chosen_cameras(path, calibration, settings.cameras, rig.names, sources)
    return rig, {camera: sources[camera] for camera in cameras}


def _calibration(path: Path, settings: RecordingSettings, project: Project) -> Path:
    """The calibration that recording.yaml names, else the only one that there is."""
    if settings.calibration is not None:
        named = named_calibration(path, settings.calibration, project)
        if not named.is_file():
            raise InputError(f"{SETTINGS.of(path)}: calibration: there is no file {named}; correct the name")
        return named
    found = calibrations_of(path, project)
    if not found:
        add = "add calibration.toml, or a calibration of another program (README, Formats)"
        raise InputError(f"{path}: holds no calibration file; {folder_around(path) or add}")
    if len(found) > 1:
        names = ", ".join(file.name for file in found)
        raise InputError(f"{path}: holds several calibrations ({names}); name one as `calibration:` in recording.yaml")
    return found[0]


def _check_by_camera(path: Path, settings: RecordingSettings, calibrated: CameraRig) -> None:
    for key, by_camera in settings.by_camera.items():
        strange = next((camera for camera in by_camera if camera not in calibrated.names), None)
        if strange is not None:
            raise InputError(
                f"{SETTINGS.of(path)}: {key}: there is no camera {strange!r} in the calibration; "
                f"its cameras are: {', '.join(calibrated.names)}"
            )


def _sized(rig: CameraRig, sources: dict[str, Path]) -> tuple[CameraRig, dict[str, SourceInfo]]:
    """The cameras with the sizes of their pictures, which are those of the calibration, and what the files say."""
    with ThreadPoolExecutor() as pool:
        infos = dict(zip(sources, pool.map(look_at_source, sources.values()), strict=True))
    rig = rig.with_sizes({camera: info.size for camera, info in infos.items()})
    for camera, source in sources.items():
        check_size(source, infos[camera].size, rig, camera)
    return rig, infos


def _missing(
    settings: RecordingSettings, timed: dict[str, TimedImages], offsets: dict[str, int]
) -> dict[str, tuple[tuple[int, int], ...]]:
    """What recording.yaml leaves out and, where cameras may be missing, frames whose own image was lost."""
    missing = {camera: settings.missing[camera] for camera in offsets if camera in settings.missing}
    if settings.fewest_cameras is not None:
        for camera, images in timed.items():
            lost = tuple((frame - offsets[camera], frame - offsets[camera]) for frame in images.lost)
            missing |= {camera: missing.get(camera, ()) + lost} if lost else {}
    return missing


def _scheme(path: Path, named: str | None) -> str | None:
    """The scheme that recording.yaml names, a file beside it by its path."""
    return str(path / named) if named is not None and (path / named).is_file() else named


def _doubts(path: Path, given: RecordingSettings, rig: CameraRig, project: Project) -> list[str]:
    """Sentences on what may be wrong with the world; `given` are the settings of recording.yaml alone."""
    doubts = [project.doubt] if given.up is None and project.doubt else []
    distances = np.linalg.norm(np.asarray(rig.cameras.camera_from_world)[:, :3, 3], axis=-1)
    if distances.max() > 100.0:  # metres, at which a camera's place is suspected to be in other units
        doubts.append(
            f"{path}: camera {rig.names[int(distances.argmax())]!r} stands {distances.max():.0f} m "
            "from the origin; if the calibration is in millimetres, write `unit: mm` into recording.yaml"
        )
    return doubts
