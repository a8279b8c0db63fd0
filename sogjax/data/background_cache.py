"""Backgrounds that were learnt from a recording, on disk, so that later runs do not read its videos for them."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from sogjax.data.atomic import atomic_path
from sogjax.data.npz_file import read_npz
from sogjax.data.recording import Recording
from sogjax.data.source import fingerprint
from sogjax.errors import InputError

BACKGROUND_VERSION = 1
"""Raise it with every change that alters what is learnt."""
NOTE = "made_from"

Arrays = dict[str, np.ndarray]


def background_origin(recording: Recording) -> dict[str, Any]:
    """Everything that a learnt background depends on, as it can be stored in JSON."""
    names, rig = recording.rig.names, recording.rig.cameras
    return {
        "version": BACKGROUND_VERSION,
        "up": recording.up,
        "frames": [recording.first_frame, recording.num_frames],
        "frame_offset": {name: recording.frame_offset[name] for name in names},
        "files": {name: fingerprint(recording.sources[name]) for name in names},
        "color_gains": {name: list(recording.color_gains.get(name, ())) for name in names},
        "missing": {name: [list(span) for span in recording.missing.get(name, ())] for name in names},
        "picked": {name: list(recording.picked.get(name, ())) for name in names},
        "cameras": [np.asarray(part).tolist() for part in (rig.camera_from_world, rig.intrinsics)],
    }


def kept_background(
    folder: str | None, recording: Recording, make: Callable[[], Arrays], say: Callable[[str], None]
) -> Arrays:
    """What `make` returns, from a file in the folder where it is kept there, else made and kept.

    Raises:
        InputError: the folder cannot be written, or whatever `make` raises.
    """
    if folder is None:
        return make()
    made_from = json.dumps(background_origin(recording), sort_keys=True)
    path = _file(Path(folder), recording)
    if path.is_file():
        try:
            arrays = read_npz(path)
            if str(arrays.pop(NOTE, "")) == made_from:
                return arrays
            say(f"images.cache: {path} was made from other files or settings; it is made again")
        except InputError:
            say(f"images.cache: {path} is damaged; it is made again")
    arrays = make()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"images.cache={folder}: no folder can be made there ({reason}); choose another") from error
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **{NOTE: np.array(made_from)}, **arrays)  # pyright: ignore[reportArgumentType]
    return arrays


def _file(folder: Path, recording: Recording) -> Path:
    what = json.dumps([str(recording.path.resolve()), recording.rig.names])
    return folder / f"{recording.name}-{hashlib.sha256(what.encode()).hexdigest()[:12]}-background.npz"
