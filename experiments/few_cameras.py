"""What are keypoints worth with few cameras, and what is the body model worth beside triangulation?

    python experiments/few_cameras.py [sequences=[walk,run]] [cameras=[2,4]] [cases=[without,keypoints]] [frames=60]

Yardstick sequences are tracked without keypoints and with simulated ones (biased by 35 mm, as real detectors are;
`unbiased` beside it, and the cases of `robustness`, with `robust_cameras`), and the same keypoints are triangulated.
Actors are made with all cameras. What was done is kept in `out` and not done again: it can be stopped, and done in
parts. Tables are printed, and written as tables.md and results.csv.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path

from sogjax.errors import InputError
from sogjax.io.files import csv_text, write_file
from sogjax.run.terminal import say
from sogjax.study.experiment import synth_settings, yardsticks
from sogjax.study.few_cameras import CASES, Result, Trial, Trials, together_table
from sogjax.study.script import command_line, machine_line, run_script, settings_from
from sogjax.study.source import MOST_FRAMES


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


ROBUSTNESS = ["twice the noise", "20 % outliers", "10 % exchanges", "a third missing"]


@dataclass
class Settings:
    """What is tried, as `key=value` on the command line."""

    sequences: list[str] = field(default_factory=list)
    """Rows of the experiment `sequences`; none: all."""
    cameras: list[int] = field(default_factory=lambda: [2, 3, 4, 6, 12])
    cases: list[str] = field(default_factory=lambda: ["without", "keypoints", "unbiased"])
    robustness: list[str] = field(default_factory=lambda: [*ROBUSTNESS])
    robust_cameras: list[int] = field(default_factory=lambda: [4])
    frames: int = 60
    settings: list[str] = field(default_factory=list)
    """Of `sogjax track`, as `energy.keypoint_weight=0.3`."""
    out: str = "outputs/few_cameras"


def main() -> None:
    """Run what is not there yet, and write the tables."""
    settings = settings_from(Settings)
    unknown = [case for case in (*settings.cases, *settings.robustness) if case not in CASES]
    if unknown:
        raise InputError(f"cases: {unknown[0]}: is none of {', '.join(CASES)}")
    synth = {
        name: synth_settings({"frames": MOST_FRAMES, **chosen})
        for name, chosen in yardsticks(settings.sequences).items()
    }
    out = Path(settings.out)
    trials = Trials(out, synth, settings.frames, tuple(settings.settings))
    kinds = [(count, case) for count in settings.cameras for case in settings.cases]
    kinds += [(count, case) for count in settings.robust_cameras for case in settings.robustness]
    done: dict[Trial, Result] = {}
    for sequence in synth:
        for count, case in kinds:
            trial = Trial(sequence, count, case)
            done[trial] = trials.result(trial)
            say(f"{sequence}, {count} cameras, {case}: {done[trial].mean:.1f} mm, {done[trial].lost} lost")
    made_by = f"{machine_line()}: `{command_line()}`"
    text = "\n\n".join([made_by, together_table(done, kinds), each_table(done, kinds)]) + "\n"
    write_file(out / "tables.md", text)
    write_file(out / "results.csv", rows(done))
    print(text)


def rows(done: dict[Trial, Result]) -> str:
    """Every trial, as CSV."""
    titles = [entry.name for kind in (Trial, Result) for entry in fields(kind)]
    return csv_text([titles, *([*asdict(trial).values(), *asdict(result).values()] for trial, result in done.items())])


if __name__ == "__main__":
    run_script(main)
