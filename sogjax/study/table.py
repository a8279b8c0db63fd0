"""An experiment's summaries as a table in Markdown, and as sentences."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from sogjax.quality.angle_errors import by_plane, pooled
from sogjax.study.experiment import Experiment
from sogjax.study.summary import RowSummary

Cell = Callable[[RowSummary], str]

ACCURACY: dict[str, Cell] = {
    "error, mm": lambda row: f"{row.mean:.1f} +- {row.std:.1f}",
    "95 % interval": lambda row: _range(row.interval.low, row.interval.high),
    "difference": lambda row: difference_words(row),
    "closest rule, mm": lambda row: f"{row.closest:.1f} +- {row.closest_std:.1f}",
    "joints, mm": lambda row: f"{row.joints:.1f}",
    "lost": lambda row: str(row.lost),
    "iterations": lambda row: f"{row.iterations:.1f}",
    "not converged": lambda row: str(row.not_converged),
    "ms per step": lambda row: f"{row.milliseconds:.0f}",
    "the paper": lambda row: row.paper or "",
}
_NOTHING = ("", "nan", "nan +- nan", "nan to nan")
SPEED: dict[str, Cell] = {
    "tracking step, frames/s": lambda row: _rate(row, "step"),
    "whole, frames/s": lambda row: _rate(row, "whole"),
    "from start to end, frames/s": lambda row: _rate(row, "all"),
    "waiting for pictures, ms": lambda row: _waiting(row),
    "image blobs": lambda row: f"{row.image_blobs:.0f}",
    "iterations": lambda row: f"{row.iterations:.1f}",
    "error, mm": lambda row: f"{row.mean:.1f} +- {row.std:.1f}",
    "the paper": lambda row: row.paper or "",
}


def markdown_table(experiment: Experiment, rows: Sequence[RowSummary]) -> str:
    """The table of an experiment; columns without any value are left out.

    With several methods, the paper's figures stand in the table that compares them.
    """
    columns = ACCURACY if experiment.config.measure == "accuracy" else SPEED
    columns = {title: cell for title, cell in columns.items() if title != "the paper" or not experiment.config.methods}
    texts = {title: [cell(row) if _done(row) else "" for row in rows] for title, cell in columns.items()}
    texts = {title: cells for title, cells in texts.items() if any(cell not in _NOTHING for cell in cells)}
    lines = [[row.name, *(cells[k] for cells in texts.values())] for k, row in enumerate(rows)]
    return ruled_table([[experiment.config.axis, *texts], *lines])


def recordings_table(experiment: Experiment, rows: Sequence[RowSummary]) -> str:
    """The mean error of every row on every recording."""
    return _by_recording(experiment, rows, lambda row: row.by_recording)


def iterations_table(experiment: Experiment, rows: Sequence[RowSummary]) -> str:
    """The iterations per frame of every row on every recording."""
    return _by_recording(experiment, rows, lambda row: row.iterations_by_recording)


def degrees_table(experiment: Experiment, rows: Sequence[RowSummary]) -> str:
    """For each joint and plane the error of angles without the offset in degrees, and the ratio of ranges of motion.

    Empty where no recording's truth has joint angles.
    """
    known = [row for row in rows if row.angles]
    by_row = [{plane: pooled(errors) for plane, errors in by_plane(row.angles).items()} for row in known]
    planes = list(dict.fromkeys(plane for found in by_row for plane in found))
    lines = [[f"{experiment.config.axis}: centred error, degrees (ratio of ranges)", *(row.name for row in known)]]
    for plane in planes:
        numbers = [found.get(plane) for found in by_row]
        lines.append([" ".join(plane), *("" if each is None else _degrees(each) for each in numbers)])
    return ruled_table(lines) if planes else ""


def _degrees(numbers: Mapping[str, float]) -> str:
    error, ratio = numbers["mean_abs_centred"], numbers["range_ratio"]
    return f"{error:.1f}" + (f" ({ratio:.2f})" if np.isfinite(ratio) else "")


def _by_recording(
    experiment: Experiment, rows: Sequence[RowSummary], values_of: Callable[[RowSummary], Mapping[str, float]]
) -> str:
    names = list(dict.fromkeys(name for row in rows for name in row.by_recording))
    cells = lambda values: [f"{values[name]:.1f}" if name in values else "" for name in names]
    return ruled_table([[experiment.config.axis, *names], *([row.name, *cells(values_of(row))] for row in rows)])


def difference_words(row: RowSummary) -> str:
    """The difference to the reference with its interval, and whether it is significant."""
    if row.difference is None:
        return "reference" if row.is_reference else ""
    low, high = row.difference.interval
    number = f"{row.difference.mean:+.1f}" + (f" ({low:+.1f} to {high:+.1f})" if np.isfinite(low) else "")
    if row.difference.recordings == 1:
        return f"one recording: {number}"
    return number if row.difference.is_significant else f"not significant: {number}"


def significance(row: RowSummary) -> str:
    """The difference to the reference in a few words."""
    if row.difference is None:
        return "reference" if row.is_reference else ""
    words = "" if row.difference.recordings == 1 or row.difference.is_significant else ", not significant"
    return f"{row.difference.mean:+.1f}{words}"


def findings(experiment: Experiment, rows: Sequence[RowSummary]) -> list[str]:
    """What the experiment says in words: its best rows, and the paper's."""
    done = [row for row in rows if np.isfinite(row.mean)]
    if not done or experiment.config.measure != "accuracy":
        return []
    papers = [row for row in rows if row.paper_value is not None]
    best = [f"The paper's best: {min(papers, key=lambda row: row.paper_value or 0.0).name}."] if papers else []
    return [*_best(done), *best]


def _best(rows: Sequence[RowSummary]) -> list[str]:
    """The rows of the smallest mean error on the recordings that all of them have."""
    common = set.intersection(*(set(row.by_recording) for row in rows))
    if len(rows) < 2 or not common:
        return []
    means = {row.name: float(np.mean([row.by_recording[name] for name in sorted(common)])) for row in rows}
    least = min(means.values())
    names = [name for name, mean in means.items() if round(mean, 1) == round(least, 1)]
    return [f"Smallest mean error: {', '.join(names)} ({least:.1f} mm)."]


def _done(row: RowSummary) -> bool:
    return bool(row.by_recording)


def _range(low: float, high: float) -> str:
    return f"{low:.1f} to {high:.1f}"


def _rate(row: RowSummary, stage: str) -> str:
    return f"{row.rates.get(stage, float('nan')):.1f}"


def _waiting(row: RowSummary) -> str:
    return f"{1000.0 / row.rates.get('decode', float('nan')):.1f}"


def ruled_table(lines: Sequence[Sequence[object]]) -> str:
    """A table in Markdown of cells, whose first line are the titles."""
    ruled = [lines[0], ["---"] * len(lines[0]), *lines[1:]]
    in_cell = lambda cell: str(cell).replace("|", "\\|")  # which would end it
    return "\n".join(f"| {' | '.join(map(in_cell, line))} |" for line in ruled)
