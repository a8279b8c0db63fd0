"""The runs of a report, as a list and as a file."""

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from sogjax.io.files import atomic_path
from sogjax.study.experiment import Experiment
from sogjax.study.record import RunRecord
from sogjax.study.source import Source

COLUMNS = (
    *("experiment", "method", "row", "recording", "overrides", "error mm", "closest rule mm", "lost"),
    *("ms per step", "seconds", "machine", "failed"),
)


@dataclass(frozen=True)
class Done:
    """One run of the report."""

    experiment: Experiment
    method: str
    row: str
    source: Source
    record: RunRecord


def different(done: Sequence[Done]) -> Iterator[Done]:
    """Each run once: several experiments may have a row in common."""
    seen: set[str] = set()
    for one in done:
        plan = str(one.record.plan)
        if plan not in seen:
            seen.add(plan)
            yield one


def write_runs(path: Path, done: Sequence[Done]) -> Path:
    """Every row on every recording, with its overrides, as CSV."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(COLUMNS)
    for one in done:
        record = one.record
        errors = [f"{value:.2f}" for value in (record.mean_mm, record.closest_mean_mm)]
        times = [f"{value:.2f}" for value in (record.step_ms, record.seconds)]
        words = " ".join(one.experiment.overrides(one.row, method=one.method))
        named = [one.experiment.name, one.method, one.row, one.source.name, words]
        writer.writerow([*named, *errors, record.lost, *times, record.machine, record.failed])
    with atomic_path(path) as temporary:
        temporary.write_text(text.getvalue(), encoding="utf-8")
    return path
