"""Recordings to work on: one's own, or a rendered one whose truth is known."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from sogjax.data.ground_truth import GroundTruth, load_ground_truth
from sogjax.data.recording import Recording
from sogjax.engine.recordings import opened
from sogjax.engine.terminal import progress
from sogjax.errors import InputError
from sogjax.settings.compose import composed_without_hydra
from sogjax.synth import SynthSettings, cached_recording

TRUTH = "ground_truth.npz"


def open_recording(path: str | Path, cameras: Sequence[str] | None = None) -> Recording:
    """The recording in a folder: calibration, videos, and what else is known; no picture is read yet.

    Lengths are metres in the calibration's world, whatever unit its files have. Warnings are printed on standard error,
    and stand in `recording.warnings`.

    Args:
        path: the folder, as the guide's page "From cameras to a motion" describes it.
        cameras: names of those to use; None: all.

    Raises:
        InputError: something is missing, unreadable or does not fit together, or there is no such camera.
    """
    return opened(str(path), cameras)


def render_recording(**settings: Any) -> Recording:
    """A rendered recording of walking or exercising people, with the truth about them.

    It is rendered once and kept in a cache folder (`SOGJAX_CACHE`, else the system's), from where it is opened when the
    same settings are asked for again. Sixty frames of twelve cameras take about half a minute.

    Args:
        settings: options of `sogjax synth`, such as `motion="walk", cameras=4, frames=20, width=324, height=244`.

    Raises:
        InputError: an unknown setting (with the nearest known one), a value out of range, or a folder that cannot be
            written.
    """
    wanted: SynthSettings = composed_without_hydra(SynthSettings, "synth", keywords=settings)
    return opened(str(cached_recording(wanted, progress=progress)))


def load_truth(source: Recording | str | Path) -> GroundTruth:
    """The markers (frame, marker, 3) and joints (frame, joint, 3) that were measured, in metres in the world.

    Row i is frame i of the recording; NaN where a marker was not seen. Either may be None.

    Args:
        source: a recording, its folder, or a file `ground_truth.npz`.

    Raises:
        InputError: there is none, or the file is damaged.
    """
    path = source.ground_truth if isinstance(source, Recording) else Path(source)
    if path is not None and path.is_dir():
        path = path / TRUTH
    if path is None or not path.exists():
        where = source.path if isinstance(source, Recording) else path
        raise InputError(f"{where}: there is no ground truth; give a recording with a {TRUTH}, or such a file")
    return load_ground_truth(path)
