"""The section about few cameras: numbers of cameras with and without keypoints, and the keypoints triangulated."""

from collections.abc import Mapping, Sequence

import numpy as np

from sogjax.errors import InputError
from sogjax.study.document import Section
from sogjax.study.experiment import synth_settings, yardsticks
from sogjax.study.few_cameras import CASES, Result, Trial, Trials
from sogjax.study.source import MOST_FRAMES
from sogjax.study.study import Study

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
        "(`python experiments/few_cameras.py`) Errors of joints. The keypoints are simulated and 35 mm off on average, "
        "as a detector's are; actors are made with all cameras, backgrounds are photographed. Two cameras stand a "
        "third of a circle apart, others evenly around."
    )
    tables = [together_table(done, KINDS), each_table(done, KINDS)] if done else ["Nothing was tracked for this."]
    return Section("Few cameras and keypoints", [about, *tables, *without])


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


def each_table(done: Mapping[Trial, Result], kinds: Sequence[tuple[int, str]]) -> str:
    """One row for a sequence: millimetres, and lost stretches where there are any, as Markdown."""
    kinds = list(dict.fromkeys(kinds))
    heads = " | ".join(f"{count}, {case}" for count, case in kinds)
    lines = [f"| sequence (mm, lost) | {heads} |", "|---" * (1 + len(kinds)) + "|"]
    for sequence in dict.fromkeys(trial.sequence for trial in done):
        cells = [_cell(done.get(Trial(sequence, count, case))) for count, case in kinds]
        lines.append(f"| {sequence} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _cell(result: Result | None) -> str:
    if result is None:
        return ""
    return f"{result.mean:.1f}" + (f", {result.lost}" if result.lost else "")
