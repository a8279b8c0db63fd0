"""The section of an experiment: every method in one table, then each in full, a chart and what it says."""

from collections.abc import Sequence

from sogjax.study.document import Section
from sogjax.study.done import Done
from sogjax.study.experiment import OVERVIEW, Experiment
from sogjax.study.methods import Rows, comparison_table, overview_table
from sogjax.study.pictures import experiment_chart
from sogjax.study.study import Study
from sogjax.study.summary import RowSummary
from sogjax.study.table import findings, iterations_table, markdown_table, recordings_table


def experiment_section(experiment: Experiment, study: Study, done: list[Done]) -> Section:
    """An experiment's tables, chart and findings; its runs are added to `done`."""
    for method in experiment.methods:
        done += [Done(experiment, method, *run) for run in study.records(experiment, method)]
    rows = {method: study.summary(experiment, method) for method in experiment.methods}
    chart = experiment_chart(experiment, rows)
    return Section(experiment.config.title, _parts(experiment, rows, study), [chart] if chart else [])


def _parts(experiment: Experiment, rows: Rows, study: Study) -> list[str]:
    config = experiment.config
    parts = [_question(experiment)]
    if config.methods:
        parts += [comparison_table(experiment, rows)]
    if experiment.name == OVERVIEW:
        parts += [overview_table([row for row in of_method if row.by_recording]) for of_method in rows.values()]
        parts += [
            f"failed, {row.name}: {reason}" for of_method in rows.values() for row in of_method for reason in row.failed
        ]
    for method, of_method in rows.items():
        parts += _of_method(experiment, method, of_method)
    parts += [config.note] if config.note else []
    parts += [f"The paper's figures: {config.paper_note}."] if config.paper_note else []
    parts += [config.remark] if config.remark and study.is_committed else []
    return parts


def _question(experiment: Experiment) -> str:
    base = f" All rows: `{' '.join(experiment.config.base)}`." if experiment.config.base else ""
    script = f" (`python experiments/study.py {experiment.name}`)" if experiment.is_shipped else ""
    return f"{experiment.config.question}{script}{base}"


def _of_method(experiment: Experiment, method: str, rows: Sequence[RowSummary]) -> list[str]:
    """One method's rows in full."""
    title = f"**{method[:1].upper()}{method[1:]}** (`{' '.join(experiment.methods[method]) or 'preset=default'}`):"
    parts = [title] if method else []
    if not any(row.by_recording for row in rows):
        return [*parts, *(f"failed, {row.name}: {reason}" for row in rows for reason in row.failed)]
    parts += [] if experiment.name == OVERVIEW else [markdown_table(experiment, rows)]
    if experiment.config.measure == "accuracy" and experiment.config.reference is not None:
        parts += ["Mean error on each recording, mm:", recordings_table(experiment, rows)]
    if experiment.config.iterations_by_recording:
        parts += ["Iterations per frame on each recording:", iterations_table(experiment, rows)]
    said = findings(experiment, rows)
    return [*parts, *(["\n".join(f"- {line}" for line in said)] if said else [])]
