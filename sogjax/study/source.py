"""The recordings of a study: opened once, their actor made once, their cells read once, for all runs."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body, save_body
from sogjax.io.cell_cache import CellsOfClip
from sogjax.io.ground_truth import GroundTruth, load_ground_truth
from sogjax.io.recording import Recording
from sogjax.io.recording_files import files_of
from sogjax.model.body import Body, concatenate
from sogjax.run import build
from sogjax.run.cells import cells_of_clip
from sogjax.run.first_pose import first_poses
from sogjax.run.recordings import actors_of, opened, upright
from sogjax.run.terminal import progress
from sogjax.settings.compose import track_config
from sogjax.settings.run import TrackConfig
from sogjax.study.experiment import synth_settings
from sogjax.synth.cache import cached_recording
from sogjax.synth.settings import MOTIONS, SynthSettings
from sogjax.tracking.tracker import Tracker

_IN_NAME = ("motion", "seed", "actors", "frames")
MOST_FRAMES = 60
"""That are rendered of a motion; a study of fewer frames tracks the first ones of the same recording."""


@dataclass(eq=False)
class Source:
    """One recording of a study and what its runs share."""

    name: str
    path: Path
    identity: str
    """Differs between recordings: a rendered one's settings, or where a folder is and what state its files are in."""
    num_frames: int
    """How many of its frames are tracked."""
    folder: Path
    """The study's, where actors and cells are kept."""
    body: str = "human"
    """The body that actors are made from."""
    _trackers: dict[tuple[object, ...], Tracker] = field(default_factory=dict)
    _cells: dict[int, CellsOfClip] = field(default_factory=dict)

    @cached_property
    def recording(self) -> Recording:
        """The recording with all its cameras."""
        return opened(str(self.path))

    @cached_property
    def truth(self) -> GroundTruth:
        """What is compared with.

        Raises:
            InputError: the recording has no ground truth.
        """
        if self.recording.ground_truth is None:
            raise InputError(f"{self.path}: has no ground_truth.npz; give a recording with ground truth")
        return load_ground_truth(self.recording.ground_truth)

    @property
    def actor_folder(self) -> Path:
        """Where its actors are kept."""
        digest = hashlib.sha256(f"{self.identity} {self.body}".encode()).hexdigest()[:8]
        return self.folder / "actors" / f"{self.name}-{digest}"

    @cached_property
    def actors(self) -> list[Body]:
        """The actors in their own upright frames, made from the example poses with all cameras, or read."""
        files = sorted(self.actor_folder.glob("*.yaml"))
        if files:
            return [load_body(path) for path in files]
        actors, _ = actors_of(self.recording, None, self.body, self.default_config.color)
        for number, actor in enumerate(actors):
            save_body(self.actor_folder / f"{number}_{actor.name}.yaml", actor)
        return actors

    @cached_property
    def bodies(self) -> list[Body]:
        """The actors, upright in the recording's world."""
        return [upright(actor, self.recording) for actor in self.actors]

    @cached_property
    def default_config(self) -> TrackConfig:
        """The track config without overrides."""
        return track_config(recording=self.path)

    @cached_property
    def start(self) -> Float[Array, "dof"]:
        """The rough pose of the first frame, the same for all runs."""
        return jnp.concatenate(first_poses(self.recording, self.bodies, self.default_config, 0))

    def cameras(self, count: int | None) -> tuple[str, ...]:
        """So many of the cameras, evenly taken.

        Raises:
            InputError: there are not so many.
        """
        names = self.recording.rig.names
        count = len(names) if count is None else count
        if count > len(names):
            raise InputError(f"{self.path}: has {len(names)} cameras, not {count}")
        return tuple(names[k * len(names) // count] for k in range(count))

    def seen_by(self, cameras: Sequence[str]) -> Recording:
        """The recording with some of its cameras."""
        return replace(self.recording, rig=self.recording.rig.select(tuple(cameras)))

    def cells(self, depth: int, cameras: Sequence[str], every: int) -> CellsOfClip:
        """The cells of some cameras in every so many frames; read once for each depth."""
        if depth not in self._cells:
            grids = build.cell_grids(self.recording, depth)
            images = replace(self.default_config.images, depth=depth, cache=str(self.folder / "cells"))
            self._cells[depth] = cells_of_clip(self.recording, grids, images, (0, self.num_frames))
        rows = [self.recording.rig.names.index(camera) for camera in cameras]
        return np.asarray(self._cells[depth][::every])[:, rows]

    def tracker(self, config: TrackConfig, cameras: tuple[str, ...]) -> Tracker:
        """The tracker of a config; what does not depend on its numbers is made once."""
        key = (cameras, config.images.depth, config.color.space, config.images.background)
        if key not in self._trackers:
            seen = self.seen_by(cameras)
            grids = build.cell_grids(seen, config.images.depth)
            self._trackers[key] = build.tracker(seen, concatenate(self.bodies), grids, config)
        return build.varied(self._trackers[key], config)


def source_named(name: str, num_frames: int, folder: Path, body: str = "human") -> Source:
    """A recording by its folder, or rendered now if it is not there yet: `walk:0` is a motion and a seed.

    Raises:
        InputError: neither a folder nor a motion that can be rendered.
    """
    if Path(name).is_dir():
        path = Path(name)
        num_frames = min(num_frames, opened(str(path)).num_frames)
        return Source(path.resolve().name, path, _state_of(path), num_frames, folder, body)
    motion, _, seed = name.partition(":")
    if motion not in MOTIONS or (seed and not seed.isdecimal()):
        raise InputError(f"{name}: is neither a folder nor MOTION:SEED (such as walk:0)")
    return rendered_source({"motion": motion, "seed": int(seed or 0)}, num_frames, folder, body)


def rendered_source(settings: Mapping[str, Any], num_frames: int, folder: Path, body: str = "human") -> Source:
    """A rendered recording by settings of `sogjax synth`, made now if it is not there yet.

    Raises:
        InputError: it cannot be rendered so.
    """
    wanted = synth_settings({"frames": max(num_frames, MOST_FRAMES), **settings})
    path = cached_recording(wanted, progress=progress)
    usual = asdict(SynthSettings(wanted.motion, seed=wanted.seed))
    chosen = [str(value) for key, value in settings.items() if key not in _IN_NAME and value != usual[key]]
    people = [f"{wanted.actors}people"] if wanted.actors > 1 else []
    name = "-".join([wanted.motion, f"seed{wanted.seed}", *people, *chosen])
    return Source(name, path, path.name, min(num_frames, wanted.frames), folder, body)


def _state_of(path: Path) -> str:
    """Where a recording is, and names, sizes and times of last change of all that belongs to it."""
    states = [(file, file.stat()) for file in files_of(path)]
    looked = [(str(file.relative_to(path)), state.st_size, state.st_mtime_ns) for file, state in states]
    return f"{path.resolve()} {hashlib.sha256(repr(looked).encode()).hexdigest()[:16]}"
