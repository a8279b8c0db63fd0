"""What runs think of themselves beside the truth: sequences tracked as they should be, and with something wrong."""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import equinox as eqx
import jax.numpy as jnp
from beside_truth import beside_truth
from repeatability import moved_starts

from sogjax.errors import InputError
from sogjax.io.files import write_file
from sogjax.io.ground_truth import GroundTruth, load_ground_truth
from sogjax.io.motion import Motion, load_motion
from sogjax.io.motion_data import save_motion
from sogjax.io.recording_files import GROUND_TRUTH
from sogjax.model.body import Body
from sogjax.quality.jumps import jumps
from sogjax.quality.limb_warnings import limits_of
from sogjax.quality.passages import passages
from sogjax.quality.verdict import Verdict, expected_of, verdicts
from sogjax.run.initial_pose import SOURCES, PoseSource
from sogjax.run.recordings import opened, with_cameras
from sogjax.run.track import track_recording
from sogjax.settings.compose import track_config
from sogjax.study.few_cameras import evenly
from sogjax.study.tracked import kept_actors
from sogjax.synth.cache import cached_recording
from sogjax.synth.settings import SynthSettings

TRIAL = "trial.json"
"""Name of the file that says what came of a trial, beside its motions."""


@dataclass(frozen=True)
class VerdictTrial:
    """A sequence tracked with some of its cameras by an actor, right or wrong."""

    sequence: str
    cameras: int
    background: str
    """The background, as `images.background`."""
    case: str
    """One of `CASES`."""
    moved: int = 0
    """Which draw of a moved initial pose (see `repeatability.py`) tracking begins with; 0: it is as found."""


@dataclass(frozen=True)
class JudgedRun:
    """What a run thought of one actor, and how far that was off; where nothing was tracked, only why."""

    trial: VerdictTrial
    actor: str
    refused: str = ""
    verdict: Verdict | None = None
    mean: float = float("nan")
    """Mean error of all joints (metres)."""
    lost: dict[str, int] | None = None
    """Frames in which a limb is far off, by limb, of the stretches that last."""
    astray: float = float("nan")
    """Part of the frames in which some joint is astray."""

    @property
    def right(self) -> bool:
        """No limb is lost."""
        return self.lost is not None and not self.lost

    @property
    def looks_right(self) -> bool:
        """What the run said."""
        return self.verdict is not None and self.verdict.looks_right


def own(bodies: list[Body], others: list[Body]) -> list[Body]:
    """The actors that were made for it."""
    return bodies


def exchanged_colors(bodies: list[Body], others: list[Body]) -> list[Body]:
    """The actors as made of pictures whose red and blue are exchanged."""
    return [eqx.tree_at(lambda body: body.blob_colors, body, body.blob_colors[:, ::-1]) for body in bodies]


def larger(bodies: list[Body], others: list[Body]) -> list[Body]:
    """The actors, larger by a fifth."""
    return [scaled(body, 1.2) for body in bodies]


def smaller(bodies: list[Body], others: list[Body]) -> list[Body]:
    """The actors, smaller by a fifth."""
    return [scaled(body, 0.8) for body in bodies]


def somebody_else(bodies: list[Body], others: list[Body]) -> list[Body]:
    """Actors of another sequence, under the names of these."""
    return [replace(other, name=body.name) for body, other in zip(bodies, others, strict=False)]


CASES: dict[str, Callable[[list[Body], list[Body]], list[Body]]] = {
    "own actor": own,
    "red and blue exchanged": exchanged_colors,
    "a fifth larger": larger,
    "a fifth smaller": smaller,
    "other clothes": somebody_else,
    "another person": somebody_else,
}


def scaled(body: Body, factor: float) -> Body:
    """A body all of whose lengths are so many times as long."""
    lengths = lambda b: (b.skeleton.offsets, b.blobs.offsets, b.blob_sigmas, b.landmarks.offsets)
    return eqx.tree_at(lengths, body, tuple(factor * jnp.asarray(part) for part in lengths(body)))


@dataclass(frozen=True)
class VerdictTrials:
    """Runs trials and keeps their motions: verdicts follow from them anew, by the rule as it stands."""

    folder: Path
    synth: dict[str, SynthSettings]
    """The settings of each sequence."""
    frames: int
    """Frames of each sequence, from its first."""
    words: tuple[str, ...] = ()
    """Settings of `sogjax track`."""

    def judged(self, trial: VerdictTrial, do: bool = True) -> list[JudgedRun]:
        """Each actor of a trial that was kept, or is run now; none where it would have to be run and must not.

        What was refused is tried again, if `do`.
        """
        said = {name: value for name, value in asdict(trial).items() if name != "moved" or value}
        content = json.dumps([said, asdict(self.synth[trial.sequence]), self.frames, self.words])
        place = self.folder / "motions" / hashlib.sha256(content.encode()).hexdigest()[:16]
        kept = _read(place)
        if do and (kept is None or kept["refused"]):
            self._run(trial, place)
            kept = _read(place)
        if kept is None:
            return []
        if kept["refused"]:
            return [JudgedRun(trial, "", kept["refused"])]
        motions = {name: load_motion(place / f"{name}.npz") for name in kept["expected"]}
        expected = {name: value for name, value in kept["expected"].items() if value}
        bodies = self._bodies(trial)
        moved = {body.name: (body, motions[body.name]) for body in bodies}
        odd = {name: [*jumps(*of_body), *passages(*of_body)] for name, of_body in moved.items()}
        limits = {body.name: limits_of(body) for body in bodies}
        found = verdicts(motions, expected, limits, limbs=odd)
        truth = self._truth(trial.sequence)
        return [judged_run(trial, name, motion, truth, found[name]) for name, motion in motions.items()]

    def _run(self, trial: VerdictTrial, place: Path) -> None:
        recording = opened(str(cached_recording(self.synth[trial.sequence])))
        recording = with_cameras(recording, evenly(recording.rig.names, trial.cameras))
        recording = replace(recording, num_frames=min(self.frames, recording.num_frames))
        bodies = self._bodies(trial)
        words = [f"images.cache={self.folder / 'cells'}", f"images.background={trial.background}", *self.words]
        kept: dict[str, Any] = {"trial": asdict(trial), "refused": "", "expected": {}}
        try:
            config = track_config(words, recording=recording.path)
            sources: Sequence[PoseSource] = SOURCES
            if trial.moved:
                start = next(moved_starts(recording, bodies, config, [trial.moved]))
                sources = (lambda _: start,)
            run = track_recording(recording, bodies, config, pose_sources=sources).result_so_far
        except InputError as error:
            if isinstance(error.__cause__, OSError):  # a full disk says nothing of the subject
                raise
            kept["refused"] = str(error)
        else:
            expected = expected_of(bodies)
            kept["expected"] = {name: expected.get(name) for name in run.motions}
            for name, motion in run.motions.items():
                save_motion(place / f"{name}.npz", motion)
        write_file(place / TRIAL, json.dumps(kept, indent=1))

    def _bodies(self, trial: VerdictTrial) -> list[Body]:
        """The right or wrong actors of a trial."""
        return CASES[trial.case](self._actors(trial.sequence), self._others(trial))

    def _actors(self, sequence: str) -> list[Body]:
        source = cached_recording(self.synth[sequence])
        return kept_actors(self.folder / "actors" / source.name, source)

    def _others(self, trial: VerdictTrial) -> list[Body]:
        """The actors of the sequence before that has as many, or the last one of the first that has more."""
        count = self.synth[trial.sequence].actors
        if trial.case == "other clothes":
            alike = [name for name, settings in self.synth.items() if settings.actors == count]
            return self._actors(alike[alike.index(trial.sequence) - 1])
        if trial.case == "another person":
            groups = [name for name, settings in self.synth.items() if settings.actors > 1]
            return self._actors(groups[0])[::-1]
        return []

    def _truth(self, sequence: str) -> GroundTruth:
        return load_ground_truth(GROUND_TRUTH.of(cached_recording(self.synth[sequence])))


def _read(place: Path) -> dict[str, Any] | None:
    """What was kept of a trial; None: nothing."""
    path = place / TRIAL
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None


def judged_run(trial: VerdictTrial, name: str, motion: Motion, truth: GroundTruth, verdict: Verdict) -> JudgedRun:
    """A run beside the truth of the subject of this name, or of the only one."""
    subject = name if name in truth.subjects else next(iter(truth.subjects), None)
    beside = beside_truth(motion, truth.subject(subject) if subject else truth)
    if beside is None:
        raise InputError(f"{trial.sequence}: its truth has no joints of the actor")
    return JudgedRun(trial, name, "", verdict, beside.mean, beside.lost, beside.astray)


def share(runs: Sequence[JudgedRun], holds: Callable[[JudgedRun], bool]) -> str:
    """`3 of 11` runs for which something holds."""
    return f"{sum(map(holds, runs))} of {len(runs)}"
