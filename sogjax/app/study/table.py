"""An experiment's summaries as a table in Markdown, and as sentences."""

from collections.abc import Callable, Sequence

import numpy as np

from sogjax.app.study.experiment import Experiment
from sogjax.app.study.summary import RowSummary

Cell = Callable[[RowSummary], str]

ACCURACY: dict[str, Cell] = {
    "error, mm": lambda row: f"{row.mean:.1f} +- {row.std:.1f}",
    "95 % interval": lambda row: _range(row.interval.low, row.interval.high),
    "difference": lambda row: difference_words(row),
    "joints, mm": lambda row: f"{row.joints:.1f}",
    "lost": lambda row: str(row.lost),
    "iterations": lambda row: f"{row.iterations:.1f}",
    "evaluations": lambda row: f"{row.evaluations:.1f}",
    "not converged": lambda row: str(row.not_converged),
    "ms a step": lambda row: f"{row.milliseconds:.0f}",
    "the paper": lambda row: row.paper or "",
}
SPEED: dict[str, Cell] = {
    "tracking step, frames/s": lambda row: _rate(row, "step"),
    "whole, frames/s": lambda row: _rate(row, "whole"),
    "waiting for pictures, ms": lambda row: _waiting(row),
    "image blobs": lambda row: f"{row.image_blobs:.0f}",
    "iterations": lambda row: f"{row.iterations:.1f}",
    "error, mm": lambda row: f"{row.mean:.1f} +- {row.std:.1f}",
    "the paper": lambda row: row.paper or "",
}


def markdown_table(experiment: Experiment, rows: Sequence[RowSummary]) -> str:
    """The table of an experiment; columns without any value are left out."""
    columns = ACCURACY if experiment.config.measure == "accuracy" else SPEED
    texts = {title: [cell(row) if _done(row) else "" for row in rows] for title, cell in columns.items()}
    texts = {title: cells for title, cells in texts.items() if any(cell not in ("", "nan") for cell in cells)}
    lines = [f"| {experiment.config.axis} | " + " | ".join(texts) + " |", "|---" * (1 + len(texts)) + "|"]
    for k, row in enumerate(rows):
        lines.append(f"| {row.name} | " + " | ".join(cells[k] for cells in texts.values()) + " |")
    return "\n".join(lines + [f"\nfailed, {row.name}: {reason}" for row in rows for reason in row.failed])


def recordings_table(experiment: Experiment, rows: Sequence[RowSummary]) -> str:
    """The mean error of every row on every recording."""
    names = list(dict.fromkeys(name for row in rows for name in row.by_recording))
    head = [f"| {experiment.config.axis} | " + " | ".join(names) + " |", "|---" * (1 + len(names)) + "|"]
    value = lambda row, name: f"{row.by_recording[name]:.1f}" if name in row.by_recording else "failed"
    return "\n".join([*head, *(f"| {row.name} | " + " | ".join(value(row, n) for n in names) + " |" for row in rows)])


def difference_words(row: RowSummary) -> str:
    """The difference to the reference with its interval, or that it does not show."""
    if row.difference is None:
        return "reference"
    low, high = row.difference.interval
    number = f"{row.difference.mean:+.1f} ({low:+.1f} to {high:+.1f})"
    return number if row.difference.shows else f"does not show: {number}"


def findings(experiment: Experiment, rows: Sequence[RowSummary]) -> list[str]:
    """What the experiment says in words: the best row, which differences show, and what the paper's best was."""
    done = [row for row in rows if np.isfinite(row.mean)]
    if not done or experiment.config.measure != "accuracy":
        return []
    best = min(done, key=lambda row: row.mean)
    shown = [row.name for row in done if row.difference is not None and row.difference.shows]
    hidden = [row.name for row in done if row.difference is not None and not row.difference.shows]
    reference = experiment.config.reference
    lines = [f"Smallest mean error: {best.name} ({best.mean:.1f} mm)."]
    if shown:
        lines.append(f"Differences to {reference!r} that show: {', '.join(shown)}.")
    if hidden:
        lines.append(f"Differences to {reference!r} that do not show: {', '.join(hidden)}.")
    papers = [row for row in rows if row.paper_value is not None]
    if papers:
        lines.append(f"The paper's best: {min(papers, key=lambda row: row.paper_value or 0.0).name}.")
    return lines


def _done(row: RowSummary) -> bool:
    return bool(row.by_recording)


def _range(low: float, high: float) -> str:
    return f"{low:.1f} to {high:.1f}"


def _rate(row: RowSummary, stage: str) -> str:
    return f"{row.rates.get(stage, float('nan')):.1f}"


def _waiting(row: RowSummary) -> str:
    return f"{1000.0 / row.rates.get('decode', float('nan')):.1f}"
