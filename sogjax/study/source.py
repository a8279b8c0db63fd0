"""The recordings of a study: opened once, their actor made once, their cells read once, for all runs."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from sogjax.errors import InputError
from sogjax.io.ground_truth import GroundTruth, load_ground_truth
from sogjax.io.recording import Recording
from sogjax.io.recording_files import files_of
from sogjax.model.body import Body
from sogjax.run import build
from sogjax.run.actors import Actors
from sogjax.run.background import learn_background
from sogjax.run.clip import Clip
from sogjax.run.initial_pose import SOURCES, InitialPose, PoseRequest, find_initial_pose
from sogjax.run.recordings import opened, upright
from sogjax.run.setup import Setup, tracking_setup
from sogjax.run.terminal import progress
from sogjax.run.track import opened_clip
from sogjax.settings.compose import track_config
from sogjax.settings.run import TrackConfig
from sogjax.study.experiment import synth_settings
from sogjax.study.tracked import kept_actors
from sogjax.synth.cache import cached_recording
from sogjax.synth.settings import MOTIONS, SynthSettings

_IN_NAME = ("motion", "seed", "actors", "frames")
MOST_FRAMES = 60
"""Frames that are rendered of a motion; a study of fewer frames tracks the first ones of the same recording."""


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
    _setups: dict[tuple[object, ...], Setup] = field(default_factory=dict)

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
        return kept_actors(self.actor_folder, self.path, self.body)

    @cached_property
    def bodies(self) -> list[Body]:
        """The actors, upright in the recording's world."""
        return [upright(actor, self.recording) for actor in self.actors]

    @cached_property
    def default_config(self) -> TrackConfig:
        """The track config without overrides."""
        return track_config(recording=self.path)

    @cached_property
    def initial_pose(self) -> InitialPose:
        """The rough pose of the first frame, found with all cameras and the usual settings: the same for all runs."""
        config = replace(self.default_config, stop=1)
        clip = opened_clip(self.recording, config)
        background = learn_background(clip, config.images.background, str(self.cell_folder))
        return find_initial_pose(PoseRequest(clip, background, Actors(tuple(self.actors)), config), SOURCES)

    @property
    def cell_folder(self) -> Path:
        """Where cells and learnt backgrounds are kept, for all recordings of the study."""
        return self.folder / "cells"

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

    def setup(self, config: TrackConfig, cameras: tuple[str, ...]) -> Setup:
        """What some cameras are tracked with in all frames; what does not depend on a config's numbers is made once."""
        key = (cameras, config.images.depth, config.color.space, config.images.background)
        if key not in self._setups:
            seen = replace(self.seen_by(cameras), num_frames=self.num_frames)
            clip = Clip(seen, seen.frames, config.images.depth)
            background = learn_background(clip, config.images.background, str(self.cell_folder))
            clip = clip.kept_in(self.folder, str(self.cell_folder))
            self._setups[key] = tracking_setup(clip, background, self.actors, config)
        found = self._setups[key]
        return replace(found, tracker=build.varied(found.tracker, config))


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
    differing = {key: value for key, value in settings.items() if key not in _IN_NAME and value != usual[key]}
    chosen = [key if value is True else str(value) for key, value in differing.items()]
    people = [f"{wanted.actors}people"] if wanted.actors > 1 else []
    name = "-".join([wanted.motion, f"seed{wanted.seed}", *people, *chosen])
    return Source(name, path, path.name, min(num_frames, wanted.frames), folder, body)


def _state_of(path: Path) -> str:
    """Where a recording is, and names, sizes and times of last change of all that belongs to it."""
    states = [(file, file.stat()) for file in files_of(path)]
    looked = [(str(file.relative_to(path)), state.st_size, state.st_mtime_ns) for file, state in states]
    return f"{path.resolve()} {hashlib.sha256(repr(looked).encode()).hexdigest()[:16]}"
