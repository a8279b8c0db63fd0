"""A recording: a folder with synchronised videos, their calibration, and what else is known of them."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sogjax.data.calibration import CameraRig, find_calibrations, load_calibration
from sogjax.data.color_gains import ColorGains
from sogjax.data.ground_truth import load_ground_truth
from sogjax.data.initial_pose import read_initial_poses
from sogjax.data.recording_settings import RecordingSettings, read_recording_settings
from sogjax.data.source import SourceInfo, find_sources, look_at_source
from sogjax.data.stills import ExamplePose, check_size, find_background, find_example_poses
from sogjax.errors import InputError

__all__ = ["ExamplePose", "Recording", "open_recording"]

FPS_TOLERANCE = 5e-4
"""Relative difference of two videos' frame rates that is taken for rounding (29.97 and 30 differ by 1e-3)."""

LONGEST_GAP = 1.5
"""Time between two images, in units of the usual one, beyond which the images do not come evenly."""

FAR_CAMERA = 100.0
"""Metres from the origin at which a camera's place is suspected to be in other units."""

DEFAULT_UP = "z"


@dataclass(frozen=True)
class Recording:
    """A recording whose files were looked at and fit together; images are read by `sogjax.data.video`."""

    path: Path
    name: str
    rig: CameraRig
    fps: float
    up: str
    """The world's vertical, one of `sogjax.model.frames.UP_AXES`."""
    first_frame: int
    """Frame t of a camera is frame t + frame_offset of its file."""
    num_frames: int
    sources: dict[str, Path]
    """By camera: a video, or a folder of images."""
    frame_offset: dict[str, int]
    """By camera, 0 where the recording names none."""
    background: dict[str, Path]
    """By camera: the empty scene, where there is such an image."""
    example_poses: tuple[ExamplePose, ...]
    initial_poses: Path | None
    ground_truth: Path | None
    warnings: tuple[str, ...]
    """One sentence each."""
    num_images: dict[str, int] = field(default_factory=dict)
    """By camera the number of its images; a camera without an entry has one for every frame."""
    missing: dict[str, tuple[tuple[int, int], ...]] = field(default_factory=dict)
    """By camera the first and last frame (its own numbers) of each while in which its pictures are not to be used."""
    color_gains: dict[str, ColorGains] = field(default_factory=dict)
    """By camera what its pictures are multiplied by; they are as recorded where there is no entry."""
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


def open_recording(path: Path) -> Recording:
    """The recording in the folder `path`, everything in it looked at.

    Raises:
        InputError: something is missing, unreadable, or does not fit together.
    """
    if not path.is_dir():
        raise InputError(f"{path}: there is no such folder; give the folder of a recording")
    settings = read_recording_settings(path / "recording.yaml")
    calibration = _calibration(path, settings)
    calibrated = load_calibration(calibration, settings.unit)
    sources = find_sources(path)
    cameras = _cameras(path, calibration, settings, calibrated.names, tuple(sources))
    rig = calibrated.select(cameras)
    sources = {camera: sources[camera] for camera in cameras}
    for key, by_camera in settings.by_camera.items():
        strange = next((camera for camera in by_camera if camera not in calibrated.names), None)
        if strange is not None:
            raise InputError(
                f"{path / 'recording.yaml'}: {key}: there is no camera {strange!r} in the calibration; "
                f"its cameras are: {', '.join(calibrated.names)}"
            )
    offsets = {camera: settings.frame_offset.get(camera, 0) for camera in cameras}
    with ThreadPoolExecutor() as pool:
        infos = dict(zip(cameras, pool.map(look_at_source, sources.values()), strict=True))
    rig = rig.with_sizes({camera: info.size for camera, info in infos.items()})
    for camera in cameras:
        check_size(sources[camera], infos[camera].size, rig, camera)
    first, count, warnings = _frames(path, settings, infos, offsets)
    return Recording(
        path=path,
        name=path.resolve().name,
        rig=rig,
        fps=_fps(path, settings, infos),
        up=settings.up or DEFAULT_UP,
        first_frame=first,
        num_frames=count,
        sources=sources,
        frame_offset=offsets,
        background=find_background(path / "background", rig, calibrated.names),
        example_poses=find_example_poses(path / "example_poses", rig, calibrated.names, settings.example_poses),
        initial_poses=_initial_poses(path / "initial_pose.yaml"),
        ground_truth=_ground_truth(path / "ground_truth.npz"),
        warnings=(*warnings, *_doubts(path, settings, rig), *_uneven(sources, infos)),
        num_images={camera: infos[camera].num_frames for camera in cameras},
        missing={camera: settings.missing[camera] for camera in cameras if camera in settings.missing},
        color_gains={camera: settings.color_gains[camera] for camera in cameras if camera in settings.color_gains},
        fewest_cameras=settings.fewest_cameras,
    )


def _calibration(path: Path, settings: RecordingSettings) -> Path:
    if settings.calibration is not None:
        named = path / settings.calibration
        if not named.is_file():
            raise InputError(f"{path / 'recording.yaml'}: calibration: there is no file {named}; correct the name")
        return named
    found = find_calibrations(path)
    if not found:
        raise InputError(f"{path}: holds no calibration file; add calibration.toml")
    if len(found) > 1:
        names = ", ".join(file.name for file in found)
        raise InputError(f"{path}: holds several calibrations ({names}); name one as `calibration:` in recording.yaml")
    return found[0]


def _cameras(
    path: Path,
    calibration: Path,
    settings: RecordingSettings,
    calibrated: tuple[str, ...],
    filmed: tuple[str, ...],
) -> tuple[str, ...]:
    """The cameras to use: those that recording.yaml names, else all, which then must all be whole."""
    wanted = settings.cameras or tuple(dict.fromkeys(calibrated + filmed))
    otherwise = "" if settings.cameras else ", or list the cameras to use as `cameras:` in recording.yaml"
    for camera in wanted:
        if camera not in calibrated:
            raise InputError(
                f"{calibration}: has no camera {camera!r}, only: {', '.join(calibrated)}; calibrate it{otherwise}"
            )
        if camera not in filmed:
            raise InputError(
                f"{path}: has no video of the camera {camera!r}, only of: {', '.join(sorted(filmed))}; "
                f"add videos/{camera}.mp4{otherwise}"
            )
    return wanted


def _fps(path: Path, settings: RecordingSettings, infos: dict[str, SourceInfo]) -> float:
    if settings.fps is not None:
        return settings.fps
    rates = {camera: info.fps for camera, info in infos.items() if info.fps is not None and info.fps > 0}
    if not rates:
        raise InputError(f"{path}: images do not say their frame rate; write `fps:` into recording.yaml")
    slow, fast = min(rates, key=rates.__getitem__), max(rates, key=rates.__getitem__)
    if rates[fast] - rates[slow] > FPS_TOLERANCE * rates[fast]:
        raise InputError(
            f"{path}: the videos differ in frame rate ({slow} {rates[slow]:g}, {fast} {rates[fast]:g}); "
            "convert them to one, or write `fps:` into recording.yaml if only the files' headers are wrong"
        )
    return float(np.median(list(rates.values())))


def _frames(
    path: Path, settings: RecordingSettings, infos: dict[str, SourceInfo], offsets: dict[str, int]
) -> tuple[int, int, tuple[str, ...]]:
    """First frame and number of frames that enough cameras have and recording.yaml asks for, and warnings."""
    needed = min(settings.fewest_cameras or len(infos), len(infos))
    ends = {camera: infos[camera].num_frames - offsets[camera] for camera in infos}
    earliest = max(0, sorted(-offset for offset in offsets.values())[needed - 1])
    latest = sorted(ends.values(), reverse=True)[needed - 1] - 1
    if latest < earliest:
        lengths = ", ".join(f"{camera} {info.num_frames}" for camera, info in infos.items())
        raise InputError(
            f"{path}: the videos have no frame in common ({lengths} frames); correct `frame_offset:` or the videos"
        )
    first, last = settings.first_frame, settings.last_frame
    for key, frame in (("first_frame", first), ("last_frame", last)):
        if frame is not None and not earliest <= frame <= latest:
            raise InputError(
                f"{path / 'recording.yaml'}: {key}: {frame} is out of range; "
                f"the frames that {'all' if needed == len(infos) else needed} cameras have are {earliest} to {latest}"
            )
    first, last = earliest if first is None else first, latest if last is None else last
    if last < first:
        raise InputError(f"{path / 'recording.yaml'}: last_frame: {last} is before first_frame {first}; swap them")
    warnings = ()
    if settings.fewest_cameras is not None:
        spans = {camera: (max(first, -offsets[camera]), min(last, ends[camera] - 1)) for camera in infos}
        partly = ", ".join(f"{c} {a} to {b}" for c, (a, b) in spans.items() if (a, b) != (first, last))
        if partly:
            warnings = (
                f"{path}: frames {first} to {last} are used, of which some cameras have a part only ({partly})",
            )
    elif settings.last_frame is None and len(set(ends.values())) > 1:
        lengths = ", ".join(f"{camera} {info.num_frames}" for camera, info in infos.items())
        warnings = (f"{path}: the videos differ in length ({lengths} frames); frames {first} to {last} are used",)
    return first, last - first + 1, warnings


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


def _uneven(sources: dict[str, Path], infos: dict[str, SourceInfo]) -> list[str]:
    """Sentences on videos whose images do not come at one rate."""
    return [
        f"{sources[camera]}: its images do not come evenly (up to {info.longest_gap:.1f} times the usual time lies "
        "between two): the frame rate varies or images were dropped, and each counts as one frame; convert it to a "
        "constant rate"
        for camera, info in infos.items()
        if info.longest_gap > LONGEST_GAP
    ]


def _doubts(path: Path, settings: RecordingSettings, rig: CameraRig) -> tuple[str, ...]:
    """Sentences on what is not wrong for sure."""
    doubts = []
    if settings.up is None:
        doubts.append(f"{path}: says nothing of the vertical; {DEFAULT_UP} is taken (`up:` in recording.yaml)")
    distances = np.linalg.norm(np.asarray(rig.cameras.camera_from_world)[:, :3, 3], axis=-1)
    if distances.max() > FAR_CAMERA:
        doubts.append(
            f"{path}: camera {rig.names[int(distances.argmax())]!r} stands {distances.max():.0f} m "
            "from the origin; if the calibration is in millimetres, write `unit: mm` into recording.yaml"
        )
    return tuple(doubts)
