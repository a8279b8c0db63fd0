"""A calibration's searches as tables in Markdown, as CSV, and as what their chart shows."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from scipy.stats import beta

from sogjax.io.files import csv_text, write_file
from sogjax.study.searches import RIGHT, Search
from sogjax.study.table import ruled_table
from sogjax.view.charts import Reliability

MM = 1000.0
BINS = 8
GROUPS: dict[str, Callable[[Search], bool]] = {
    "all": lambda search: True,
    "plates": lambda search: search.trial.plates,
    "no plates": lambda search: not search.trial.plates,
    "3 and 4 cameras": lambda search: search.trial.cameras <= 4,
    "5 to 8 cameras": lambda search: 4 < search.trial.cameras <= 8,
    "9 to 12 cameras": lambda search: search.trial.cameras > 8,
}


def sure_table(searches: Sequence[Search]) -> str:
    """How many poses were called sure, how many of those are right, and the same of the others, by group."""
    titles = [
        "searches",
        "sure",
        "of these right",
        "at least (95 %)",
        "not sure",
        "of these right",
        "refused",
        "median s",
        "of the processor",
    ]
    lines = [["", *titles]]
    for name, belongs in GROUPS.items():
        group = [search for search in searches if belongs(search)]
        if group:
            sure = [search for search in group if search.sure]
            doubtful = [search for search in group if not search.sure and search.error is not None]
            lines.append(
                [
                    *(name, str(len(group)), str(len(sure)), _right(sure), f"{100.0 * least_share(sure):.0f} %"),
                    *(str(len(doubtful)), _right(doubtful), str(sum(search.error is None for search in group))),
                    f"{np.median([search.seconds for search in group]):.0f}",
                    f"{np.median([search.processor_seconds for search in group]):.0f}",
                ]
            )
    return ruled_table(lines)


def least_share(searches: Sequence[Search]) -> float:
    """The share that is right, at least so with a confidence of 95 % (Clopper and Pearson)."""
    right = sum(search.is_right for search in searches)
    return float(beta.ppf(0.05, right, len(searches) - right + 1)) if right else 0.0


def wrong_table(searches: Sequence[Search]) -> str:
    """Every pose that was called sure and is not right, for those who look at the failures."""
    lines = [
        ["search", "sequence", "actor", "cameras", "plates", "frame", "confidence", "joints, mm", "worst limb", "kind"]
    ]
    for search in searches:
        trial, error = search.trial, search.error
        if search.sure and error is not None and not error.is_right:
            where = [str(trial.number), trial.sequence, search.actor, str(trial.cameras), _yes(trial.plates)]
            worst = f"{error.worst_limb}, {MM * error.worst:.0f} mm"
            said = [str(trial.frame), f"{search.confidence:.4g}", f"{MM * error.joints:.0f}", worst, error.kind]
            lines.append([*where, *said])
    return ruled_table(lines) if len(lines) > 1 else "Of the poses that were called sure none is wrong."


def kinds_line(searches: Sequence[Search]) -> str:
    """How often which mistake was made."""
    kinds = [search.error.kind for search in searches if search.error is not None]
    counted = sorted({kind: kinds.count(kind) for kind in kinds}.items(), key=lambda pair: -pair[1])
    return ", ".join(f"{kind}: {count}" for kind, count in counted)


def reliability(searches: Sequence[Search]) -> Reliability:
    """Confidences of all searches that named a pose, their errors, and the share that is right in bins as large."""
    found = sorted((search for search in searches if search.error is not None), key=lambda search: search.confidence)
    parts = [part for part in np.array_split(np.arange(len(found)), min(BINS, max(len(found) // 4, 1))) if len(part)]
    return Reliability(
        confidence=np.array([search.confidence for search in found]),
        error=np.array([search.error.joints for search in found if search.error is not None]),
        sure=np.array([search.sure for search in found], bool),
        right=np.array([search.is_right for search in found], bool),
        bins=[(int(part[0]), int(part[-1]) + 1) for part in parts],
        limit=RIGHT,
    )


def write_searches(path: Path, searches: Sequence[Search]) -> None:
    """A row for each search and actor, as CSV."""
    lines: list[Sequence[object]] = [
        [
            *("number", "sequence", "actor", "cameras", "turn", "plates", "frame", "sure", "confidence", "joints mm"),
            *("worst limb", "worst mm", "kind", "seconds", "processor seconds", "refused"),
        ]
    ]
    for search in searches:
        trial, error = search.trial, search.error
        off = ["", "", "", ""]
        if error is not None:
            off = [f"{MM * error.joints:.1f}", error.worst_limb, f"{MM * error.worst:.1f}", error.kind]
        place = [trial.number, trial.sequence, search.actor, trial.cameras, trial.turn, trial.plates, trial.frame]
        said = [search.sure, f"{search.confidence:.6g}"]
        times = [f"{search.seconds:.1f}", f"{search.processor_seconds:.1f}"]
        lines.append([*place, *said, *off, *times, search.refused])
    write_file(path, csv_text(lines))


def _right(searches: Sequence[Search]) -> str:
    right = sum(search.is_right for search in searches)
    return f"{right} ({100.0 * right / len(searches):.1f} %)" if searches else ""


def _yes(value: bool) -> str:
    return "yes" if value else "no"
