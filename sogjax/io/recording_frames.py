"""Which frames a recording has: its rate, the images of each frame, and the frames that enough cameras have."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError, counted
from sogjax.io.projects import Project
from sogjax.io.recording_files import SETTINGS
from sogjax.io.recording_settings import RecordingSettings
from sogjax.io.source import SourceInfo
from sogjax.io.video_file import frame_times


@dataclass(frozen=True)
class TimedImages:
    """The images of a camera's frames, taken by their time stamps."""

    picked: tuple[int, ...]
    """The image of the file that each frame is."""
    lost: tuple[int, ...]
    """The frames whose own image is not in the file."""


@dataclass(frozen=True)
class ClipFrames:
    """The frames of a recording."""

    fps: float
    numbers: range
    num_images: dict[str, int]
    """How many frames each camera has, after its images were taken by their time stamps."""
    timed: dict[str, TimedImages]
    """The images of the cameras of which they are taken by their time stamps."""
    warnings: tuple[str, ...]


def clip_frames(
    path: Path,
    settings: RecordingSettings,
    project: Project,
    sources: dict[str, Path],
    infos: dict[str, SourceInfo],
    offsets: dict[str, int],
) -> ClipFrames:
    """The frames that enough cameras have, and that recording.yaml or the project asks for.

    Raises:
        InputError: the rate is not known, a video's times do not suit it, or there are no such frames.
    """
    fps = _frame_rate(path, settings, infos)
    timed = _images_by_time(sources, infos, fps) if settings.time_stamps else {}
    counts = {name: len(timed[name].picked) if name in timed else info.num_frames for name, info in infos.items()}
    settings = project.within(settings, min(counts[camera] - offsets[camera] for camera in counts))
    first, last, warnings = _frames_in_common(path, settings, counts, offsets)
    return ClipFrames(fps, range(first, last + 1), counts, timed, warnings)


def _frame_rate(path: Path, settings: RecordingSettings, infos: dict[str, SourceInfo]) -> float:
    """The frames per second: those of recording.yaml, else of the videos' headers."""
    tolerance = 5e-4  # relative difference that is taken for rounding (29.97 and 30 differ by 1e-3)
    if settings.fps is not None:
        return settings.fps
    rates = {camera: info.fps for camera, info in infos.items() if info.fps is not None and info.fps > 0}
    if not rates:
        raise InputError(f"{path}: images do not say their frame rate; write `fps:` into recording.yaml")
    slow, fast = min(rates, key=rates.__getitem__), max(rates, key=rates.__getitem__)
    if rates[fast] - rates[slow] > tolerance * rates[fast]:
        raise InputError(
            f"{path}: the videos differ in frame rate ({slow} {rates[slow]:g}, {fast} {rates[fast]:g}); "
            + (
                "write the one to track at as `fps:` into recording.yaml"
                if settings.time_stamps
                else "convert them to one, or write `fps:` into recording.yaml if only the files' headers are wrong"
            )
        )
    return float(np.median(list(rates.values())))


def _images_by_time(sources: dict[str, Path], infos: dict[str, SourceInfo], fps: float) -> dict[str, TimedImages]:
    """The images of the cameras that have a video: folders of images have no times."""
    found = {}
    for camera, info in infos.items():
        if not sources[camera].is_dir():
            times = frame_times(sources[camera]) if info.times is None else info.times
            try:
                found[camera] = timed_images(times, fps)
            except ValueError as error:
                where = int(np.argmax(np.diff(times))) if len(times) > 1 else 0
                raise InputError(
                    f"{sources[camera]}: {error}; its longest pause comes after image {where}; correct `fps:`, convert "
                    "the video again, or leave `time_stamps:` out of recording.yaml"
                ) from error
    return found


def timed_images(times: Float[np.ndarray, "image"], fps: float) -> TimedImages:
    """The images of the frames of a fixed rate: for each, counted from the first image, the image nearest in time.

    `times` of the images are in seconds and ascend. Phones and cameras that drop images write videos of varying rate:
    if counted, their images drift away from the others'.

    Raises:
        ValueError: no images, or on average over 50 frames an image, so that a time or the rate is wrong.
    """
    if not len(times) or (times[-1] - times[0]) * fps > 50 * len(times):
        raise ValueError(f"{len(times)} images do not make a video of {fps:g} frames per second")
    wanted = times[0] + np.arange(int((times[-1] - times[0]) * fps + 0.5) + 1) / fps
    after = np.searchsorted(times, wanted).clip(0, len(times) - 1)
    before = (after - 1).clip(0)
    picked = np.where(wanted - times[before] <= times[after] - wanted, before, after)
    # In a video of even images of any rate none lies this far, in frames, from the time it stands for.
    lost = np.flatnonzero(np.abs(times[picked] - wanted) * fps > 0.75)
    return TimedImages(tuple(picked.tolist()), tuple(lost.tolist()))


def _frames_in_common(
    path: Path, settings: RecordingSettings, counts: dict[str, int], offsets: dict[str, int]
) -> tuple[int, int, tuple[str, ...]]:
    """First and last frame that enough cameras have and the settings ask for, and warnings."""
    needed = min(settings.fewest_cameras or len(counts), len(counts))
    ends = {camera: counts[camera] - offsets[camera] for camera in counts}
    earliest = max(0, sorted(-offset for offset in offsets.values())[needed - 1])
    latest = sorted(ends.values(), reverse=True)[needed - 1] - 1
    lengths = ", ".join(f"{camera} {count}" for camera, count in counts.items())
    if latest < earliest:
        raise InputError(
            f"{path}: the videos have no frame in common (frames: {lengths}); correct `frame_offset:` or the videos"
        )
    first, last = settings.first_frame, settings.last_frame
    for key, frame in (("first_frame", first), ("last_frame", last)):
        if frame is not None and not earliest <= frame <= latest:
            raise InputError(
                f"{SETTINGS.of(path)}: {key}: {frame} is out of range; "
                f"the frames of {'all' if needed == len(counts) else 'at least'} {counted(needed, 'camera')} are "
                f"{earliest} to {latest}"
            )
    first, last = earliest if first is None else first, latest if last is None else last
    if last < first:
        raise InputError(f"{SETTINGS.of(path)}: last_frame: {last} is before first_frame {first}; swap them")
    used = f"frames {first} to {last} are used"
    if settings.fewest_cameras is not None:
        spans = {camera: (max(first, -offsets[camera]), min(last, ends[camera] - 1)) for camera in counts}
        partly = ", ".join(f"{c} {a} to {b}" for c, (a, b) in spans.items() if (a, b) != (first, last))
        warnings = (f"{path}: {used}, of which some cameras have only a part ({partly})",) if partly else ()
    else:
        differ = settings.last_frame is None and len(set(ends.values())) > 1
        warnings = (f"{path}: the videos differ in length (frames: {lengths}); {used}",) if differ else ()
    return first, last, warnings


def uneven(
    sources: dict[str, Path], infos: dict[str, SourceInfo], timed: dict[str, TimedImages], fewest: int | None
) -> list[str]:
    """Sentences on videos whose images do not come at one rate; `fewest` is `fewest_cameras` of recording.yaml."""
    longest = 1.5  # time between two images, in units of the usual one, beyond which they are unevenly spaced
    done = "the camera is missing there" if fewest is not None else "the nearest one is taken"
    by_number = [
        f"{sources[camera]}: its images are unevenly spaced (pauses of up to {info.longest_gap:.1f} times the usual "
        "one): the frame rate varies or images were dropped, and each image counts as one frame; write "
        "`time_stamps: true` into recording.yaml to use their times"
        for camera, info in infos.items()
        if camera not in timed and info.longest_gap > longest
    ]
    return by_number + [
        f"{sources[camera]}: has no image for {len(images.lost)} of its {counted(len(images.picked), 'frame')} by its "
        f"time stamps; {done}"
        for camera, images in timed.items()
        if images.lost
    ]
