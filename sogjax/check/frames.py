"""Numbers of frames, frame rates, and frames that were dropped or repeated."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float

from sogjax.check.findings import Finding
from sogjax.check.pictures import Clip
from sogjax.check.synchronisation import Jump
from sogjax.errors import counted, listed
from sogjax.io.recording import Recording
from sogjax.io.source import SourceInfo, look_at_source


@dataclass(frozen=True)
class SourceFrames:
    """What the file of one camera says about its frames."""

    info: SourceInfo
    gaps: tuple[int, ...]
    """Frames of the file after which others are missing: the pause is 1.5 times as long as the median."""
    uneven: bool
    """Whether its rate varies: a quarter of the pauses differ from the median by more than a fifth."""


def source_frames(recording: Recording) -> dict[str, SourceFrames]:
    """What the file of each camera says about its frames."""
    with ThreadPoolExecutor() as pool:
        found = pool.map(lambda name: _source_frames(recording, name), recording.rig.names)
        return dict(zip(recording.rig.names, found, strict=True))


def _source_frames(recording: Recording, name: str) -> SourceFrames:
    info = look_at_source(recording.sources[name])
    times = info.times
    if times is None or len(times) < 4:
        return SourceFrames(info, (), False)
    pauses = np.diff(times)
    usual = max(float(np.median(pauses)), 1e-9)
    gaps = tuple(int(k) for k in np.flatnonzero(pauses > 1.5 * usual))
    uneven = float(np.percentile(np.abs(pauses - usual), 75)) > 0.2 * usual
    return SourceFrames(info, gaps, uneven)


def source_findings(recording: Recording, sources: dict[str, SourceFrames]) -> list[Finding]:
    """What the files say about numbers of frames, rates and missing frames."""
    counts = {name: source.info.num_frames for name, source in sources.items()}
    findings = []
    if len(set(counts.values())) > 1:
        shown = listed((f"{name} {count}" for name, count in counts.items()), 12)
        cause = "cameras that started or stopped at different times, or lost frames"
        remedy = "look at the findings on synchronisation; set first_frame and last_frame to the frames that all have"
        findings.append(
            Finding("note", "frames", f"the cameras have different numbers of frames: {shown}", cause, remedy)
        )
    for name, source in sources.items():
        if source.uneven:
            what = f"the time stamps of {name} are uneven"
            remedy = "write `time_stamps: true` into recording.yaml, or record at a constant rate"
            findings.append(Finding("warning", "frames", what, "a variable frame rate, as of phones", remedy, (name,)))
        elif source.gaps:
            what = f"{name} lacks frames according to its time stamps, after frame {_places(source.gaps)}"
            cause, remedy = "frames dropped while recording", "write `time_stamps: true` into recording.yaml"
            findings.append(Finding("warning", "frames", what, cause, remedy, (name,)))
    if not findings:
        frames, cameras = counted(recording.num_frames, "frame"), counted(len(sources), "camera")
        findings.append(Finding("ok", "frames", f"{frames} of {cameras} at {recording.fps:g} per second"))
    return findings


def repeated_frames(clip: Clip) -> dict[int, list[int]]:
    """The frames of each camera that repeat the one before, while those of most other cameras do not.

    They count as the same below 5 % of the difference that is usual in that video, and as others above 30 %.
    """
    shares = np.stack([_shares(grey, present) for grey, present in zip(clip.grey, clip.present, strict=True)])
    found = {}
    for camera in range(len(shares)):
        others = np.delete(shares, camera, axis=0)
        moving = _median(others) > 0.3 if len(others) else np.ones(shares.shape[1], bool)
        twice = np.flatnonzero((shares[camera] < 0.05) & moving) + 1
        if len(twice):
            found[camera] = [int(k) for k in twice]
    return found


def _shares(grey: np.ndarray, present: Bool[np.ndarray, "frame"]) -> Float[np.ndarray, "step"]:
    """How much each frame differs from the one before, in units of the median; NaN where one of them is missing.

    It is 1 where frames hardly differ at all, so that nothing can be determined.
    """
    steps = np.array([float(np.abs(b.astype(np.int16) - a).mean()) for a, b in pairwise(grey)])
    seen = present[1:] & present[:-1]
    usual = float(np.median(steps[seen])) if seen.any() else 0.0
    return np.where(seen, steps / usual if usual > 0.02 else 1.0, np.nan)


def _median(shares: Float[np.ndarray, "camera step"]) -> Float[np.ndarray, "step"]:
    """The median over the cameras that are not missing; 0 where all are."""
    seen = ~np.isnan(shares)
    return np.nanmedian(np.where(seen.any(axis=0), shares, 0.0), axis=0)


def clip_findings(clip: Clip, repeated: dict[int, list[int]]) -> list[Finding]:
    """Cameras that have no picture in some of the frames, where they are not compared, and frames that are repeated."""
    missing = (~clip.present).sum(axis=1)
    absent = {name: count for name, count in zip(clip.recording.rig.names, missing, strict=True) if count}
    findings = []
    if absent:
        shown = listed(f"{name} in {count}" for name, count in absent.items())
        what = f"cameras are missing in some of the {counted(clip.num_frames, 'frame')} looked at: {shown}"
        cause = "a late start, an early end, or what recording.yaml leaves out"
        remedy = "look at other frames with start=, if this is not intended"
        findings.append(Finding("note", "frames", what, cause, remedy, tuple(absent)))
    for camera, frames in repeated.items():
        name = clip.recording.rig.names[camera]
        what = f"{name} shows the same picture twice, at frame {_places([clip.frame_number(k) for k in frames])}"
        cause = "a lost frame that was replaced by the one before, or a converted frame rate"
        remedy = "copy the original files again without conversion, or track the stretches between"
        findings.append(Finding("warning", "frames", what, cause, remedy, (name,)))
    return findings


def jump_findings(clip: Clip, jumps: dict[int, Jump]) -> list[Finding]:
    """Cameras whose time jumps against the others'."""
    findings = []
    span = f"{clip.frame_number(0)} and {clip.frame_number(clip.num_frames - 1)}"
    for camera, jump in jumps.items():
        name = clip.recording.rig.names[camera]
        count = counted(abs(jump.frames), "frame")
        lost = jump.frames > 0
        what = f"{name} seems to have {'lost' if lost else 'gained'} {count} against the others between frames {span}"
        cause = "a frame dropped while recording or copying" if lost else "a frame that was repeated"
        remedy = "track the stretches before and after separately, each with its own frame_offset, or record again"
        findings.append(Finding("note", "frames", what, cause, remedy, (name,)))
    return findings


def _places(numbers: Sequence[int]) -> str:
    return listed((str(number) for number in numbers), 5)
