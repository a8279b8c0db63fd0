"""A motion that was tracked before, with the actor, the settings and the recording that belong to it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.io.motion import Motion, load_motion, motion_from_poses
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.run.recordings import upright
from sogjax.settings.compose import as_object, without_removed
from sogjax.settings.run import TrackConfig

MOTION, ACTOR, CONFIG = "motion.npz", "actor.yaml", "config.yaml"
SAME_PLACE = 2e-3
"""Metres by which the blobs of a file and those of the actor in the same pose may differ."""


@dataclass(frozen=True)
class TrackedMotion:
    """What belongs to a motion."""

    path: Path
    motion: Motion
    actor: Body
    """In its own upright frame."""
    config: TrackConfig
    """With which it was tracked; the defaults where that is not known."""
    files: tuple[Path, ...]
    """That were read."""

    @classmethod
    def from_files(cls, motion: str, recording: Recording, actor: str | None) -> "TrackedMotion":
        """A run's folder or a motion file; the actor and the settings are looked for beside it.

        Raises:
            InputError: files that are missing, unreadable, or of another recording or body.
        """
        path = _motion_file(Path(motion))
        config = _config(path.parent / CONFIG)
        file = _actor_file(path, config, actor)
        found = cls(path, load_motion(path), load_body(file), config, (path, file))
        check_recording(found.path, found.motion, recording)
        _check_body(found, file, recording)
        return found


def _motion_file(path: Path) -> Path:
    if not path.is_dir():
        return path
    several = sorted(file.name for file in path.glob("motion_*.npz"))
    if not (path / MOTION).is_file() and several:
        raise InputError(f"motion={path}: holds the motions of several actors; only a clip of one can be adjusted")
    if not (path / MOTION).is_file():
        raise InputError(f"motion={path}: this folder holds no {MOTION}; give the folder of a run, or the file")
    return path / MOTION


def _config(path: Path) -> TrackConfig:
    """The settings of the run beside a motion."""
    if not path.is_file():
        return TrackConfig()
    try:
        kept = without_removed(OmegaConf.load(path))
        return as_object(OmegaConf.merge(OmegaConf.structured(TrackConfig), kept), "track")
    except (OmegaConfBaseException, yaml.YAMLError, ValueError, OSError) as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"{path}: is no configuration of a track ({reason}); move it away to use defaults") from error


def _actor_file(path: Path, config: TrackConfig, actor: str | None) -> Path:
    if actor is not None:
        return Path(actor)
    if (path.parent / ACTOR).is_file():
        return path.parent / ACTOR
    if isinstance(config.actor, str) and Path(config.actor).is_file():
        return Path(config.actor)
    raise InputError(f"{path}: its actor is not beside it; give actor=FILE, the one it was tracked with")


def check_recording(path: Path, motion: Motion, recording: Recording) -> None:
    """Check that a motion can be one of a recording.

    Raises:
        InputError: frames that it does not have, or another frame rate or vertical.
    """
    first, last = recording.first_frame, recording.first_frame + recording.num_frames - 1
    remedy = "give the recording in which it was tracked"
    if motion.num_frames == 0 or motion.frame[0] < first or motion.frame[-1] > last:
        theirs = f"{motion.frame[0]} to {motion.frame[-1]}" if motion.num_frames else "none"
        raise InputError(f"{path}: has the frames {theirs}, {recording.path} those from {first} to {last}; {remedy}")
    if not np.isclose(motion.fps, recording.fps, rtol=1e-3):
        raise InputError(f"{path}: has {motion.fps:g} frames per second, {recording.path} {recording.fps:g}; {remedy}")
    if motion.up != recording.up:
        raise InputError(f"{path}: its vertical is {motion.up}, that of {recording.path} {recording.up}; {remedy}")


def _check_body(tracked: TrackedMotion, file: Path, recording: Recording) -> None:
    """Check that the blobs of the motion are the actor's."""
    motion, body = tracked.motion, upright(tracked.actor, recording)
    same = motion.dof_names.tolist() == list(body.skeleton.dof_names) and len(motion.blob_sigma) == body.num_blobs
    if same:
        posed = motion_from_poses(body, motion.pose[:1], motion.fps, up=motion.up)
        same = bool(np.abs(posed.blob_means[0] - motion.blob_means[0]).max() < SAME_PLACE)
    if not same:
        raise InputError(f"{tracked.path}: is not a motion of {file}; give actor=FILE, the one it was tracked with")
