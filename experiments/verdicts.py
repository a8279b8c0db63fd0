"""Is a run right that says "looks right", and wrong where it doubts itself?

    python experiments/verdicts.py [sequences=[walk,run]] [cameras=[4,12]] [backgrounds=[pictures,clip]] [do=false]

Yardstick sequences are tracked by their own actors and by wrong ones (`cases`, with `wrong_cameras`): red and blue
exchanged, other clothes (another sequence's), another person, a fifth larger or smaller; `moved=[0,1]` begins from
initial poses that are moved by a centimetre and two degrees, too. The verdict of each run stands beside the truth: a
limb is lost where its joints are more than 10 cm off on average, for three frames or more; a joint is astray where it
is more than 15 cm off in more than 1 % of the frames. Motions are kept in `out` and not tracked again, verdicts follow
from them by the rule as it stands; what was refused is tried again. Tables are printed, and written as tables.md.
"""

from dataclasses import dataclass, field
from itertools import product
from pathlib import Path

from beside_truth import OFTEN
from verdict_trials import CASES, JudgedRun, VerdictTrial, VerdictTrials, share

from sogjax.errors import InputError
from sogjax.io.files import write_file
from sogjax.run.memory import forget_programs_if_many
from sogjax.run.terminal import say
from sogjax.study.experiment import synth_settings, yardsticks
from sogjax.study.script import command_line, machine_line, run_script, settings_from
from sogjax.study.source import MOST_FRAMES

OWN = next(iter(CASES))
COLUMNS = (
    "sequence",
    "case",
    "background, cameras",
    "joints, mm",
    "lost limbs, frames",
    "a joint > 15 cm off",
    "explained",
    "of expected",
    "overlap",
    "verdict",
)


@dataclass
class Settings:
    """What is tracked, as `key=value` on the command line."""

    sequences: list[str] = field(default_factory=list)
    """Rows of the experiments `sequences` and `together`; none: all of `sequences`."""
    cameras: list[int] = field(default_factory=lambda: [4, 12])
    backgrounds: list[str] = field(default_factory=lambda: ["pictures"])
    cases: list[str] = field(default_factory=lambda: [*CASES])
    wrong_cameras: list[int] = field(default_factory=lambda: [4])
    """With which wrong actors are tried."""
    moved: list[int] = field(default_factory=lambda: [0])
    """Draws of a moved initial pose for the own actors; 0: as it is found."""
    frames: int = 60
    do: bool = True
    """Whether trials that are missing are run."""
    settings: list[str] = field(default_factory=list)
    """Of `sogjax track`."""
    out: str = "outputs/verdicts"


def main() -> None:
    """Run what is not there yet, and write the tables."""
    settings = settings_from(Settings)
    unknown = [case for case in settings.cases if case not in CASES]
    if unknown:
        raise InputError(f"cases: {unknown[0]}: is none of {', '.join(CASES)}")
    rows = {**yardsticks(), **yardsticks(settings.sequences)}
    synth = {name: synth_settings({"frames": MOST_FRAMES, **chosen}) for name, chosen in rows.items()}
    trials, found = VerdictTrials(Path(settings.out), synth, settings.frames, tuple(settings.settings)), []
    for background in settings.backgrounds:
        for case in settings.cases:
            for cameras in settings.cameras if case == OWN else settings.wrong_cameras:
                draws = settings.moved if case == OWN else [0]
                for sequence, moved in product(yardsticks(settings.sequences), draws):
                    forget_programs_if_many()
                    runs = trials.judged(VerdictTrial(sequence, cameras, background, case, moved), settings.do)
                    found += runs
                    for run in runs:
                        say(f"{sequence}, {cameras} cameras, {background}, {case}: {said(run)}")
    if not found:
        raise InputError("no trial was run; do=true runs them")
    text = tables(found)
    write_file(Path(settings.out) / "tables.md", text)
    print(text)


def said(run: JudgedRun) -> str:
    """The verdict in a line, and what is lost."""
    if run.verdict is None:
        return f"refused: {run.refused}"
    lost = ", ".join(f"{limb} {count}" for limb, count in (run.lost or {}).items())
    return f"{run.verdict.sentence} ({1e3 * run.mean:.0f} mm, lost: {lost or 'nothing'})"


def tables(found: list[JudgedRun]) -> str:
    """How often verdicts hold, by case and setting, then every run, as Markdown."""
    lines = [
        f"{machine_line()}: `{command_line()}`",
        "",
        "| case | background, cameras | actors | right, and doubted | a limb lost, and looks right "
        "| wrong subject, or refused | a joint astray, and looks right | none, and doubted |",
        "|---" * 8 + "|",
    ]
    kind = lambda run: (run.trial.case, f"{run.trial.background}, {run.trial.cameras}")
    for group in dict.fromkeys(map(kind, found)):
        runs = [run for run in found if kind(run) == group]
        tracked = [run for run in runs if run.verdict is not None]
        right, lost = [run for run in tracked if run.right], [run for run in tracked if not run.right]
        doubted = share(right, lambda run: not run.looks_right)
        missed = share(lost, lambda run: run.looks_right)
        caught = share(runs, lambda run: run.verdict is None or run.verdict.wrong)
        astray, near = [run for run in tracked if run.astray > OFTEN], [run for run in tracked if run.astray <= OFTEN]
        strictly = share(astray, lambda run: run.looks_right), share(near, lambda run: not run.looks_right)
        lines.append(
            f"| {group[0]} | {group[1]} | {len(runs)} | {doubted} | {missed} | {caught} | {' | '.join(strictly)} |"
        )
    lines += ["", "| " + " | ".join(COLUMNS) + " |", "|---" * len(COLUMNS) + "|", *map(_row, found)]
    return "\n".join(lines) + "\n"


def _row(run: JudgedRun) -> str:
    trial, verdict = run.trial, run.verdict
    name = trial.sequence + (f", {run.actor}" if run.actor not in ("", "anna") else "")
    case = trial.case + (f", moved {trial.moved}" if trial.moved else "")
    first = f"| {name} | {case} | {trial.background}, {trial.cameras}"
    if verdict is None:
        return f"{first} | | | | | | | refused: {run.refused} |"
    lost = ", ".join(f"{limb} {count}" for limb, count in (run.lost or {}).items())
    explained, expected = verdict.explained or 0.0, verdict.expected
    overlaps = sorted(verdict.overlap.values())
    overlap = f"{overlaps[len(overlaps) // 2]:.2f}" if overlaps else ""
    ratio = f"{explained / expected:.2f}" if expected else ""
    off = f"{1e3 * run.mean:.0f} | {lost} | {run.astray:.0%}"
    return f"{first} | {off} | {explained:.2f} | {ratio} | {overlap} | {verdict.sentence} |"


if __name__ == "__main__":
    run_script(main)
