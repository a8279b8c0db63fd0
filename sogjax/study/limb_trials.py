"""Tracks in which limbs were lost, by themselves or on purpose: what tells of it in each frame, against the truth."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.posed import Posed
from sogjax.errors import InputError
from sogjax.io.files import atomic_path
from sogjax.model.body import Body
from sogjax.model.limbs import limb_blobs, limb_names, limbs
from sogjax.model.program import compiled
from sogjax.quality.limb_confidence import LimbMeasures, limb_confidence, limb_measures
from sogjax.quality.limb_evidence import blob_evidence
from sogjax.run.terminal import say
from sogjax.search.placed_body import means_of
from sogjax.settings.compose import track_config
from sogjax.study.record import key_of, program_digest
from sogjax.study.source import Source
from sogjax.study.study import Study
from sogjax.study.true_poses import limb_errors, true_poses
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameInput, TrackState
from sogjax.tracking.frame_by_frame import track
from sogjax.tracking.tracker import Tracker

NEAREST, FARTHEST = 0.2, 0.3
"""Metres, mean over the limb's blobs."""
DRAWS = 512


def displaced(
    body: Body,
    pose: Float[np.ndarray, "dof"],
    limb: Int[np.ndarray, "limb"],
    blobs: Bool[np.ndarray, "blob"],
    random: np.random.Generator,
) -> Float[np.ndarray, "dof"] | None:
    """The pose with a limb turned within its limits until it is 20 to 30 cm elsewhere; None: it cannot be so far."""
    lower, upper = np.asarray(body.skeleton.dof_lower)[limb], np.asarray(body.skeleton.dof_upper)[limb]
    poses = np.tile(pose, (DRAWS, 1)).astype(np.float32)
    far = random.uniform(0.2, 1.0, (DRAWS, 1))
    poses[:, limb] = (1.0 - far) * poses[:, limb] + far * random.uniform(lower, upper, (DRAWS, len(limb)))
    means = means_of(body, np.concatenate([pose[None].astype(np.float32), poses]))
    moved = np.linalg.norm(means[1:, blobs] - means[:1, blobs], axis=-1).mean(axis=1)
    right = np.flatnonzero((moved > NEAREST) & (moved < FARTHEST))
    return poses[right[0]] if len(right) else None


PLAIN, SKIPPING = "as recorded", "every third frame"
SKIPPED = 3
DISPLACED_IN = (14, 40)
"""Frames in which limbs are displaced, each in turn; the tracker knows no more of it than of a mistake of its own."""
FOLLOWED = 10
"""Frames after that."""


@dataclass(frozen=True)
class LimbTrial:
    """What is tracked: a recording with some of its cameras."""

    sequence: str
    recording: str | Mapping[str, Any]
    """Its name, or the settings of a rendered one."""
    cameras: int | None
    """None: all."""
    background: str
    """The background, as `images.background`."""


@dataclass(frozen=True)
class Tracked:
    """Poses of some frames of a clip."""

    kind: str
    frames: Int[np.ndarray, "frame"]
    poses: Float[np.ndarray, "frame dof"]
    before: Float[np.ndarray, "frame dof"]
    """What was known of the frames before."""
    follows: int
    """The frame of the plain run after which it goes on; 0: it begins with the clip."""


@dataclass(frozen=True)
class JudgedLimb:
    """What was measured of one limb over the frames of a run, and how far it was off."""

    trial: LimbTrial
    kind: str
    name: str
    worse: Float[np.ndarray, "frame"]
    contradicted: Float[np.ndarray, "frame"]
    error: Float[np.ndarray, "frame"]
    """Metres, mean over the limb's joints."""


class LimbTrials:
    """Trials that were made are kept in a folder, and not made again by the same program."""

    def __init__(self, study: Study, overrides: Sequence[str] = ()):
        self.study, self.overrides = study, [*overrides]

    def of(self, trial: LimbTrial, do: bool = True) -> list[JudgedLimb]:
        """The limbs of a trial; none where it was not made and is not to be."""
        path = self.path(trial)
        if not path.is_file():
            if not do:
                return []
            cameras = "all" if trial.cameras is None else trial.cameras
            say(f"limbs: {trial.sequence}, {cameras} cameras, background: {trial.background}")
            self.keep(trial, [*self.tracked(trial)])
        with np.load(path) as kept:
            parts = zip(kept["kind"], kept["name"], kept["first"], kept["stop"], strict=True)
            values = {name: kept[name] for name in ("worse", "contradicted", "error")}
        return [
            JudgedLimb(trial, str(kind), str(name), **{key: of[first:stop] for key, of in values.items()})
            for kind, name, first, stop in parts
        ]

    def tracked(self, trial: LimbTrial) -> Iterator[Tracked]:
        """The runs of a trial."""
        source, tracker, cells = self._tracker(trial)
        capacities: Capacities | None = None

        def follow(start: Array | TrackState, frames: Int[np.ndarray, "frame"]) -> Float[np.ndarray, "frame dof"]:
            nonlocal capacities
            found = [*track(tracker, start, [cells[k] for k in frames], capacities)]
            capacities = found[-1].capacities
            return np.stack([np.asarray(frame.result.pose) for frame in found])

        first = np.concatenate([_true_start(body, source) for body in source.bodies])
        if not np.isfinite(first).all():
            first = source.initial_pose.pose
        frames = np.arange(len(cells))
        plain = follow(jnp.asarray(first), frames)
        yield Tracked(PLAIN, frames, plain, np.concatenate([first[None], plain[:-1]]), 0)
        skipping = frames[::SKIPPED]
        poses = follow(jnp.asarray(first), skipping)
        yield Tracked(SKIPPING, skipping, poses, np.concatenate([first[None], poses[:-1]]), 0)
        body, random = tracker.body, np.random.default_rng(len(trial.sequence) * 100 + (trial.cameras or 0))
        for at in (at for at in DISPLACED_IN if at + FOLLOWED < len(cells)):
            for name, limb, blobs in zip(limb_names(body), limbs(body.skeleton), limb_blobs(body), strict=True):
                wrong = displaced(body, plain[at], limb, blobs, random)
                if wrong is None:
                    continue
                before = plain[at - 1].copy()
                before[limb] = wrong[limb]
                after = at + 1 + np.arange(FOLLOWED)
                poses = follow(TrackState(jnp.asarray(wrong), jnp.asarray(before), jnp.asarray(2)), after)
                yield Tracked(f"{name} displaced", after, poses, np.concatenate([wrong[None], poses[:-1]]), at)

    def keep(self, trial: LimbTrial, runs: Sequence[Tracked]) -> None:
        """Measure the limbs in the frames of all runs, the plain one first, and keep that where the truth is known.

        Raises:
            InputError: it is known nowhere.
        """
        source, tracker, cells = self._tracker(trial)
        baseline: Float[np.ndarray, "frame 2 blob"] = np.zeros((0, 2, tracker.body.num_blobs))
        columns: dict[str, list[Any]] = {key: [] for key in ("kind", "name", "worse", "contradicted", "error")}
        for run in runs:
            start = baseline[run.follows] if run.follows else np.full((2, tracker.body.num_blobs), np.nan, np.float32)
            measures, before = measured(tracker, cells, run, start)
            baseline = before if run.kind == PLAIN else baseline
            if run.frames[0] >= source.truth.num_frames:
                continue
            errors = limb_errors(source.bodies, source.truth, run.frames, run.poses)
            for k, name in enumerate(limb_names(tracker.body)):
                error = errors.limbs[:, errors.names.index(name)] if name in errors.names else np.full(1, np.nan)
                known = np.isfinite(error)
                if known.any():
                    columns["kind"].append(run.kind)
                    columns["name"].append(name)
                    columns["worse"].append(np.asarray(measures.worse[:, k])[known])
                    columns["contradicted"].append(np.asarray(measures.contradicted[:, k])[known])
                    columns["error"].append(error[known])
        if not columns["error"]:
            raise InputError(f"{source.path}: its truth knows no limb in the frames that were tracked")
        stop = np.cumsum([len(error) for error in columns["error"]])
        ends = {"first": np.concatenate([[0], stop[:-1]]), "stop": stop}
        words = {key: np.array(columns.pop(key), str) for key in ("kind", "name")}
        with atomic_path(self.path(trial)) as temporary, temporary.open("wb") as file:
            np.savez(file, **words, **ends, **{key: np.concatenate(of) for key, of in columns.items()})  # pyright: ignore[reportArgumentType]

    def path(self, trial: LimbTrial) -> Path:
        """Where a trial is kept."""
        key = key_of(program_digest("study/limb_trials.py"), asdict(trial), self.overrides, self.study.body)
        return self.study.folder / "limbs" / f"{key}.npz"

    def _tracker(self, trial: LimbTrial) -> tuple[Source, Tracker, list[FrameInput]]:
        source = self.study.source(trial.recording)
        cache = {"background": trial.background, "cache": str(self.study.folder / "cells")}
        config = track_config(self.overrides, recording=source.path, images=cache)
        setup = source.setup(config, source.cameras(trial.cameras))
        return source, setup.tracker, [*setup.clip.frames()]


def _true_start(body: Body, source: Source) -> Float[np.ndarray, "dof"]:
    truth = source.truth.subject(body.name) if source.truth.subjects else source.truth
    return true_poses(body, truth, source.recording.up)[0].astype(np.float32)


def measured(
    tracker: Tracker, cells: Sequence[FrameInput], run: Tracked, baseline: Float[np.ndarray, "2 blob"]
) -> tuple[LimbMeasures, Float[np.ndarray, "frame 2 blob"]]:
    """What tells of the limbs in every frame of a run, and what was usual before it."""
    found, history, now = [], [], jnp.asarray(baseline)
    for frame, pose, before in zip(run.frames, run.poses, run.before, strict=True):
        history.append(np.asarray(now))
        measures, now = _measured(tracker, jnp.asarray(cells[frame].cells), jnp.asarray(before), jnp.asarray(pose), now)
        found.append(jax.device_get(measures))
    return LimbMeasures(*(jnp.stack(part) for part in zip(*found, strict=True))), np.stack(history)


@compiled
def _measured(
    tracker: Tracker, cells: Array, before: Array, pose: Array, baseline: Array
) -> tuple[LimbMeasures, Float[Array, "2 blob"]]:
    """The step's own judgement of a pose that was found already."""
    reader, limbs = tracker.reader, tracker.limbs
    assert limbs is not None
    assert reader.subject is not None
    odds = reader.odds(cells.astype(before.dtype) / 255.0)
    boxes = tracker.boxes(TrackState.from_pose(before))
    windows = None if odds is None else reader.windows(odds, tracker.cameras, boxes)
    posed = Posed.from_pose(tracker.body, pose)
    evidence = blob_evidence(limbs, posed, tracker.cameras, windows, cells, reader.cell_sizes, reader.subject)
    return limb_measures(limbs, evidence, baseline), limb_confidence(
        limbs, evidence, baseline, windows is not None
    ).baseline
