"""The tables at the end: of a sweep's members with a chart, and of many recordings."""

import textwrap
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from sogjax.cli.sweep.results import APART, FAILED, Member, Row
from sogjax.io.files import csv_text, write_file
from sogjax.run.result import COLUMNS, OBJECTIVE
from sogjax.run.terminal import say
from sogjax.view.charts import Bars, bar_chart

ALL = (*COLUMNS[:6], APART, *COLUMNS[6:])
"""The columns of a sweep's table."""
COUNTS = ("lost", "swaps", "findings", "doubtful", "not converged")
MEANINGS = {
    APART: "mean distance of the joints to those of the first member",
    "explained %": "of the visible area, how much shows the actor's own colours",
    "findings": "of the verdict; 0: it looks right",
    "doubtful": "stretches in which a limb is in doubt",
}
TITLES = {OBJECTIVE: "mean marker error", APART: "mean distance of the joints to the first member's"}
OF_TAKES = {
    "frames": 0,
    "similarity": 4,
    "explained %": 1,
    "joints mm": 1,
    "mean mm": 1,
    "lost": 0,
    "seconds": 1,
}
"""The columns of numbers in the table of recordings, and their decimals; errors are there where a truth is."""
LONGEST = 160
"""Letters of a verdict on the screen; the files have all of it."""


def finish_sweep(sweep: Path, members: Sequence[Member]) -> None:
    """Print the table, and write `sweep.csv` and `sweep.png` into the sweep's folder.

    Raises:
        InputError: the folder cannot be written.
    """
    if not members:
        return
    names = differing([member.overrides for member in members])
    print(table([(name, member.row) for name, member in zip(names, members, strict=True)]))
    done = [member.row for member in members if not isinstance(member.row, str)]
    if done:
        print(f"\n{legend(_known(done))}")
    print()
    _write(sweep / "sweep.csv", csv_text(_lines_of_members(members)))
    column = next((column for column in TITLES if any(np.isfinite(row[column]) for row in done)), None)
    if not done:
        say("no sweep.png: no member worked")
    elif column is None:
        say("no sweep.png: there is no truth, and the motions have no joints or frames in common")
    else:
        _write(sweep / "sweep.png", _chart(members, column))


def finish_takes(out: Path, rows: Sequence[Row]) -> None:
    """Print the table, and write `recordings.csv` and `recordings.md`.

    Raises:
        InputError: the folder cannot be written.
    """
    columns = [column for column in OF_TAKES if any(np.isfinite(row.number(column)) for row in rows)]
    cells = [["recording", *columns, "verdict"]]
    for row in rows:
        known = [(value, OF_TAKES[column]) for column in columns for value in [row.number(column)]]
        numbers = [f"{value:.{digits}f}" if np.isfinite(value) else "-" for value, digits in known]
        cells.append([row.place, *numbers, row.sentence])
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    print()
    for place, *numbers, sentence in cells:
        columns = "".join(f"{cell:>{width + 2}}" for cell, width in zip(numbers, widths[1:-1], strict=True))
        print(f"{place:<{widths[0]}}{columns}  {_shown(sentence)}")
    print(f"\nresults of each: {out}/RECORDING")
    _write(out / "recordings.csv", csv_text(_lines_of_takes(rows)))
    _write(out / "recordings.md", _markdown(cells))


def _shown(sentence: str) -> str:
    """What the screen shows: why a recording failed as a whole, a verdict without its end where it is long."""
    return sentence if sentence.startswith(FAILED) else textwrap.shorten(sentence, LONGEST, placeholder=" ...")


def table(rows: Sequence[tuple[str, Mapping[str, float] | str]]) -> str:
    """A plain-text table of settings and results; what no member knows, such as errors without a truth, is left out."""
    width = max(len("settings"), *(len(name) for name, _ in rows)) if rows else 8
    columns = _known([numbers for _, numbers in rows if not isinstance(numbers, str)])
    lines = [f"{'settings':<{width}}" + "".join(f"{column:>14}" for column in columns)]
    for name, numbers in rows:
        known = "" if isinstance(numbers, str) else "".join(_cell(each, float(numbers[each])) for each in columns)
        lines.append(f"{name:<{width}}{known or f'   failed: {numbers}'}")
    return "\n".join(lines)


def legend(columns: Collection[str]) -> str:
    """What columns of the table are that nobody can guess."""
    lines = [f"{column}: {meaning}" for column, meaning in MEANINGS.items() if column in columns]
    if OBJECTIVE not in columns:
        lines.append("there is no truth: these numbers compare the members, and do not rank them")
    return "\n".join(lines)


def differing(members: Sequence[Sequence[str]]) -> list[str]:
    """The overrides that differ between the members of a sweep."""
    return [" ".join(words) or "as configured" for words in _own_words(members)]


def _own_words(members: Sequence[Sequence[str]]) -> list[list[str]]:
    """The overrides of each member that differ between members."""
    common = set.intersection(*(set(overrides) for overrides in members)) if members else set()
    return [[word for word in overrides if word not in common] for overrides in members]


def _setting(override: str) -> tuple[str, str]:
    """Key and value of an override; `~key` removes the key."""
    key, _, value = override.partition("=")
    return key.lstrip("+~"), "taken away" if key.startswith("~") else value


def _known(done: Sequence[Mapping[str, float]]) -> list[str]:
    """The columns that some member has a number in."""
    return [column for column in ALL if any(np.isfinite(numbers.get(column, np.nan)) for numbers in done)]


def _cell(column: str, value: float) -> str:
    digits = 4 if column == "similarity" else 0 if column in COUNTS else 2
    return f"{value:>14.{digits}f}" if np.isfinite(value) else f"{'-':>14}"


def _chart(members: Sequence[Member], column: str) -> bytes:
    """A chart (PNG) of a number of the members in millimetres, which also tells which failed."""
    own = _own_words([member.overrides for member in members])
    keys = dict.fromkeys(_setting(word)[0] for words in own for word in words)
    labels = [" ".join(_setting(word)[1] for word in words) or "as configured" for words in own]
    failed = [number for number, member in enumerate(members) if isinstance(member.result, str)]
    errors = [np.nan if isinstance(member.row, str) else member.row[column] for member in members]
    title = f"{TITLES[column]} over {', '.join(keys) or 'one run'}"
    return bar_chart([Bars(title, labels, {"": errors}, failed)], value="mm")


def _lines_of_members(members: Sequence[Member]) -> Iterable[Sequence[object]]:
    """The lines of `sweep.csv`: a column for each key that differs, then the numbers, then why the member failed."""
    settings = [dict(_setting(word) for word in member.overrides) for member in members]
    keys = list(dict.fromkeys(key for setting in settings for key in setting))
    yield [*keys, *ALL, "failed"]
    for setting, member in zip(settings, members, strict=True):
        row = member.row
        numbers = [*[""] * len(ALL), row] if isinstance(row, str) else [*(row[column] for column in ALL), ""]
        yield [*(setting.get(key, "") for key in keys), *numbers]


def _lines_of_takes(rows: Sequence[Row]) -> Iterable[Sequence[object]]:
    """The lines of `recordings.csv`."""
    yield ["recording", *OF_TAKES, "verdict", "failed", "results"]
    for row in rows:
        numbers = ["" if np.isnan(value := row.number(column)) else value for column in OF_TAKES]
        yield [row.place, *numbers, "" if row.failed else row.sentence, row.failed, row.folder]


def _markdown(cells: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in cells]
    rule = "|---" + "|---:" * (len(cells[0]) - 2) + "|---|"
    return "\n".join([lines[0], rule, *lines[1:], ""])


def _write(path: Path, content: str | bytes) -> None:
    write_file(path, content)
    print(path)
