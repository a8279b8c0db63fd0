"""How are wrong inputs answered, and is anything left half-written?

    python experiments/reliability.py [page=docs/reliability.md] [only=calibration] [faults=false]

Every case of `bad_input_cases.py` damages a valid workplace in one place and runs a command there. It passes if the
exit status is 2, the message is one sentence, and all files are unchanged. Then the readers get thousands of damaged
files: each must be read or refused with one sentence. Last, the surroundings of runs fail (`faults.py`): a run must
report it, lose nothing that was written, and give the same result when it is resumed.
"""

import contextlib
import hashlib
import io
import os
import shutil
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from bad_input_cases import cases
from bad_inputs import BadInput, make_workplace
from faults import Survived, survived
from fuzzing import FuzzedReader, fuzz_readers
from kill_and_resume import Settings as RunSettings

from sogjax.app.cli import main as sogjax
from sogjax.data.atomic import atomic_path
from sogjax.study.machine import machine_line
from sogjax.study.script import run_script, settings_from

RUNS = RunSettings()
"""The runs that the faults are injected into."""


@dataclass
class Settings:
    """What is tried, and where the page is written."""

    page: str | None = None
    only: str | None = None
    """One family of wrong inputs."""
    mutations: int = 2000
    """Damaged files per reader."""
    faults: bool = True
    """Whether to inject faults into runs."""
    kills: int = 20
    """How many runs are killed."""


@dataclass(frozen=True)
class Outcome:
    """How a command answered an input."""

    case: BadInput
    status: int | str
    said: str
    nothing_left: bool

    @property
    def good(self) -> bool:
        """Whether it was refused with one sentence and nothing changed."""
        return self.status == 2 and self.nothing_left and len(self.said.splitlines()) == 1


def main() -> None:
    """Print what failed, and write the page."""
    settings = settings_from(Settings)
    outcomes = outcomes_of([case for case in cases() if settings.only in (None, case.family)])
    fuzzed = fuzz_readers(settings.mutations) if settings.only is None else []
    failed = survived(settings.kills) if settings.faults and settings.only is None else []
    bad = [outcome for outcome in outcomes if not outcome.good]
    for outcome in bad:
        print(f"{outcome.case.family}: {outcome.case.what}: status {outcome.status}, {outcome.said!r}")
        print(f"    nothing left: {outcome.nothing_left}")
    crashes = [reader for reader in fuzzed if reader.crashes]
    for reader in crashes:
        print(f"{reader.name}: {reader.crashes[0]}")
    lost = [row for row in failed if not row.good]
    for row in lost:
        print(f"{row.fault}: {row.done}: {row.said}, {row.frames} frames; {row.end}")
    print(f"{len(outcomes) - len(bad)} of {len(outcomes)} wrong inputs refused as expected")
    if settings.page is not None:
        with atomic_path(Path(settings.page)) as temporary:
            temporary.write_text(page(outcomes, fuzzed, failed), encoding="utf-8")
    sys.exit(1 if bad or crashes or lost else 0)


def outcomes_of(inputs: list[BadInput]) -> list[Outcome]:
    """Try each case in a fresh copy of the workplace."""
    with tempfile.TemporaryDirectory() as place:
        good = Path(place) / "good"
        good.mkdir()
        make_workplace(good)
        return [outcome_of(case, good, Path(place) / "work") for case in inputs]


def outcome_of(case: BadInput, good: Path, work: Path) -> Outcome:
    """Damage a copy, run the command in it, and compare the files before and after."""
    shutil.copytree(good, work)
    case.damage(work)
    before = contents(work)
    out, err = io.StringIO(), io.StringIO()
    with contextlib.chdir(work), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status: int | str = sogjax(case.command)
        except BaseException as error:
            status = f"{type(error).__name__}: {error}"
    nothing_left = contents(work) == before
    shutil.rmtree(work)
    said = err.getvalue().strip().replace(f"{os.path.realpath(work)}/", "").replace(f"{work}/", "")
    return Outcome(case, status, said, nothing_left)


def contents(folder: Path) -> dict[str, str]:
    """Every file and folder with a digest of its content."""
    digest = lambda path: hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "folder"
    return {str(path.relative_to(folder)): digest(path) for path in sorted(folder.rglob("*"))}


def page(outcomes: list[Outcome], fuzzed: list[FuzzedReader], failed: list[Survived]) -> str:
    """The tables, as Markdown."""
    good = sum(outcome.good for outcome in outcomes)
    lines = [
        "# Reliability",
        "",
        f"Made by `python experiments/reliability.py page=docs/reliability.md` ({machine_line()}).",
        "",
        "## Wrong input",
        "",
        f"{good} of {len(outcomes)} wrong inputs were refused with exit status 2 and one sentence, and left every file "
        "unchanged.",
        "",
        "| family | what is wrong | command | message | status | files unchanged |",
        "|---|---|---|---|---|---|",
    ]
    lines += [row(outcome) for outcome in outcomes]
    lines += ["", "## Damaged files", ""]
    lines += [
        "The readers got valid files in which bytes were changed, lines removed, doubled or swapped, and numbers made",
        "extreme. Each file must be read or refused with one sentence (`InputError`).",
        "",
        "| reader | files | refused | read | other exceptions | seconds |",
        "|---|---|---|---|---|---|",
    ]
    for r in fuzzed:
        counts = (r.files, r.refused, r.files - r.refused - len(r.crashes), len(r.crashes))
        lines.append(f"| {r.name} | {' | '.join(map(str, counts))} | {r.seconds:.1f} |")
    return "\n".join(lines + faults_part(failed)) + "\n"


def faults_part(rows: list[Survived]) -> list[str]:
    """The table of faults; empty if none were injected."""
    if not rows:
        return []
    lines = [
        "",
        "## Faults injected and survived",
        "",
        f"A small rendered walk ({RUNS.frames} frames, {RUNS.cameras} cameras, all outputs, searched first pose) was "
        "tracked while its",
        "surroundings failed. Every fault was real and hit a process of its own. Then the same command with",
        "`resume=true` continued the run, and every array of its `motion.npz` was compared with an undisturbed run's.",
        f"{sum(row.good for row in rows)} of {len(rows)} ended as expected: without a traceback, with every frame that "
        "had been written, and with the same result.",
        "",
        "| fault | what was done | last message, and exit status | frames readable afterwards | result after "
        "`resume=true` |",
        "|---|---|---|---|---|",
    ]
    return lines + [
        f"| {' | '.join(cell(text) for text in (row.fault, row.done, row.said, row.frames, row.end))} |" for row in rows
    ]


def row(outcome: Outcome) -> str:
    """One line of the table of wrong inputs."""
    said = cell(outcome.said).replace("`", "'")
    said = said if len(said) < 300 else said[:297] + "..."
    left = "yes" if outcome.nothing_left else "NO"
    command = outcome.case.command[0]
    what = outcome.case.what.replace("|", "\\|")
    return f"| {outcome.case.family} | {what} | {command} | {said} | {outcome.status} | {left} |"


def cell(text: str) -> str:
    """The text, escaped for a cell of a table."""
    return text.replace("|", "\\|").replace("\n", " ").replace("<", "&lt;")


if __name__ == "__main__":
    run_script(main)
