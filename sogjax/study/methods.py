"""The methods that a report compares: by what their settings differ, and their results side by side."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from sogjax.run.build import color_space_and_radius
from sogjax.settings.compose import track_config
from sogjax.settings.run import TrackConfig
from sogjax.solve.ascent import ConditionedAscent
from sogjax.study.experiment import Experiment
from sogjax.study.summary import RowSummary
from sogjax.study.table import ruled_table, significance

Rows = Mapping[str, Sequence[RowSummary]]
"""The rows of an experiment, by method."""

PRESETS = {"paper's method": "paper", "ours": "default"}
"""The methods of the report, and their presets."""


def settings_table() -> str:
    """What every method of the report is, in Markdown: the settings that differ come first."""
    configs = [track_config(recording="RECORDING", preset=preset) for preset in PRESETS.values()]
    titles = ["", *(f"{name} (`preset={preset}`)" for name, preset in PRESETS.items())]
    lines = [[title, *map(words, configs)] for title, words in _SETTINGS.items()]
    return ruled_table([titles, *sorted(lines, key=lambda line: len(set(line[1:])) == 1)])


def comparison_table(experiment: Experiment, rows: Rows) -> str:
    """The paper's figure and every method's results, a line for each row of the experiment, in Markdown."""
    if experiment.config.reference is None:
        return _sequences_table(experiment, rows)
    titles = [experiment.config.axis, "the paper"]
    titles += [f"{method}: {title}" for method in rows for title in _RESULTS]
    lines = [titles]
    for name, row in experiment.config.rows.items():
        found = [next((one for one in of_method if one.name == name), None) for of_method in rows.values()]
        if any(found):
            lines.append([name, row.paper, *(cell(one) for one in found for cell in _RESULTS.values())])
    return ruled_table(lines)


def _sequences_table(experiment: Experiment, rows: Rows) -> str:
    """Joints, markers and lost stretches of rows with recordings of their own, and of all with so many cameras."""
    methods = [{row.name: row for row in of_method} for of_method in rows.values()]
    lines = [[experiment.config.axis, *(f"{method}: {title}" for method in rows for title in _SEQUENCE)]]
    cameras = {name: row.cameras for name, row in experiment.config.rows.items()}
    for count in dict.fromkeys(cameras.values()):
        names = [name for name in cameras if cameras[name] == count and any(name in found for found in methods)]
        lines += [_sequences_line(name, [name], methods) for name in names]
        worked = [name for name in names if all(name not in found or found[name].by_recording for found in methods)]
        title = f"**all {len(worked)} that worked, {'all' if count is None else count} cameras**"
        lines += [_sequences_line(title, worked, methods)] if worked else []
    return ruled_table(lines)


def _sequences_line(title: str, names: Sequence[str], methods: Sequence[Mapping[str, RowSummary]]) -> list[str]:
    """One line for some rows together; empty cells where a method was not run with them."""
    parts = [[found[name] for name in names if name in found] for found in methods]
    return [title, *(cell(part) if part else "" for part in parts for cell in _SEQUENCE.values())]


def overview_table(rows: Sequence[RowSummary]) -> str:
    """One line per method, with both rules of attaching markers, in Markdown."""
    lines = [["", *_OVERVIEW], *([row.name, *(cell(row) for cell in _OVERVIEW.values())] for row in rows)]
    return ruled_table(lines)


def _solver(config: TrackConfig) -> str:
    solver, ascent = config.solver, ConditionedAscent()
    factors = f", mu+ {float(ascent.grow):g}, mu- {float(ascent.shrink):g}"
    steps = factors if solver.method == "conditioned_ascent" else ""
    least = f"n_iter {solver.min_iterations}, epsilon {solver.epsilon:g}"
    name = {"gauss_newton": "Gauss-Newton"}.get(solver.method, solver.method.replace("_", " "))
    return f"{name}{steps}, {least}"


def _colors(config: TrackConfig) -> str:
    space, radius = color_space_and_radius(config.color)
    return f"{space}, eps_sim {radius:g}"


_SETTINGS: dict[str, Callable[[TrackConfig], str]] = {
    "solver": _solver,
    "weights": lambda c: f"w_l {c.energy.limit_weight:g}, w_a {c.energy.acceleration_weight:g}",
    "colours": _colors,
    "quad-tree": lambda c: f"depth {c.images.depth}, eps_col {c.images.color_tolerance:g}",
    "background": lambda c: {
        "none": "not used",
        "auto": "empty background pictures (plates), else learnt from the clip",
        "pictures": "empty background pictures (plates)",
        "clip": "learnt from the clip",
    }[c.images.background],
    "Eq. 6": lambda c: {"printed": "as printed", "exact": "with the 1/2 of Eq. 2"}[c.energy.overlap_exponent],
    "Eq. 8": lambda c: "capped" if c.energy.capped else "not capped",
    "pairs of blobs": lambda c: {"dense": "all", "sparse": "near ones"}[c.energy.pairs],
    "culling box": lambda c: {"last": "of the last pose"}.get(c.images.box_around, "of the last and predicted pose"),
    "prediction": lambda c: f"alpha {c.tracking.extrapolation:g}",
}


def _result(cell: Callable[[RowSummary], str]) -> Callable[[RowSummary | None], str]:
    return lambda row: "" if row is None else cell(row) if row.by_recording else "failed"


_RESULTS: dict[str, Callable[[RowSummary | None], str]] = {
    "error, mm": _result(lambda row: f"{row.mean:.1f}"),
    "closest rule, mm": _result(lambda row: f"{row.closest:.1f}"),
    "difference": _result(lambda row: significance(row)),
    "lost": _result(lambda row: str(row.lost)),
    "iterations": _result(lambda row: f"{row.iterations:.1f}"),
}
_SEQUENCE: dict[str, Callable[[Sequence[RowSummary]], str]] = {
    "joints, mm": lambda rows: _mean(rows, lambda row: row.joints),
    "markers, mm": lambda rows: _mean(rows, lambda row: row.mean),
    "lost": lambda rows: str(sum(row.lost for row in rows)) if _worked(rows) else "",
}
_OVERVIEW: dict[str, Callable[[RowSummary], str]] = {
    "the paper": lambda row: row.paper,
    "error by the closest rule, mm": lambda row: f"{row.closest:.1f} +- {row.closest_std:.1f}",
    "error by the scaled rule, mm": lambda row: f"{row.mean:.1f} +- {row.std:.1f}",
    "difference": significance,
    "joints, mm": lambda row: f"{row.joints:.1f}",
    "lost": lambda row: str(row.lost),
    "iterations": lambda row: f"{row.iterations:.1f}",
    "not converged": lambda row: str(row.not_converged),
    "tracking step, frames/s": lambda row: f"{1000.0 / row.milliseconds:.1f}",
    "failed": lambda row: str(len(row.failed)),
}


def _worked(rows: Sequence[RowSummary]) -> bool:
    return all(row.by_recording for row in rows)


def _mean(rows: Sequence[RowSummary], value: Callable[[RowSummary], float]) -> str:
    return f"{np.mean([value(row) for row in rows]):.1f}" if _worked(rows) else "failed"
