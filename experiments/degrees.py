"""How many degrees are joint angles off, by joint and plane?

    python experiments/degrees.py runs=[RUN,RUN,...] [truths=[FILE,FILE,...]]

Runs are folders of results, of rendered recordings or others with a truth; those with the same number of cameras make
one table. Where a truth has no joint angles (rendered by earlier versions, or labelled by hand), the angles between the
lines that join its joints are compared. `truths` are other files of the runs' truths, one for each. How far each angle
moves the body's blobs follows: a sphere looks the same however it is turned.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sogjax.errors import InputError
from sogjax.io.export.angles import angle_reaches, has_angles
from sogjax.io.frame_motions import load_motions
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.recording_files import GROUND_TRUTH
from sogjax.model.reach import TOLD
from sogjax.quality.angle_errors import BETWEEN_BONES, AngleError, angle_table, base_name
from sogjax.quality.evaluation import evaluate_motions
from sogjax.run.adjust import kept_config
from sogjax.run.recordings import opened
from sogjax.run.run_files import CONFIG
from sogjax.study.script import run_script, settings_from


@dataclass(frozen=True)
class RunAngles:
    """One run's errors, all actors'."""

    run: Path
    cameras: int
    errors: tuple[AngleError, ...]
    joints: float
    """Mean distance of the joints from the true ones, millimetres; a run that was lost shows here."""
    reaches: Mapping[str, float] = field(default_factory=dict)
    """How far each angle moves the body's blobs (`sogjax.model.reach`), the mean over the actors."""

    @property
    def by_lines(self) -> bool:
        """Whether they are of angles between the lines that join the joints, as the truth has no joint angles."""
        return any(error.plane == BETWEEN_BONES for error in self.errors)


def angles_of_run(run: Path, truth: Path | None = None) -> RunAngles:
    """Errors of a run's motions against the truth of its recording, or another file of it.

    Raises:
        InputError: no results of a run, a recording that is no longer there, or one without a truth.
    """
    if not CONFIG.of(run).is_file():
        raise InputError(f"{run}: holds no {CONFIG.name}; give the folder of a run's results")
    config = kept_config(CONFIG.of(run))
    recording = opened(config.recording, config.cameras)
    path = GROUND_TRUTH.of(recording.path) if truth is None else truth
    if not path.is_file():
        raise InputError(f"{run}: its recording {recording.path} has no truth; give runs of one that has")
    motions = load_motions(run)
    evaluated = evaluate_motions(motions, load_ground_truth(path)).evaluations.values()
    distances = [1000.0 * each.joints.errors.ravel() for each in evaluated if each.joints is not None]
    joints = float(np.nanmean(np.concatenate(distances))) if distances else float("nan")
    reaches = [angle_reaches(motion, motion.up) for motion in motions.values() if has_angles(motion)]
    return RunAngles(
        run,
        len(recording.rig),
        tuple(error for each in evaluated for error in each.angles),
        joints,
        {name: float(np.mean([each[name] for each in reaches if name in each])) for each in reaches for name in each},
    )


def degrees_tables(runs: Sequence[RunAngles]) -> str:
    """A table for each number of cameras, the largest first; runs with joint angles and those without apart."""
    groups: dict[tuple[int, bool], list[RunAngles]] = {}
    for run in sorted(runs, key=lambda run: (-run.cameras, run.by_lines)):
        groups.setdefault((run.cameras, run.by_lines), []).append(run)
    return "\n\n".join(_table(cameras, group) for (cameras, _), group in groups.items())


def _table(cameras: int, runs: Sequence[RunAngles]) -> str:
    names = ", ".join(f"{run.run.name} (joints {run.joints:.0f} mm)" for run in runs)
    by_lines = "; angles between the lines that join the joints, as the truth has no others" if runs[0].by_lines else ""
    errors = [error for run in runs for error in run.errors]
    return "\n".join([f"{cameras} cameras: {names}{by_lines}", *angle_table(errors, details=False), *_reaches(runs)])


def _reaches(runs: Sequence[RunAngles]) -> list[str]:
    """In a line, how far angles move blobs, both sides together, the least first."""
    found: dict[str, list[float]] = {}
    for run in runs:
        for name, value in run.reaches.items():
            found.setdefault(base_name(name), []).append(value)
    parts = [
        f"{name} {np.mean(values):.1f}" for name, values in sorted(found.items(), key=lambda item: np.mean(item[1]))
    ]
    return [f"reach, in sizes of blobs (below {TOLD:g} an angle is not told): {', '.join(parts)}"] if parts else []


def truths_of(runs: Sequence[str], truths: Sequence[str]) -> Mapping[Path, Path | None]:
    """The truth of each run; None: its recording's.

    Raises:
        InputError: truths are given, but not one for each run.
    """
    if truths and len(truths) != len(runs):
        raise InputError(
            f"truths={','.join(truths)}: are {len(truths)} for {len(runs)} runs; give one for each, or none"
        )
    given = [Path(truth) if truth else None for truth in truths] or [None] * len(runs)
    return dict(zip(map(Path, runs), given, strict=True))


@dataclass
class Settings:
    """What is compared, as `key=value` on the command line."""

    runs: list[str] = field(default_factory=list)
    """Folders of results."""
    truths: list[str] = field(default_factory=list)
    """Files of truth, one for each run; none: those of the recordings."""


def main() -> None:
    """Compare, and print the tables."""
    settings = settings_from(Settings)
    if not settings.runs:
        raise InputError("runs=[]: nothing to compare; give folders of results, runs=[RUN,RUN]")
    pairs = truths_of(settings.runs, settings.truths).items()
    print(degrees_tables([angles_of_run(run, truth) for run, truth in pairs]))


if __name__ == "__main__":
    run_script(main)
