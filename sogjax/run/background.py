"""Which background a run uses: photographs of the empty scene, else what the clip itself shows, else none."""

import json
from collections.abc import Sequence
from threading import Lock

from sogjax.errors import InputError
from sogjax.io.background_cache import Arrays, background_origin, kept_background
from sogjax.io.recording import Recording
from sogjax.io.source import fingerprint
from sogjax.io.video import read_still
from sogjax.run.clip_learning import PARTS, LeftOut, UnsuitableError, learn
from sogjax.run.terminal import say
from sogjax.scene.background import BackgroundCells, CameraBackground, stack_background
from sogjax.scene.cells import CellGrid
from sogjax.settings.method import ImagesConfig

CHOICES = ("auto", "pictures", "clip", "none")
MOST_MADE = 4
"""Backgrounds that a process remembers: those of twelve cameras take 30 MB."""
_made: dict[str, Arrays | str] = {}
MOST_CUT = 2
"""Backgrounds whose cells a process remembers, for the members of a sweep: those of twelve cameras take 3 MB."""
_cut: dict[str, BackgroundCells] = {}
_making, _cutting = Lock(), Lock()
_said: set[str] = set()


def background_cells(recording: Recording, grids: Sequence[CellGrid], images: ImagesConfig) -> BackgroundCells | None:
    """The background of all cameras as cells; None: without one. Made once for the members of a sweep.

    Raises:
        InputError: as `backgrounds`.
    """
    path = str(recording.path.resolve())
    key = json.dumps([path, images.background, str(grids), _photographs(recording), background_origin(recording)])
    known = _cut.get(key) if images.cache is None else None
    if known is not None:
        return known
    found = backgrounds(recording, images)
    if found is None:
        return None
    cells = stack_background(found, grids)
    with _cutting:
        _cut[key] = cells
        for oldest in list(_cut)[:-MOST_CUT]:
            _cut.pop(oldest, None)
    return cells


def _photographs(recording: Recording) -> dict[str, str]:
    """The pictures of the empty scene as they are on the disk, by camera."""
    return {name: fingerprint(recording.background[name]) for name in recording.background}


def backgrounds(recording: Recording, images: ImagesConfig) -> tuple[CameraBackground, ...] | None:
    """The background of every camera, as `images.background` asks for; None: without one, which `auto` says.

    Raises:
        InputError: as `background_or_reason`.
    """
    found = background_or_reason(recording, images)
    if not isinstance(found, str):
        return found
    sentence = f"{recording.path}: no background is used, since {found}"
    if images.background == "auto" and sentence not in _said:
        _said.add(sentence)
        say(sentence)
    return None


def background_or_reason(recording: Recording, images: ImagesConfig) -> tuple[CameraBackground, ...] | str:
    """The same, or why there is none, with the remedy.

    With `auto`, photographs count if every camera has one, else the clip, if it is suitable.

    Raises:
        InputError: pictures are asked for and missing, the clip is asked for and unsuitable, a video cannot be read,
            or the cache's folder cannot be written.
    """
    if images.background not in CHOICES:
        raise InputError(f"images.background={images.background}: no such choice; use one of {', '.join(CHOICES)}")
    missing = [name for name in recording.rig.names if name not in recording.background]
    if images.background == "pictures" and missing:
        raise InputError(
            f"{recording.path}: images.background=pictures, but background/ has no picture of "
            f"{', '.join(missing)}; add it, or set images.background=auto to learn it from the clip"
        )
    if images.background == "none":
        return "images.background=none"
    if images.background == "pictures" or (images.background == "auto" and not missing):
        return tuple(
            CameraBackground.from_plate(read_still(recording, name, recording.background[name]))
            for name in recording.rig.names
        )
    learnt = clip_backgrounds(recording, images.cache)
    if images.background == "clip" and isinstance(learnt, str):
        raise InputError(f"{recording.path}: images.background=clip, but {learnt}, or set images.background=none")
    return learnt


def clip_backgrounds(recording: Recording, cache: str | None) -> tuple[CameraBackground, ...] | str:
    """The backgrounds learnt from the clip, or why it is unsuitable (with the remedy); made once for each process."""
    key = json.dumps([str(recording.path.resolve()), background_origin(recording)])
    with _making:
        found = _made.pop(key, None)
        if found is None or (cache is not None and not isinstance(found, str)):
            found = _kept_or_learnt(recording, cache, found)
        _made[key] = found
        for oldest in list(_made)[:-MOST_MADE]:
            del _made[oldest]
    return found if isinstance(found, str) else _from_arrays(recording, found)


def _kept_or_learnt(recording: Recording, cache: str | None, known: Arrays | None) -> Arrays | str:
    """From the cache's folder, else what is known already, else learnt now; or why it cannot be."""
    try:
        return kept_background(cache, recording, lambda: learn(recording, None) if known is None else known, say)
    except UnsuitableError as reason:
        return str(reason)


def clip_backgrounds_without(recording: Recording, left_out: LeftOut) -> tuple[CameraBackground, ...]:
    """The same once the subject was tracked: where it is, widened, no sample counts. `sampled_frames` says which.

    Raises:
        InputError: a video cannot be read, or the clip is unsuitable.
    """
    try:
        return _from_arrays(recording, learn(recording, left_out))
    except UnsuitableError as reason:
        raise InputError(f"{recording.path}: no background can be learnt, since {reason}") from reason


def _from_arrays(recording: Recording, arrays: Arrays) -> tuple[CameraBackground, ...]:
    parts = [[arrays[f"{name}.{part}"] for part in PARTS] for name in recording.rig.names]
    return tuple(CameraBackground(picture, spread, known, "clip") for picture, spread, known in parts)
