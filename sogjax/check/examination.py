"""All checks of a recording, one after the other."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from sogjax.check.agreement import hulls_of
from sogjax.check.calibration import calibration_findings
from sogjax.check.cameras import RigGeometry, camera_findings, rig_geometry
from sogjax.check.clip import Clip, Progress, black_picture, read_clip
from sogjax.check.exposure import change_findings, exposure, exposure_findings
from sogjax.check.findings import Finding, worst_first
from sogjax.check.frames import (
    jump_findings,
    missing_findings,
    repeat_findings,
    repeated_frames,
    source_findings,
    source_frames,
)
from sogjax.check.hypotheses import unit_rig
from sogjax.check.keypoints import keypoint_findings
from sogjax.check.motion import motion_of, pair_barcodes, with_rig
from sogjax.check.scale import scale_findings, subject_size
from sogjax.check.silhouettes import (
    Moment,
    example_moments,
    place_findings,
    plates_of,
    references_of,
    video_moments,
    without_masks_of,
)
from sogjax.check.synchronisation import (
    FEWEST_STEPS,
    Jump,
    Synchrony,
    find_jumps,
    synchrony,
    synchrony_findings,
    too_short,
)
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.recording import Recording
from sogjax.io.recording_files import SETTINGS
from sogjax.io.recording_settings import read_recording_settings

STILL = 1e-3
"""Mean motion of a camera's pictures (roots of grey values) below which it sees no one move."""
FEWEST_MOVING = 2


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
    """By camera the whole `frame_offset` to be written, where any was found; else empty."""


def examined(recording: Recording, start: int, frames: int, largest_offset: int, progress: Progress) -> Examination:
    """Look at cameras, files, frames, synchrony, silhouettes, size and exposure of a recording.

    Args:
        recording: what to check.
        start: the first frame of the stretch that is read, counted from the recording's first.
        frames: its length at most.
        largest_offset: offsets between cameras are looked for up to so many frames.
        progress: wraps the frames while they are read.

    Raises:
        InputError: a video that ends early, or a picture that does not open.
    """
    rig, names = recording.rig, recording.rig.names
    geometry = rig_geometry(rig, recording.up)
    relative = unit_rig(rig, geometry.scale)
    findings = [Finding("note", "files", warning) for warning in recording.warnings]
    findings += camera_findings(rig, geometry, recording.up)
    sources = source_frames(recording)
    findings += source_findings(recording, sources)

    clip = read_clip(recording, start, frames, progress)
    repeated = repeated_frames(clip)
    findings += [*missing_findings(clip), *repeat_findings(clip, repeated)]
    found, jumps, told = _times(clip, relative, largest_offset)
    findings += told
    offsets = [0 if camera in jumps else found.of(camera) for camera in range(len(names))]

    photographed, filmed = example_moments(recording), video_moments(clip, offsets)
    references = references_of(plates_of(recording), photographed[0] if photographed else None)
    shown = {camera: picture for moment in reversed(filmed) for camera, picture in moment.pictures.items()}
    places = place_findings(names, references, shown)
    elsewhere = {names.index(name) for finding in places for name in finding.cameras}
    filmed = [without_masks_of(moment, elsewhere) for moment in filmed]
    findings += places
    findings += change_findings(names, {k: both for k, both in references.items() if k not in elsewhere}, shown)
    said, fits = calibration_findings(relative, photographed, filmed)
    findings += said
    good = [camera for camera in range(len(names)) if camera not in fits or not fits[camera].is_wrong]
    size = subject_size(hulls_of(relative, [*photographed, *filmed]), good, geometry.scale, recording.up)
    unit = read_recording_settings(SETTINGS.of(recording.path)).unit
    findings += scale_findings(size, geometry, unit)
    gains, told = _exposure(names, photographed, filmed)
    findings += told
    findings += keypoint_findings(recording, start, clip.num_frames)
    numbers = {
        "recording": str(recording.path),
        "up": recording.up,
        "fps": recording.fps,
        **geometry.numbers(),
        "num_frames": {name: source.info.num_frames for name, source in sources.items()},
        "looked_at_frames": [clip.frame_number(0), clip.frame_number(clip.num_frames - 1)],
        "repeated_frames": {names[k]: [clip.frame_number(i) for i in at] for k, at in repeated.items()},
        "synchronisation": _by_name(found),
        "silhouettes": {names[k]: asdict(fit) for k, fit in fits.items()},
        "subject": None if size is None else asdict(size),
        "gains_blue_green_red": gains,
        "findings": [asdict(finding) for finding in worst_first(findings)],
    }
    known = {name: recording.frame_offset[name] + recording.frame_part.get(name, 0.0) for name in names}
    total = {name: known[name] + offset for name, offset in zip(names, offsets, strict=True)}
    pictures = tuple(shown[k] if k in shown else black_picture(recording, k) for k in range(len(names)))
    return Examination(worst_first(findings), numbers, geometry, pictures, total if any(offsets) else {})


def _times(clip: Clip, relative: CameraRig, largest_offset: int) -> tuple[Synchrony, dict[int, Jump], list[Finding]]:
    """Offsets between the cameras, jumps in the time of one, and what both mean."""
    names, steps = clip.recording.rig.names, clip.num_frames - 1
    motions = with_rig(motion_of(clip), relative)
    moving = sum(motion.mean > STILL for motion in motions) >= FEWEST_MOVING
    codes = pair_barcodes(motions)
    found = synchrony(names, codes, steps, largest_offset)
    jumps = find_jumps(codes, steps, found)
    if steps < FEWEST_STEPS:
        return found, jumps, [too_short(clip.num_frames, clip.recording.num_frames)] if len(names) > 1 else []
    away = [camera for camera, motion in enumerate(motions) if motion.num_seen < FEWEST_STEPS]
    told = synchrony_findings(found, clip.recording.frame_offset, moving, jumps, away)
    return found, jumps, [*told, *jump_findings(clip, jumps)]


def _exposure(
    names: tuple[str, ...], photographed: Sequence[Moment], filmed: Sequence[Moment]
) -> tuple[dict[str, list[float | None]], list[Finding]]:
    """The gains of the cameras, blue, green and red, and what they mean.

    Example poses show the subject whole and in the middle; videos are compared with each camera's still pictures.
    """
    moments, label = (photographed, "example poses") if photographed else (filmed, "videos")
    found = exposure(moments, len(names))
    gains = [[None if np.isnan(gain) else round(float(gain), 4) for gain in row] for row in found.gains]
    return dict(zip(names, gains, strict=True)), exposure_findings(names, found, label)


def _by_name(found: Synchrony) -> dict[str, dict[str, Any]]:
    rows = zip(found.names, found.offsets, found.sure, found.alike, found.margins, strict=True)
    return {
        name: {"offset": int(offset), "sure": bool(sure), "alike": round(float(a), 4), "margin": round(float(m), 4)}
        for name, offset, sure, a, m in rows
    }
