"""Searches for initial poses in rendered recordings: what was found and said, against the truth."""

import json
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.files import write_file
from sogjax.io.ground_truth import GroundTruth
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.run.actors import Actors
from sogjax.run.background import learn_background
from sogjax.run.initial_pose import PoseRequest, searched_poses
from sogjax.run.memory import forget_programs_if_many
from sogjax.run.terminal import say
from sogjax.run.track import opened_clip
from sogjax.settings.compose import track_config
from sogjax.study.record import key_of, program_digest
from sogjax.study.source import Source
from sogjax.study.study import Study
from sogjax.study.true_poses import LimbErrors, limb_errors

RIGHT = 0.10
"""Metres, mean over the joints: a pose farther off is wrong."""
EXCHANGED, CLEARLY = 0.05, 0.7
"""Metres that a pair of limbs is off, and what part of that is left with left and right exchanged, where they are."""
OTHER_SIDE = {"l_": "r_", "r_": "l_", "left_": "right_", "right_": "left_"}


@dataclass(frozen=True)
class FoundError:
    """The error of one pose."""

    joints: float
    """Metres, mean."""
    worst_limb: str
    worst: float
    """Metres, mean over that limb's joints."""
    kind: str
    """`right`, or what is wrong."""

    @property
    def is_right(self) -> bool:
        """Near enough, and nothing is exchanged."""
        return self.kind == "right"


def found_error(body: Body, pose: Float[np.ndarray, "dof"], truth: GroundTruth, frame: int) -> FoundError:
    """The error of a body's pose (upright in the world) in a frame of the recording."""
    truth = truth.subject(body.name) if truth.subjects else truth
    errors_of = lambda known: limb_errors([body], known, np.array([frame]), pose[None])
    errors = errors_of(truth)
    mirrored = errors_of(replace(truth, joint_names=tuple(map(other_side, truth.joint_names))))
    worst = int(np.nanargmax(errors.limbs[0]))
    joints = float(errors.mean[0])
    return FoundError(joints, errors.names[worst], float(errors.limbs[0, worst]), kind_of(joints, errors, mirrored))


def kind_of(joints: float, errors: LimbErrors, mirrored: LimbErrors) -> str:
    """What a pose is, from its errors and those against the truth with left and right exchanged (one frame)."""
    exchanged = [part for part in ("arm", "leg", "trunk") if _is_exchanged(part, errors, mirrored)]
    if "trunk" in exchanged:
        return "back to front"
    if exchanged:
        return " and ".join(f"{part}s" for part in exchanged) + " exchanged"
    if joints <= RIGHT:
        return "right"
    far = [name for name, limb in zip(errors.names, errors.limbs[0], strict=True) if limb > RIGHT]
    return "elsewhere" if "trunk" in far else f"misplaced: {', '.join(far)}" if far else "far off on the whole"


def other_side(joint: str) -> str:
    """The name of the joint on the other side of the body."""
    return next((OTHER_SIDE[side] + joint.removeprefix(side) for side in OTHER_SIDE if joint.startswith(side)), joint)


def _is_exchanged(part: str, errors: LimbErrors, mirrored: LimbErrors) -> bool:
    off, other = _mean_of(part, errors), _mean_of(part, mirrored)
    return off > EXCHANGED and other < CLEARLY * off


def _mean_of(part: str, errors: LimbErrors) -> float:
    """The mean error of the limbs that are such a part; 0 where there is none."""
    values = [errors.limbs[0, k] for k, name in enumerate(errors.names) if name.endswith(part)]
    return float(np.mean(values)) if values else 0.0


SEARCH_FILES = "search/*.py"
"""Files of the program that decide how a search ends, beside those of a run."""


@dataclass(frozen=True)
class Trial:
    """One search: in what it is made."""

    number: int
    sequence: str
    synth: dict[str, Any]
    """Settings of the rendered recording."""
    cameras: int
    turn: int
    """Which camera is the first of those that are taken, evenly, from the ring."""
    plates: bool
    frame: int


@dataclass(frozen=True)
class Search:
    """What was found of one actor in a trial."""

    trial: Trial
    actor: str
    error: FoundError | None
    """None: the search refused to name a pose."""
    sure: bool
    confidence: float
    """How likely right the search says it is."""
    seconds: float
    """Seconds of all the trial's actors together, with what had to be compiled."""
    processor_seconds: float
    """Processor seconds, of all cores together: what other programs do counts less."""
    refused: str = ""
    evidence: dict[str, float] = field(default_factory=dict)
    """Evidence from which that follows, and from what a search in another frame says, if there was one."""

    @property
    def is_right(self) -> bool:
        """Whether the pose is right; a refusal is not."""
        return self.error is not None and self.error.is_right


def drawn_trials(
    sequences: Mapping[str, Mapping[str, Any]], cameras: Sequence[int], frames: int, count: int, seed: int = 0
) -> Iterator[Trial]:
    """So many trials, drawn at random; more of them begin with the same ones."""
    names = [*sequences]
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        sequence = names[rng.integers(len(names))]
        yield Trial(
            number=number,
            sequence=sequence,
            synth=dict(sequences[sequence]),
            cameras=_each_in_turn(cameras, number, seed),
            turn=int(rng.integers(12)),
            plates=bool(rng.integers(2)),
            frame=int(rng.integers(frames)),
        )


def _each_in_turn(values: Sequence[int], number: int, seed: int) -> int:
    """Each of the values once before any comes again, in an order that is drawn every time."""
    turn, place = divmod(number, len(values))
    return int(np.random.default_rng([seed, turn]).permutation(values)[place])


@dataclass(frozen=True)
class Searches:
    """The folder of a calibration's searches, each of which is made once for a state of the program."""

    study: Study
    overrides: Sequence[str] = ()
    """Overrides of the track config."""

    def of(self, trial: Trial, do: bool = True) -> list[Search]:
        """What was found of every actor in a trial: read, or searched for now, if `do`."""
        path = self._path(trial)
        if path.is_file():
            return [_read(each) for each in json.loads(path.read_text(encoding="utf-8"))]
        if not do:
            return []
        found = self._made(trial)
        write_file(path, json.dumps([asdict(each) for each in found]))
        return found

    def _made(self, trial: Trial) -> list[Search]:
        source = self.study.source(trial.synth)
        recording = seen_in(source, trial)
        config = track_config([*self.overrides, f"start={trial.frame}"], recording=source.path)
        forget_programs_if_many()
        names = [body.name for body in source.bodies]
        say(f"{trial.number}: {trial.sequence}, {trial.cameras} cameras, frame {trial.frame}, plates: {trial.plates}")
        begin, begin_processor = time.perf_counter(), time.process_time()
        try:
            clip = opened_clip(recording, config)
            background = learn_background(clip, config.images.background, config.images.cache)
            request = PoseRequest(clip, background, Actors(tuple(source.actors)), config)
            found, refused = jax.block_until_ready(searched_poses(request)), ""
        except InputError as error:
            found, refused = None, str(error).splitlines()[0]
        took = time.perf_counter() - begin, time.process_time() - begin_processor
        if found is None:
            return [Search(trial, name, None, False, 0.0, *took, refused) for name in names]
        searches = []
        for body, pose in zip(source.bodies, found, strict=True):
            error = found_error(body, np.asarray(pose.pose), source.truth, trial.frame + recording.first_frame)
            evidence = {
                f"{name}.{part}": value
                for name in ("evidence", "agreement")
                if (said := getattr(pose, name)) is not None
                for part, value in asdict(said).items()
            }
            searches.append(Search(trial, body.name, error, pose.sure, pose.confidence, *took, evidence=evidence))
        return searches

    def _path(self, trial: Trial) -> Path:
        key = key_of(program_digest(SEARCH_FILES), asdict(trial), [*self.overrides], self.study.body)
        return self.study.folder / "searches" / f"{key}.json"


def seen_in(source: Source, trial: Trial) -> Recording:
    """The recording of a trial, with its cameras, and with plates or without."""
    names = source.recording.rig.names
    places = sorted((trial.turn + k * len(names) // trial.cameras) % len(names) for k in range(trial.cameras))
    recording = source.seen_by([names[place] for place in places])
    return recording if trial.plates else replace(recording, background={})


def _read(content: Mapping[str, Any]) -> Search:
    error = content["error"]
    parts = {"trial": Trial(**content["trial"]), "error": None if error is None else FoundError(**error)}
    return Search(**{**content, **parts})
