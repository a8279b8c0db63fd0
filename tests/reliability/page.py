"""The page on reliability, as Markdown."""

from faults import Survived
from fuzzing import FuzzedReader
from kill_and_resume import Settings as RunSettings
from outcomes import Outcome

from sogjax.study.script import machine_line

RUNS = RunSettings()
"""The runs that the faults are injected into."""


def page(outcomes: list[Outcome], fuzzed: list[FuzzedReader], failed: list[Survived]) -> str:
    """The tables, as Markdown."""
    good = sum(outcome.good for outcome in outcomes)
    lines = [
        "# Reliability",
        "",
        f"Made by `python tests/reliability page=docs/reliability.md` ({machine_line()}).",
        "",
        "## Wrong input",
        "",
        f"{good} of {len(outcomes)} wrong inputs were refused with exit status 2 and one sentence, and left every file "
        "unchanged.",
        "",
        "| family | wrong inputs | refused | for example | answer |",
        "|---|---|---|---|---|",
    ]
    families = dict.fromkeys(outcome.case.family for outcome in outcomes)
    lines += [family_row([outcome for outcome in outcomes if outcome.case.family == family]) for family in families]
    lines += [failure(outcome) for outcome in outcomes if not outcome.good]
    lines += ["", "## Damaged files", ""]
    lines += [
        "The readers got valid files in which bytes were changed, lines removed, doubled or swapped, and numbers made",
        "extreme. Each file must be read or refused with one sentence (`InputError`).",
        "",
        f"{sum(r.files for r in fuzzed)} files: {sum(r.refused for r in fuzzed)} were refused, "
        f"{sum(len(r.crashes) for r in fuzzed)} ended with another exception, the others were read. "
        f"Readers: {'; '.join(r.name for r in fuzzed)}.",
    ]
    lines += [f"\n{r.name}: {len(r.crashes)} other exceptions, the first: {r.crashes[0]}" for r in fuzzed if r.crashes]
    return "\n".join(lines + faults_part(failed)) + "\n"


def faults_part(rows: list[Survived]) -> list[str]:
    """The table of faults; empty if none were injected."""
    if not rows:
        return []
    lines = [
        "",
        "## Faults injected and survived",
        "",
        f"A small rendered walk ({RUNS.frames} frames, {RUNS.cameras} cameras, all outputs, searched initial pose) was "
        "tracked while its",
        "surroundings failed. Every fault was real and hit a process of its own. Then the same command with",
        "`resume=true` continued the run, and every array of its `motion.npz` was compared with an undisturbed run's.",
        f"{sum(row.good for row in rows)} of {len(rows)} ended as expected: without a traceback, with every frame that "
        "had been written, and with the same result.",
        "",
        "| fault | what was done | frames readable afterwards | result after `resume=true` |",
        "|---|---|---|---|",
    ]
    return lines + [
        f"| {' | '.join(cell(text) for text in (row.fault, row.done, row.frames, row.end))} |" for row in rows
    ]


def family_row(outcomes: list[Outcome]) -> str:
    """One line of the table of wrong inputs: how many of a family were refused, and the first of them."""
    first, good = outcomes[0].case, sum(outcome.good for outcome in outcomes)
    said = cell(outcomes[0].said).replace("`", "'")
    return f"| {first.family} | {len(outcomes)} | {good} | {first.command[0]}: {cell(first.what)} | {said} |"


def failure(outcome: Outcome) -> str:
    """A wrong input that was answered otherwise, in full."""
    said = outcome.said.replace("`", "'")
    left = "nothing changed" if outcome.nothing_left else "files changed"
    return f"\nNot refused: {outcome.case.family}, {outcome.case.what}: status {outcome.status}, {left}; {said}"


def cell(text: str) -> str:
    """The text, escaped for a cell of a table."""
    return text.replace("|", "\\|").replace("\n", " ").replace("<", "&lt;")
