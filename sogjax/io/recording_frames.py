"""Which frames a recording has: its rate, the images of each frame, and the frames that enough cameras have."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sogjax.errors import InputError, counted
from sogjax.io.image_folder import frames_without_image, picked_images
from sogjax.io.recording_settings import RecordingSettings
from sogjax.io.source import SourceInfo
from sogjax.io.video_file import frame_times

FPS_TOLERANCE = 5e-4
"""Relative difference of two videos' frame rates that is taken for rounding (29.97 and 30 differ by 1e-3)."""

LONGEST_GAP = 1.5
"""Time between two images, in units of the usual one, beyond which the images are unevenly spaced."""


@dataclass(frozen=True)
class TimedImages:
    """The images of a camera's frames, taken by their time stamps."""

    picked: tuple[int, ...]
    """Of the file, for each frame."""
    lost: tuple[int, ...]
    """Frames whose own image is not in the file."""


def images_by_time(sources: dict[str, Path], infos: dict[str, SourceInfo], fps: float) -> dict[str, TimedImages]:
    """By camera that has a video. Folders of images have no times.

    Raises:
        InputError: a video cannot be read, or its times do not suit the rate.
    """
    found = {}
    for camera, info in infos.items():
        if not sources[camera].is_dir():
            times = frame_times(sources[camera]) if info.times is None else info.times
            try:
                picked = picked_images(times, fps)
            except ValueError as error:
                where = int(np.argmax(np.diff(times))) if len(times) > 1 else 0
                raise InputError(
                    f"{sources[camera]}: {error}; its longest pause comes after image {where}; correct `fps:`, convert "
                    "the video again, or leave `time_stamps:` out of recording.yaml"
                ) from error
            lost = np.flatnonzero(frames_without_image(times, fps, picked))
            found[camera] = TimedImages(tuple(picked.tolist()), tuple(lost.tolist()))
    return found


def frame_rate(path: Path, settings: RecordingSettings, infos: dict[str, SourceInfo]) -> float:
    """Frames per second: from recording.yaml, else from the videos' headers.

    Raises:
        InputError: the headers differ, or there are none.
    """
    if settings.fps is not None:
        return settings.fps
    rates = {camera: info.fps for camera, info in infos.items() if info.fps is not None and info.fps > 0}
    if not rates:
        raise InputError(f"{path}: images do not say their frame rate; write `fps:` into recording.yaml")
    slow, fast = min(rates, key=rates.__getitem__), max(rates, key=rates.__getitem__)
    if rates[fast] - rates[slow] > FPS_TOLERANCE * rates[fast]:
        raise InputError(
            f"{path}: the videos differ in frame rate ({slow} {rates[slow]:g}, {fast} {rates[fast]:g}); "
            + (
                "write the one to track at as `fps:` into recording.yaml"
                if settings.time_stamps
                else "convert them to one, or write `fps:` into recording.yaml if only the files' headers are wrong"
            )
        )
    return float(np.median(list(rates.values())))


def frames_in_common(
    path: Path, settings: RecordingSettings, counts: dict[str, int], offsets: dict[str, int]
) -> tuple[int, int, tuple[str, ...]]:
    """First frame and number of frames that enough cameras have and recording.yaml asks for, and warnings.

    Raises:
        InputError: there is none, or recording.yaml asks for others.
    """
    needed = min(settings.fewest_cameras or len(counts), len(counts))
    ends = {camera: counts[camera] - offsets[camera] for camera in counts}
    earliest = max(0, sorted(-offset for offset in offsets.values())[needed - 1])
    latest = sorted(ends.values(), reverse=True)[needed - 1] - 1
    if latest < earliest:
        lengths = ", ".join(f"{camera} {count}" for camera, count in counts.items())
        raise InputError(
            f"{path}: the videos have no frame in common (frames: {lengths}); correct `frame_offset:` or the videos"
        )
    first, last = settings.first_frame, settings.last_frame
    for key, frame in (("first_frame", first), ("last_frame", last)):
        if frame is not None and not earliest <= frame <= latest:
            raise InputError(
                f"{path / 'recording.yaml'}: {key}: {frame} is out of range; "
                f"the frames of {'all' if needed == len(counts) else 'at least'} {counted(needed, 'camera')} are "
                f"{earliest} to {latest}"
            )
    first, last = earliest if first is None else first, latest if last is None else last
    if last < first:
        raise InputError(f"{path / 'recording.yaml'}: last_frame: {last} is before first_frame {first}; swap them")
    warnings = ()
    if settings.fewest_cameras is not None:
        spans = {camera: (max(first, -offsets[camera]), min(last, ends[camera] - 1)) for camera in counts}
        partly = ", ".join(f"{c} {a} to {b}" for c, (a, b) in spans.items() if (a, b) != (first, last))
        if partly:
            warnings = (
                f"{path}: frames {first} to {last} are used, of which some cameras have only a part ({partly})",
            )
    elif settings.last_frame is None and len(set(ends.values())) > 1:
        lengths = ", ".join(f"{camera} {count}" for camera, count in counts.items())
        warnings = (f"{path}: the videos differ in length (frames: {lengths}); frames {first} to {last} are used",)
    return first, last - first + 1, warnings


def uneven(
    sources: dict[str, Path], infos: dict[str, SourceInfo], timed: dict[str, TimedImages], fewest: int | None
) -> list[str]:
    """Sentences on videos whose images do not come at one rate; `fewest` is `fewest_cameras` of recording.yaml."""
    done = "the camera is missing there" if fewest is not None else "the nearest one is taken"
    by_number = [
        f"{sources[camera]}: its images are unevenly spaced (pauses of up to {info.longest_gap:.1f} times the usual "
        "one): the frame rate varies or images were dropped, and each image counts as one frame; write "
        "`time_stamps: true` into recording.yaml to use their times"
        for camera, info in infos.items()
        if camera not in timed and info.longest_gap > LONGEST_GAP
    ]
    return by_number + [
        f"{sources[camera]}: has no image for {len(images.lost)} of its {counted(len(images.picked), 'frame')} by its "
        f"time stamps; {done}"
        for camera, images in timed.items()
        if images.lost
    ]
