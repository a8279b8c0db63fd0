"""What the poses of a run depend on: a run is only resumed with the settings and files that began it."""

import hashlib
import sys
from collections.abc import Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from sogjax.io.keypoint_files import find_keypoints
from sogjax.io.plane_video import pyav_version
from sogjax.io.recording import Recording
from sogjax.io.source import files_fingerprint, fingerprint
from sogjax.model.body import Body
from sogjax.run import build
from sogjax.settings.option import telling_settings
from sogjax.settings.run import TrackConfig

PACKAGES = ("sogjax", "jax", "jaxlib", "numpy", "equinox", "optimistix", "opencv-python-headless")
NO_MATTER = ("recording", "actor", "cameras", "adjust")
"""Settings, beside inert ones, whose files are compared instead, or that only begin to matter after tracking."""
SHOWN = 60
"""Longest value that is quoted in a sentence, characters."""

RunFingerprint = dict[str, Any]
"""What must be equal, by a short description; it can be stored as JSON."""


def run_fingerprint(
    recording: Recording, config: TrackConfig, given_actors: Sequence[Body] | None, poses: Path | None
) -> RunFingerprint:
    """Everything the poses of a run depend on.

    Args:
        recording: that is tracked.
        config: with which it is.
        given_actors: those of files; None: they are made.
        poses: the file with rough poses; None: there is none.
    """
    return {
        **{name: version(name) for name in PACKAGES},
        "PyAV": pyav_version(),
        "device": jax.default_backend(),
        "precision": str(jnp.asarray(0.0).dtype),
        **{key: value for key, value in telling_settings(config).items() if key not in NO_MATTER},
        **_code_of_terms(config),
        **_of_recording(recording),
        **_of_keypoints(recording),
        "the actors": None if given_actors is None else [digest(actor) for actor in given_actors],
        "the rough pose": None if poses is None else hashlib.sha256(poses.read_bytes()).hexdigest(),
    }


def difference(before: RunFingerprint, now: RunFingerprint) -> str | None:
    """The first difference, in words; None: there is none."""
    for key in (*now, *before):
        was, is_now = before.get(key), now.get(key)
        if was != is_now:
            short = not key.startswith("the ") and len(f"{was}{is_now}") <= SHOWN
            return f"{key} was {was}, now it is {is_now}" if short else f"{key} changed"
    return None


def installed_version(package: str) -> str | None:
    """The version of a package; None: it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def digest(arrays: Any) -> str:
    """Digest of a tree of arrays and names, exact to the bit."""
    content = hashlib.sha256(str(jax.tree.structure(arrays)).encode())
    for leaf in map(np.asarray, jax.tree.leaves(arrays)):
        content.update(f"{leaf.dtype}{leaf.shape}".encode() + leaf.tobytes())
    return content.hexdigest()


def _code_of_terms(config: TrackConfig) -> RunFingerprint:
    """The modules of the terms that the settings add to the energy."""
    added = [term for term in build.energy_terms(config.energy) if term.name in (config.energy.terms or {})]
    files = {term.name: Path(getattr(sys.modules[type(term).__module__], "__file__", None) or "") for term in added}
    digests = {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in files.items() if path.is_file()}
    return {f"the code of energy.terms.{name}": content for name, content in digests.items()}


def _of_keypoints(recording: Recording) -> RunFingerprint:
    """The fingerprint of keypoint files, where there are any; files that appear later are a difference."""
    found = find_keypoints(recording.path)
    if found is None:
        return {}
    scheme = recording.keypoint_scheme
    own = scheme is not None and Path(scheme).is_file()
    return {
        "the keypoints": files_fingerprint(found.files),
        "keypoint_scheme": hashlib.sha256(Path(str(scheme)).read_bytes()).hexdigest() if own else scheme,
    }


def _of_recording(recording: Recording) -> RunFingerprint:
    pictures = {f"the pictures of {name}": fingerprint(recording.sources[name]) for name in recording.rig.names}
    return {
        "cameras": list(recording.rig.names),
        "fps": recording.fps,
        "up": recording.up,
        "first_frame": recording.first_frame,
        "number of frames": recording.num_frames,
        "frame_offset": {name: recording.frame_offset[name] for name in recording.rig.names},
        "fewest_cameras": recording.fewest_cameras,
        "time_stamps": bool(recording.picked),
        "missing": {name: [list(span) for span in spans] for name, spans in recording.missing.items()},
        "color_gains": {name: list(gains) for name, gains in recording.color_gains.items()},
        "the calibration": digest(recording.rig.cameras),
        "the empty background pictures": {name: fingerprint(Path(p)) for name, p in recording.background.items()},
        "the pictures of what stands in front": {name: fingerprint(p) for name, p in recording.occluders.items()},
        **pictures,
    }
