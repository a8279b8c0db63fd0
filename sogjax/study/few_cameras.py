"""What keypoints are worth with few cameras: trials with and without them, and the section that tells of them."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from sogjax.errors import InputError
from sogjax.io.files import write_file
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.keypoints.load import load_keypoints
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.quality.evaluation import evaluate_motions
from sogjax.quality.metrics import lost_points
from sogjax.run.recordings import opened, with_cameras
from sogjax.run.track import track_recording
from sogjax.settings.compose import track_config
from sogjax.study.document import Section
from sogjax.study.experiment import synth_settings, yardsticks
from sogjax.study.record import key_of, program_digest
from sogjax.study.source import MOST_FRAMES
from sogjax.study.study import Study
from sogjax.study.tracked import kept_actors
from sogjax.study.triangulation_trials import triangulation_errors
from sogjax.synth.cache import cached_keypoints, cached_recording
from sogjax.synth.detector import DetectorSettings
from sogjax.synth.settings import SynthSettings

BIASED = {"keypoint_bias": 0.035}
CASES: dict[str, dict[str, float] | None] = {
    "without": None,
    "keypoints": BIASED,
    "unbiased": {},
    "twice the noise": BIASED | {"keypoint_noise": 10.0},
    "20 % outliers": BIASED | {"keypoint_outliers": 0.2},
    "10 % exchanges": BIASED | {"keypoint_exchanges": 0.1},
    "a third missing": BIASED | {"keypoint_missing": 1.0 / 3.0},
}
"""The detector's settings by name, beside the usual ones; None: no keypoints. Real detectors are biased."""


@dataclass(frozen=True)
class Trial:
    """One sequence with so many cameras and one kind of keypoints."""

    sequence: str
    cameras: int
    case: str


@dataclass(frozen=True)
class Result:
    """Errors of joint centres in millimetres; NaN where there is nothing to compare."""

    mean: float
    worst: float
    """The 95th percentile."""
    lost: int
    """Stretches of five frames in which a joint is 20 cm off."""
    triangulated: float
    """Mean of the keypoints alone, triangulated, filled and filtered."""
    triangulated_lost: int


def evenly(names: Sequence[str], count: int) -> tuple[str, ...]:
    """So many of a ring of cameras; two of them a third of the ring apart, as opposite ones see the same outline."""
    if count == 2:
        return names[0], names[len(names) // 3]
    return tuple(names[k * len(names) // count] for k in range(count))


@dataclass(frozen=True)
class Trials:
    """Runs trials, and keeps what came of each; not done again by the same program."""

    folder: Path
    synth: dict[str, SynthSettings]
    """The settings of each sequence."""
    frames: int
    """Frames of each sequence, from its first."""
    words: tuple[str, ...] = ()
    """Settings of `sogjax track`."""

    def result(self, trial: Trial) -> Result:
        """The result of a trial: what was kept of it, else made now.

        Raises:
            InputError: it cannot be tracked.
        """
        if (kept := self.kept(trial)) is not None:
            return kept
        found = self._run(trial)
        write_file(self._path(trial), json.dumps({"trial": asdict(trial), "result": asdict(found)}))
        return found

    def kept(self, trial: Trial) -> Result | None:
        """The result of a trial that was done before; None: it was not."""
        path = self._path(trial)
        return Result(**json.loads(path.read_text(encoding="utf-8"))["result"]) if path.is_file() else None

    def _path(self, trial: Trial) -> Path:
        program = [program_digest(f"study/{name}.py") for name in ("few_cameras", "triangulation_trials")]
        key = key_of(program, asdict(trial), asdict(self.synth[trial.sequence]), self.frames, self.words, CASES)
        return self.folder / "results" / f"{key}.json"

    def _run(self, trial: Trial) -> Result:
        recording = self._recording(trial)
        bodies = self._actors(trial.sequence)
        recording = with_cameras(recording, evenly(recording.rig.names, trial.cameras))
        recording = replace(recording, num_frames=min(self.frames, recording.num_frames))
        config = track_config([f"images.cache={self.folder / 'cells'}", *self.words], recording=recording.path)
        run = track_recording(recording, bodies, config).result_so_far
        assert recording.ground_truth is not None
        truth = load_ground_truth(recording.ground_truth)
        evaluated = evaluate_motions(run.motions, truth).evaluations.values()
        joints = [each.joints for each in evaluated if each.joints is not None]
        errors = np.concatenate([each.errors for each in joints], axis=1)
        lost = sum(len(lost_points(each.errors, each.names, np.arange(len(each.errors)))) for each in joints)
        alone = self._triangulated(recording)
        return Result(1e3 * float(np.nanmean(errors)), 1e3 * float(np.nanpercentile(errors, 95)), lost, *alone)

    def _triangulated(self, recording: Recording) -> tuple[float, int]:
        keypoints = load_keypoints(recording)
        if keypoints is None or recording.ground_truth is None:
            return float("nan"), 0
        found = triangulation_errors(recording, keypoints, load_ground_truth(recording.ground_truth), keypoints.cameras)
        return 1e3 * found.filtered, found.lost

    def _recording(self, trial: Trial) -> Recording:
        """The rendered recording beside the keypoints of the case, in a folder of links."""
        wanted, values = self.synth[trial.sequence], CASES[trial.case]
        source = cached_recording(wanted)
        place = self.folder / "recordings" / f"{source.name}-{trial.case.replace(' ', '_').replace('%', 'percent')}"
        place.mkdir(parents=True, exist_ok=True)
        parts = {part.name: part for part in source.iterdir()}
        if values is not None:
            parts["pose"] = cached_keypoints(wanted, replace(DetectorSettings(keypoints="pose2sim"), **values))
        for name, part in parts.items():
            if not (place / name).exists():
                (place / name).symlink_to(part.resolve())
        return opened(str(place))

    def _actors(self, sequence: str) -> list[Body]:
        source = cached_recording(self.synth[sequence])
        return kept_actors(self.folder / "actors" / f"{source.name}-{program_digest()}", source)


KINDS = tuple((count, case) for count in (2, 3, 4, 6, 12) for case in ("without", "keypoints"))
"""Numbers of cameras and cases of the report."""


def few_cameras_section(study: Study) -> Section:
    """Tracking the yardstick sequences with few cameras, whatever the recordings of the study are."""
    trials = Trials(
        study.folder / "few_cameras",
        {name: synth_settings({"frames": MOST_FRAMES, **chosen}) for name, chosen in yardsticks().items()},
        study.frames or MOST_FRAMES,
        tuple(study.overrides),
    )
    wanted = [Trial(sequence, count, case) for sequence in trials.synth for count, case in KINDS]
    done: dict[Trial, Result] = {}
    without: list[str] = []
    for trial in wanted:
        try:
            found = trials.result(trial) if study.do else trials.kept(trial)
        except InputError as error:
            without.append(f"{trial.sequence}, {trial.cameras} cameras, {trial.case}: {error}")
            continue
        if found is not None:
            done[trial] = found
    about = (
        "What are keypoints of a detector worth with few cameras, and the body model beside triangulation? "
        "(`python experiments/few_cameras.py`, which also gives each sequence) Errors of joints. The keypoints are "
        "simulated and 35 mm off on average, as a detector's are; actors are made with all cameras, backgrounds are "
        "photographed. Two cameras stand a third of a circle apart, others evenly around."
    )
    table = together_table(done, KINDS) if done else "Nothing was tracked for this."
    return Section("Few cameras and keypoints", [about, table, *without])


def together_table(done: Mapping[Trial, Result], kinds: Sequence[tuple[int, str]]) -> str:
    """All sequences together, one row for a number of cameras and a case, as Markdown."""
    lines = ["| cameras | keypoints | joints, mm | 95 %, mm | lost | triangulated alone, mm | lost |", "|---" * 7 + "|"]
    for count, case in dict.fromkeys(kinds):
        found = [result for trial, result in done.items() if (trial.cameras, trial.case) == (count, case)]
        if not found:
            continue
        mean = lambda name, found=found: f"{np.mean([getattr(result, name) for result in found]):.1f}"
        total = lambda name, found=found: sum(getattr(result, name) for result in found)
        alone = ("", "") if CASES[case] is None else (mean("triangulated"), total("triangulated_lost"))
        cells = (count, case, mean("mean"), mean("worst"), total("lost"), *alone)
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines)
