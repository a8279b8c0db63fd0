"""Rendered recordings are kept, so the same settings are rendered only once on a machine."""

import hashlib
import json
from dataclasses import asdict
from pathlib import Path

from sogjax.errors import InputError
from sogjax.io.cache_folder import default_cache_dir
from sogjax.io.ground_truth import save_ground_truth
from sogjax.io.npz_file import read_npz
from sogjax.io.recording_files import GROUND_TRUTH
from sogjax.synth.detector import DetectorSettings
from sogjax.synth.keypoints import write_simulated
from sogjax.synth.render import Progress, ground_truth_of, render_recording, silent
from sogjax.synth.settings import SynthSettings
from sogjax.synth.stage import stage_of

SYNTH_VERSION = 2
"""Raise it with every change that alters the pictures."""

KEYPOINT_VERSION = 1
"""Raise it with every change that alters simulated keypoints."""

_CHOICES = ("props", "outfit", "room", "light_drift", "alone")
"""Settings that name no recording while they have their defaults."""


def cache_name(settings: SynthSettings) -> str:
    """The folder's name for these settings: readable, and different for different settings."""
    usual = asdict(SynthSettings())
    # Recordings rendered before there was a choice are found again.
    chosen = {k: v for k, v in asdict(settings).items() if k not in _CHOICES or v != usual[k]}
    content = json.dumps({"version": SYNTH_VERSION, **chosen}, sort_keys=True)
    return f"{settings.motion}{settings.actors}-{hashlib.sha256(content.encode()).hexdigest()[:12]}"


def cached_recording(settings: SynthSettings, cache_dir: Path | None = None, progress: Progress = silent) -> Path:
    """The recording with these settings, rendered now if it is not there yet.

    Raises:
        InputError: a setting is wrong, or the folder cannot be written.
    """
    settings.check()
    folder = (cache_dir or default_cache_dir()) / "recordings" / cache_name(settings)
    if folder.is_dir() and any(folder.iterdir()):
        return _with_angles(settings, folder)
    try:
        return render_recording(settings, folder, progress)
    except (InputError, OSError):
        if folder.is_dir() and any(folder.iterdir()):  # another process was faster
            return folder
        raise


def _with_angles(settings: SynthSettings, folder: Path) -> Path:
    """A kept recording, whose truth is completed where it was rendered before truths had joint angles."""
    path = GROUND_TRUTH.of(folder)
    if path.is_file() and "angles" not in read_npz(path):
        save_ground_truth(path, ground_truth_of(stage_of(settings)))
    return folder


def cached_keypoints(settings: SynthSettings, detector: DetectorSettings, cache_dir: Path | None = None) -> Path:
    """The folder with the keypoint files of a rendered recording, simulated now if they are not there yet.

    Raises:
        InputError: a setting is wrong, or the folder cannot be written.
    """
    settings.check()
    detector.check()
    content = json.dumps({"version": KEYPOINT_VERSION, **asdict(detector)}, sort_keys=True)
    name = f"{cache_name(settings)}-{hashlib.sha256(content.encode()).hexdigest()[:12]}"
    folder = (cache_dir or default_cache_dir()) / "keypoints" / name
    whole = folder / ".whole"
    if not whole.is_file():
        write_simulated(stage_of(settings), detector, folder)
        whole.touch()
    return folder
