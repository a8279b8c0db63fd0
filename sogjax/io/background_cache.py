"""Backgrounds that were learnt from a recording, on disk, so that later runs do not read its videos for them."""

import contextlib
import hashlib
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from sogjax.errors import InputError
from sogjax.io.cache_folder import OFF, default_cache_dir, named_folder, sweep
from sogjax.io.npz_file import read_npz, save_npz
from sogjax.io.plane_video import pyav_version
from sogjax.io.recording import Recording
from sogjax.io.source import fingerprint

BACKGROUND_VERSION = 10
"""Raise it with every change that alters what is learnt."""
NOTE = "made_from"
VARIABLE = "SOGJAX_BACKGROUND_CACHE"
"""The environment variable with the folder where `images.cache` names none, or `off`."""
LARGEST = 1_000_000_000
"""Bytes to which the usual folder is cut back once a day; a camera takes about one million."""

Arrays = dict[str, np.ndarray]


def background_origin(recording: Recording) -> dict[str, Any]:
    """Everything that a learnt background depends on, as it can be stored in JSON."""
    names, rig = recording.rig.names, recording.rig.cameras
    return {
        "version": BACKGROUND_VERSION,
        "PyAV": pyav_version(),  # another one decodes other pixels
        "up": recording.up,
        "masked": recording.masked,
        "frames": [recording.first_frame, recording.num_frames],
        "frame_offset": {name: recording.frame_offset[name] for name in names},
        "files": {name: fingerprint(recording.sources[name]) for name in names},
        "color_gains": {name: list(recording.color_gains.get(name, ())) for name in names},
        "missing": {name: [list(span) for span in recording.missing.get(name, ())] for name in names},
        "picked": {name: list(recording.picked.get(name, ())) for name in names},
        "cameras": [np.asarray(part).tolist() for part in (rig.camera_from_world, rig.intrinsics)],
    }


def background_folder(chosen: str | None) -> Path | None:
    """Where backgrounds are kept: in the folder of `images.cache`, or where the environment says; None: nowhere.

    Raises:
        InputError: the folder that the environment names cannot be known.
    """
    if chosen is not None:
        return Path(chosen)
    if os.environ.get(VARIABLE, "").lower() == OFF:
        return None
    if (named := named_folder(VARIABLE)) is not None:
        return named
    try:
        return default_cache_dir() / "backgrounds"
    except InputError:
        return None


def kept_background(
    chosen: str | None, recording: Recording, make: Callable[[], Arrays], say: Callable[[str], None]
) -> Arrays:
    """What `make` returns, from a file in the folder where it is kept there, else made and kept.

    `chosen` is the folder that the settings name. Where they name none, and the usual one cannot be written, nothing
    is kept.

    Raises:
        InputError: the folder that was chosen cannot be written, or whatever `make` raises.
    """
    folder = background_folder(chosen)
    if folder is None:
        return make()
    made_from = json.dumps(background_origin(recording), sort_keys=True)
    path = _file(folder, recording)
    if path.is_file():
        try:
            arrays = read_npz(path)
            if str(arrays.pop(NOTE, "")) == made_from:
                return arrays
            say(f"{path} was made from other files or settings; it is made again")
        except InputError:
            say(f"{path} is damaged; it is made again")
    arrays = make()
    kept = {NOTE: np.array(made_from)} | arrays
    if chosen is None:
        with contextlib.suppress(InputError):
            save_npz(path, kept)
            sweep(folder, "*-background.npz", LARGEST)
        return arrays
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"images.cache={chosen}: no folder can be made there ({reason}); choose another") from error
    save_npz(path, kept)
    return arrays


def _file(folder: Path, recording: Recording) -> Path:
    what = json.dumps([str(recording.path.resolve()), recording.rig.names])
    return folder / f"{recording.name}-{hashlib.sha256(what.encode()).hexdigest()[:12]}-background.npz"
