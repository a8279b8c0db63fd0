"""Opening recordings and actors, and making actors where none are given."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from sogjax.check.cameras import rig_geometry
from sogjax.check.scale import implausible_distance
from sogjax.errors import InputError
from sogjax.io.actor_file import load_body, named_body
from sogjax.io.recording import Recording, open_recording
from sogjax.io.recording_settings import read_recording_settings
from sogjax.model.body import Body
from sogjax.model.rotation import world_from_upright
from sogjax.run.terminal import say
from sogjax.search.placed_body import means_of


def opened(path: str, cameras: Sequence[str] | None = None) -> Recording:
    """A recording with some or all of its cameras; its warnings are printed.

    Raises:
        InputError: the recording is invalid, or lacks one of the cameras.
    """
    recording = open_recording(Path(path))
    for warning in recording.warnings:
        say(f"warning: {warning}")
    return with_cameras(recording, cameras)


def with_cameras(recording: Recording, cameras: Sequence[str] | None) -> Recording:
    """A recording with some of its cameras; None: with all.

    Raises:
        InputError: none, one twice, or one that it does not have.
    """
    if cameras is None:
        return recording
    if isinstance(cameras, str):
        raise InputError(f"cameras={cameras}: must be a list of names, such as [{cameras!r}]")
    if not cameras or len(set(cameras)) < len(cameras):
        named = ", ".join(recording.rig.names)
        raise InputError(f"cameras=[{','.join(cameras)}]: name at least one camera, each once; there are {named}")
    unknown = [name for name in cameras if name not in recording.rig.names]
    if unknown:
        raise InputError(
            f"cameras={','.join(cameras)}: {recording.path} has no camera {', '.join(unknown)}; "
            f"it has {', '.join(recording.rig.names)}"
        )
    return replace(recording, rig=recording.rig.select(tuple(cameras)))


def chosen_frames(recording: Recording, start: int = 0, stop: int | None = None, every: int = 1) -> range:
    """The numbers of frames that are chosen by their places in a recording.

    Raises:
        InputError: there is none.
    """
    last = recording.num_frames if stop is None else stop
    if not 0 <= start < last <= recording.num_frames:
        raise InputError(
            f"start={start} stop={'null' if stop is None else stop}: {recording.path} has the frames 0 to "
            f"{recording.num_frames - 1}; choose 0 <= start < stop <= {recording.num_frames}"
        )
    return recording.frames[start:last:every]


def body_named(name: str) -> Body:
    """A bundled body, or one from a file.

    Raises:
        InputError: there is neither.
    """
    path = Path(name)
    return load_body(path if path.is_file() else named_body(name))


def file_list(value: Any) -> list[Path]:
    """One file or several, as a config gives them."""
    values = value if isinstance(value, (list, tuple)) else [value]
    return [Path(str(item)) for item in values]


def check_scale(recording: Recording, bodies: Sequence[Body]) -> None:
    """Check that the cameras stand as far from what they look at as bodies of this size are filmed from.

    Raises:
        InputError: they do not; the calibration's unit of length is probably another.
    """
    settings = recording.path / "recording.yaml"
    problem = implausible_distance(
        rig_geometry(recording.rig, recording.up),
        read_recording_settings(settings).unit,
        max(extent_of(body) for body in bodies),
    )
    if problem is not None:
        raise InputError(f"{recording.path}: {problem}")


def extent_of(body: Body) -> float:
    """The largest side of a body in its rest pose, in metres."""
    means = means_of(body, np.asarray(body.poses["rest"])[None])[0]
    radii = np.asarray(body.blob_sigmas)[:, None]
    return float(((means + radii).max(axis=0) - (means - radii).min(axis=0)).max())


def upright(body: Body, recording: Recording) -> Body:
    """A body that stands upright in the recording's world."""
    return body.rotated(jnp.asarray(world_from_upright(recording.up), body.blob_sigmas.dtype))
