"""The table of many recordings: printed, and written as CSV and Markdown.

What became of each recording among several: kept in its folder, and read for the table of all.
"""

import csv
import io
import textwrap
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sogjax.cli.sweep.results import RESULT, Member, keep_result, kept_member
from sogjax.io.files import atomic_path
from sogjax.run.clock import TOTAL
from sogjax.run.kept_run import FOLDER, NOTE, read_note
from sogjax.run.run import Run
from sogjax.run.run_numbers import row_numbers
from sogjax.run.terminal import say
from sogjax.settings.run import TrackConfig

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


FAILED_FILE = "failed.json"
"""Why the last command failed here; beside `result.json`, the row of the run that ended here before, if one did."""


def track_take(config: TrackConfig, actor: Any, out: Path, track: Callable[[TrackConfig], Run]) -> dict[str, Any]:
    """Track a recording among several into its folder, going on where an earlier command stopped; its numbers."""
    config.out, config.actor = str(out), config.actor if actor is None else list(actor)
    config.resume = not config.overwrite and ((out / NOTE).is_file() or (out / FOLDER).is_dir())
    before = _kept_row(out) if config.resume else None
    say(f"\n== {config.recording}")
    result = track(config)
    if before is not None:
        return before
    verdict = "; ".join(verdict.sentence for verdict in result.verdicts.values())
    seconds = read_note(out / NOTE).get("seconds") or {}
    return row_numbers(result) | {
        "frames": len(result.converged),
        "seconds": seconds.get(TOTAL, float("nan")),
        "verdict": verdict,
    }


def keep_row(folder: Path, member: Member) -> None:
    """Keep the numbers of a recording's run, or why it failed; a failure leaves the numbers of an earlier run.

    Raises:
        InputError: the folder cannot be written.
    """
    keep_result(folder, member, FAILED_FILE if isinstance(member.result, str) else RESULT)


def forget_failure(folder: Path) -> None:
    """Forget why an earlier command failed here."""
    with suppress(OSError):
        (folder / FAILED_FILE).unlink()


def row_of(place: str, folder: Path) -> Row:
    """What became of a recording, whose results lie in a folder."""
    failed = kept_member(folder, FAILED_FILE)
    result = _kept_row(folder) if failed is None else failed.result
    return Row(place, folder, NO_RESULT if result is None else result)


def _kept_row(folder: Path) -> dict[str, Any] | None:
    """The numbers of the run that ended in a folder; None where none did, or only those of one before were kept."""
    kept = kept_member(folder)
    if kept is None or isinstance(kept.result, str) or not (folder / NOTE).is_file():
        return None
    is_of_it = (folder / RESULT).stat().st_mtime_ns >= (folder / NOTE).stat().st_mtime_ns
    return dict(kept.result) if is_of_it else None
