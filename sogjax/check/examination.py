"""All checks of a recording, one after the other."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from sogjax.check.agreement import Misfit, hulls_of
from sogjax.check.appearance import (
    change_findings,
    exposure,
    exposure_findings,
    place_findings,
    plate_findings,
    references_of,
)
from sogjax.check.calibration import calibration_findings, unit_rig
from sogjax.check.cameras import RigGeometry, camera_findings, rig_geometry
from sogjax.check.findings import Finding, worst_first
from sogjax.check.frames import clip_findings, jump_findings, repeated_frames, source_findings, source_frames
from sogjax.check.keypoints import keypoint_findings
from sogjax.check.motion import motion_of, pair_barcodes
from sogjax.check.pictures import (
    Clip,
    Picture,
    Plates,
    Progress,
    example_moments,
    read_clip,
    read_plates,
    stills_in_step,
    video_moment,
    working_picture,
)
from sogjax.check.scale import SubjectSize, scale_findings, subject_size
from sogjax.check.synchronisation import (
    FEWEST_STEPS,
    Jump,
    Synchrony,
    find_jumps,
    synchrony,
    synchrony_findings,
    too_short,
)
from sogjax.errors import InputError
from sogjax.io.calibration.load import load_calibration
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.example_poses import check_size, find_background, find_example_poses, find_occluders
from sogjax.io.projects import Project, calibrations_of, named_as_sources, named_calibration, project_in
from sogjax.io.recording import Recording
from sogjax.io.recording_files import BACKGROUND, EXAMPLE_POSES, OCCLUDERS, RECORDING_FILES, SETTINGS
from sogjax.io.recording_settings import RecordingSettings, read_recording_settings
from sogjax.io.source import find_sources, look_at_source


@dataclass(frozen=True)
class Examination:
    """What was found."""

    findings: list[Finding]
    """The worst first."""
    numbers: dict[str, Any]
    """Everything that was measured, for JSON."""
    geometry: RigGeometry
    pictures: tuple[np.ndarray, ...]
    """One of each camera (BGR), to draw on."""
    offsets: dict[str, float]
    """The whole `frame_offset` of each camera to be written, where any was found; else empty."""


def examined(
    recording: Recording,
    start: int,
    frames: int,
    largest_offset: int,
    progress: Progress,
    subject: float | None = None,
) -> Examination:
    """Look at cameras, files, frames, synchrony, silhouettes, size and exposure of a recording.

    Args:
        recording: what to check.
        start: the first frame of the stretch that is read.
        frames: its length at most.
        largest_offset: offsets between cameras are looked for up to so many frames.
        progress: wraps the frames while they are read.
        subject: the extent of the body that is to be tracked, metres; None: a person, unless it is smaller.

    Raises:
        InputError: a video that ends early, or a picture that does not open.
    """
    rig, names = recording.rig, recording.rig.names
    geometry = rig_geometry(rig, recording.up)
    relative = unit_rig(rig, geometry.scale)
    sources = source_frames(recording)
    clip = read_clip(recording, start, frames, progress)
    repeated = repeated_frames(clip)
    found, jumps, of_times = _times(clip, relative, largest_offset)
    offsets = [0 if camera in jumps else found.of(camera) for camera in range(len(names))]
    stills = stills_in_step(clip, offsets)
    plates = read_plates(clip)
    seen = _looks(recording, relative, geometry, stills, plates, subject)
    findings = [
        *(Finding("note", "files", warning) for warning in recording.warnings),
        *camera_findings(rig, geometry, recording.up),
        *source_findings(recording, sources),
        *clip_findings(clip, repeated),
        *of_times,
        *seen.findings,
        *keypoint_findings(clip, plates.usable),
    ]
    numbers = {
        "recording": str(recording.path),
        "up": recording.up,
        "fps": recording.fps,
        **geometry.numbers(),
        "num_frames": {name: source.info.num_frames for name, source in sources.items()},
        "looked_at_frames": [clip.frame_number(0), clip.frame_number(clip.num_frames - 1)],
        "repeated_frames": {names[k]: [clip.frame_number(i) for i in at] for k, at in repeated.items()},
        "synchronisation": found.numbers(),
        "silhouettes": {names[k]: asdict(fit) for k, fit in seen.fits.items()},
        "subject": None if seen.size is None else asdict(seen.size),
        "gains_blue_green_red": seen.gains,
        "findings": [asdict(finding) for finding in worst_first(findings)],
    }
    known = [recording.frame_offset[name] + recording.frame_part.get(name, 0.0) for name in names]
    total = {name: before + more for name, before, more in zip(names, known, offsets, strict=True)}
    shown = _first_pictures(stills)
    pictures = tuple(shown[k] if k in shown else _black(rig, name) for k, name in enumerate(names))
    return Examination(worst_first(findings), numbers, geometry, pictures, total if any(offsets) else {})


def _times(clip: Clip, relative: CameraRig, largest_offset: int) -> tuple[Synchrony, dict[int, Jump], list[Finding]]:
    """Offsets between the cameras, jumps in the time of one, and what both mean."""
    names, steps = clip.recording.rig.names, clip.num_frames - 1
    motions = motion_of(clip, relative)
    codes = pair_barcodes(motions)
    found = synchrony(names, codes, steps, largest_offset)
    jumps = find_jumps(codes, steps, found)
    if steps < FEWEST_STEPS:
        return found, jumps, [too_short(clip.num_frames, clip.recording.num_frames)] if len(names) > 1 else []
    moving = sum(motion.mean > 1e-3 for motion in motions) >= 2  # roots of grey values: less is nobody who moves
    away = [camera for camera, motion in enumerate(motions) if motion.num_seen < FEWEST_STEPS]
    told = synchrony_findings(found, clip.recording.frame_offset, moving, jumps, away)
    return found, jumps, [*told, *jump_findings(clip, jumps)]


@dataclass(frozen=True)
class _Looks:
    """What single pictures show."""

    findings: list[Finding]
    fits: dict[int, Misfit]
    """How each camera's silhouette differs from the others'."""
    size: SubjectSize | None
    gains: dict[str, list[float | None]]
    """Blue, green and red in units of the median camera's."""


def _looks(
    recording: Recording,
    relative: CameraRig,
    geometry: RigGeometry,
    stills: Sequence[dict[int, Picture]],
    plates: Plates,
    subject: float | None,
) -> _Looks:
    """Compare example poses, backgrounds and stills of the videos with each other and with the calibration."""
    names = recording.rig.names
    photographed = example_moments(recording, plates.given)
    references, shown = references_of(plates.in_place, photographed), _first_pictures(stills)
    places = place_findings(names, references, shown)
    elsewhere = {names.index(name) for finding in places for name in finding.cameras}
    here = lambda by_camera: {camera: one for camera, one in by_camera.items() if camera not in elsewhere}
    filmed = [video_moment(pictures, here(plates.usable)) for pictures in stills]
    changes = change_findings(names, here(references), shown)
    agreement, fits = calibration_findings(relative, photographed, filmed)
    good = [camera for camera in range(len(names)) if camera not in fits or not fits[camera].is_wrong]
    size = subject_size(hulls_of(relative, [*photographed, *filmed]), good, geometry.scale, recording.up)
    unit = read_recording_settings(SETTINGS.of(recording.path)).unit
    # example poses show the subject whole and in the middle; videos are compared with each camera's still pictures
    compared = exposure(photographed or filmed, len(names))
    of_exposure = exposure_findings(names, compared, "example poses" if photographed else "videos")
    gains = [[None if np.isnan(gain) else round(float(gain), 4) for gain in row] for row in compared.gains]
    unlike = plate_findings(recording, here(plates.fitted))
    findings = [*places, *unlike, *changes, *agreement, *scale_findings(size, geometry, unit, subject), *of_exposure]
    return _Looks(findings, fits, size, dict(zip(names, gains, strict=True)))


def _first_pictures(stills: Sequence[dict[int, Picture]]) -> dict[int, Picture]:
    """The first still of each camera."""
    return {camera: picture for pictures in reversed(stills) for camera, picture in pictures.items()}


def _black(rig: CameraRig, name: str) -> Picture:
    """What stands for the picture of a camera that is missing."""
    width, height = rig.image_size(name)
    return working_picture(np.zeros((height, width, 3), np.uint8))


Value = TypeVar("Value")


def opening_problems(path: Path, first: InputError) -> list[Finding]:
    """One finding for each file that is wrong; `first` is what opening the recording complained of."""
    said: list[str] = []

    def tried(look: Callable[[], Value]) -> Value | None:
        try:
            return look()
        except InputError as error:
            said.extend({str(error)}.difference(said))
            return None

    settings = tried(lambda: read_recording_settings(SETTINGS.of(path))) or RecordingSettings()
    project = tried(lambda: project_in(path)) or Project()
    settings = project.filled_in(settings)
    sources = tried(lambda: find_sources(path)) or {}
    rig = tried(lambda: _rig(path, settings, project))
    rig = named_as_sources(rig, sources, project) if rig is not None else None
    infos = {camera: tried(lambda source=source: look_at_source(source)) for camera, source in sources.items()}
    sizes = {camera: info.size for camera, info in infos.items() if info is not None}
    if rig is not None:
        calibrated, sized = rig.names, _of_known_size(rig, sizes, settings.cameras)
        for camera in sized.names:
            if camera in sizes:
                tried(lambda camera=camera: check_size(sources[camera], sizes[camera], sized, camera))
        tried(lambda: find_background(BACKGROUND.of(path), sized, calibrated))
        tried(lambda: find_occluders(OCCLUDERS.of(path), sized, calibrated))
        tried(lambda: find_example_poses(EXAMPLE_POSES.of(path), sized, calibrated, settings.example_poses, None))
    for part in RECORDING_FILES:
        tried(lambda part=part: part.checked(path))
    if str(first) not in said:
        said.insert(0, str(first))
    return [_finding(sentence) for sentence in said]


def _rig(path: Path, settings: RecordingSettings, project: Project) -> CameraRig | None:
    """The cameras, where it is clear which calibration counts; the recording's own opening complains otherwise."""
    given = settings.calibration
    named = [named_calibration(path, given, project)] if given else calibrations_of(path, project)
    return load_calibration(named[0], settings.unit) if len(named) == 1 else None


def _of_known_size(rig: CameraRig, sizes: Mapping[str, tuple[int, int]], used: Sequence[str] | None) -> CameraRig:
    """The cameras that are used and whose pictures have a known size: by the calibration, else by their videos."""
    rig = rig.with_sizes(sizes)
    widths = np.asarray(rig.cameras.image_size)[:, 0]
    known = [name for name, width in zip(rig.names, widths, strict=True) if not np.isnan(width)]
    return rig.select([name for name in known if used is None or name in used])


def _finding(sentence: str) -> Finding:
    if "is not a rotation matrix (determinant -1" in sentence:
        cause = "a mirrored world: axes that changed between left-handed and right-handed"
        return Finding("error", "calibration", sentence, cause, "export the calibration for right-handed axes")
    return Finding("error", "files", sentence)
