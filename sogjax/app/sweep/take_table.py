"""The table of many recordings: printed, and written as CSV and Markdown."""

import csv
import io
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sogjax.data.atomic import atomic_path

NO_RESULT = "did not end; the same command again goes on with it"
NUMBERS = {
    "frames": 0,
    "similarity": 4,
    "explained %": 1,
    "joints mm": 1,
    "mean mm": 1,
    "lost": 0,
    "seconds": 1,
}
"""The columns of numbers, and their decimals; errors are there where a truth is."""
FAILED = "FAILED: "
LONGEST = 160
"""Letters of a verdict on the screen; the files have all of it."""


class Row(NamedTuple):
    """A recording and what became of it."""

    place: str
    folder: Path
    result: Mapping[str, Any] | str
    """Its numbers and its verdict, or why it failed."""

    @property
    def failed(self) -> str:
        """Why, or an empty text."""
        return self.result if isinstance(self.result, str) else ""

    @property
    def sentence(self) -> str:
        """The verdict, or why there is none."""
        return f"{FAILED}{self.result}" if isinstance(self.result, str) else str(self.result.get("verdict") or "-")

    def number(self, column: str) -> float:
        """NaN where it is not known."""
        return float("nan") if isinstance(self.result, str) else float(self.result.get(column, np.nan))


def finish_takes(out: Path, rows: Sequence[Row]) -> None:
    """Print the table, and write `recordings.csv` and `recordings.md`.

    Raises:
        InputError: the folder cannot be written.
    """
    cells = [_titles(rows), *(_cells(row, rows) for row in rows)]
    widths = [max(len(line[k]) for line in cells) for k in range(len(cells[0]))]
    print()
    for line in cells:
        numbers = "".join(f"{cell:>{width + 2}}" for cell, width in zip(line[1:-1], widths[1:-1], strict=True))
        print(f"{line[0]:<{widths[0]}}{numbers}  {_shown(line[-1])}")
    print(f"\nresults of each: {out}/RECORDING")
    for name, text in (("recordings.csv", _csv(rows)), ("recordings.md", _markdown(cells))):
        with atomic_path(out / name) as temporary:
            temporary.write_text(text, encoding="utf-8")
        print(out / name)


def _shown(sentence: str) -> str:
    """On the screen: why a recording failed as a whole, a verdict without its end where it is long."""
    return sentence if sentence.startswith(FAILED) else textwrap.shorten(sentence, LONGEST, placeholder=" ...")


def _columns(rows: Sequence[Row]) -> list[str]:
    """Those that some recording has a number in."""
    return [column for column in NUMBERS if any(np.isfinite(row.number(column)) for row in rows)]


def _titles(rows: Sequence[Row]) -> list[str]:
    return ["recording", *_columns(rows), "verdict"]


def _cells(row: Row, rows: Sequence[Row]) -> list[str]:
    known = [(column, row.number(column)) for column in _columns(rows)]
    numbers = [f"{value:.{NUMBERS[column]}f}" if np.isfinite(value) else "-" for column, value in known]
    return [row.place, *numbers, row.sentence]


def _markdown(cells: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in cells]
    rule = "|---" + "|---:" * (len(cells[0]) - 2) + "|---|"
    return "\n".join([lines[0], rule, *lines[1:], ""])


def _csv(rows: Sequence[Row]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["recording", *NUMBERS, "verdict", "failed", "results"])
    for row in rows:
        numbers = ["" if np.isnan(value := row.number(column)) else value for column in NUMBERS]
        verdict = "" if row.failed else row.sentence
        writer.writerow([row.place, *numbers, verdict, row.failed, row.folder])
    return text.getvalue()
