"""Cameras by their names: which of two lists mean the same ones, and which of a recording are used."""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from sogjax.errors import InputError


def matched_names(wanted: Iterable[str], found: Iterable[str]) -> dict[str, str]:
    """For each name of `wanted` the one of `found` that is the same, or holds it or is held by it as whole words.

    Words are runs of letters and numbers without leading zeros: `cam_01` is `Cam1` and a part of `int_cam01_img`, but
    no part of `cam_010`. A name that could mean two others means none.
    """
    wanted, found = [*dict.fromkeys(wanted)], [*dict.fromkeys(found)]
    same = {name: name for name in wanted if name in found}
    words = {name: _words(name) for name in (*wanted, *found)}
    for alike in (lambda a, b: a == b, lambda a, b: _holds(a, b) or _holds(b, a)):
        left = [name for name in wanted if name not in same]
        free = [name for name in found if name not in same.values()]
        pairs = [(a, b) for a in left for b in free if words[a] and words[b] and alike(words[a], words[b])]
        for a, b in pairs:
            if sum(a == first for first, _ in pairs) == 1 and sum(b == second for _, second in pairs) == 1:
                same[a] = b
    return same


def _words(name: str) -> list[str]:
    found = re.findall(r"[^\W\d_]+|[0-9]+", name.lower())
    return [word.lstrip("0") or "0" if word.isdigit() else word for word in found]


def _holds(words: list[str], part: list[str]) -> bool:
    return any(words[k : k + len(part)] == part for k in range(len(words) - len(part) + 1))


def chosen_cameras(
    path: Path,
    calibration: Path,
    listed: tuple[str, ...] | None,
    calibrated: tuple[str, ...],
    sources: Mapping[str, Path],
) -> tuple[str, ...]:
    """The cameras to use: those that are `listed` in recording.yaml, else all, which then must all be whole.

    Raises:
        InputError: a camera without calibration or without video.
    """
    wanted = listed or tuple(dict.fromkeys((*calibrated, *sources)))
    otherwise = "" if listed else ", or list the cameras to use as `cameras:` in recording.yaml"
    wrong = next((camera for camera in wanted if camera not in calibrated or camera not in sources), None)
    if wrong is None:
        return wanted
    _refuse_other_name(calibration, wanted, calibrated, sources, otherwise)
    if wrong not in calibrated:
        raise InputError(
            f"{calibration}: has no camera {wrong!r}, only: {', '.join(calibrated)}; calibrate it{otherwise}"
        )
    raise InputError(
        f"{path}: has no video of the camera {wrong!r}, only of: {', '.join(sorted(sources))}; "
        f"add videos/{wrong}.mp4{otherwise}"
    )


def _refuse_other_name(
    calibration: Path,
    wanted: tuple[str, ...],
    calibrated: tuple[str, ...],
    sources: Mapping[str, Path],
    otherwise: str,
) -> None:
    """Complain that one video and one camera left over are probably the same under two names."""
    videos = [source for camera, source in sources.items() if camera not in calibrated]
    cameras = [camera for camera in calibrated if camera in wanted and camera not in sources]
    if len(videos) != 1 or len(cameras) != 1:
        return
    video, camera = videos[0], cameras[0]
    new_name = camera if video.is_dir() else f"{camera}{video.suffix}"
    raise InputError(
        f"{video}: {calibration.name} has no camera of this name, and its camera {camera!r} has no video; rename "
        f"the video to {new_name} if it is that camera's{otherwise}"
    )
