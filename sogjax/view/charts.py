"""Charts of experiments, sweeps and judgements, as PNG.

They are drawn by matplotlib, which is imported where a figure is made, since it is slow to import.
"""

import io
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, REFERENCE, WRONG = "#1f77b4", "#444444", "#d62728"
"""Colours of what was measured, of what it is compared with, and of what is wrong or failed."""

DPI = 90


@dataclass(frozen=True)
class Means:
    """One panel of means with their intervals."""

    names: Sequence[str]
    """The rows, from left to right."""
    means: Sequence[float]
    intervals: Sequence[tuple[float, float]]
    """Low and high of each mean."""
    title: str = "here"
    members: Mapping[str, Sequence[float]] = field(default_factory=dict)
    """Further values by name, drawn as faint lines, such as the means on each recording."""


def mean_chart(panels: Sequence[Means], *, axis: str, value: str, paper: Mapping[str, float] | None = None) -> bytes:
    """Means with their intervals, with the paper's figures in a panel of their own.

    Args:
        panels: what is drawn, one panel each.
        axis: what differs between the rows.
        value: what the means are, with their unit.
        paper: the paper's figures by row.
    """
    ratios = [2.0] * len(panels) + [1.0] * bool(paper)
    members = dict.fromkeys(name for panel in panels for name in panel.members)
    colors = {name: f"C{1 + number % 9}" for number, name in enumerate(members)}
    figure = new_figure(max(7.2, 1.5 * sum(ratios)) + 0.9 * bool(members), 2.8)
    drawn = figure.subplots(1, len(ratios), squeeze=False, width_ratios=ratios)[0]
    lines = {}
    for axes, panel in zip(drawn, panels, strict=False):
        for name, values in panel.members.items():
            if np.isfinite(values).any():
                lines[name] = axes.plot(values, color=colors[name], alpha=0.5, linewidth=1)[0]
        middle, bounds = np.asarray(panel.means, float), np.asarray(panel.intervals, float)
        spread = np.clip(np.stack([middle - bounds[:, 0], bounds[:, 1] - middle]), 0.0, None)
        axes.errorbar(range(len(middle)), middle, yerr=np.nan_to_num(spread), fmt="o", color=INK, capsize=4)
        _label_rows(axes, panel.names, axis, value, panel.title)
    if paper:
        drawn[-1].plot(list(paper.values()), "s-", color=REFERENCE)
        _label_rows(drawn[-1], list(paper), axis, value, "the paper")
    if lines:
        figure.legend(lines.values(), lines, loc="outside right center", fontsize=6, frameon=False)
    return png(figure)


def _label_rows(axes: "Axes", names: Sequence[str], axis: str, value: str, title: str) -> None:
    letters = max((len(name) for name in names), default=0) * len(names)
    crowded = letters > 10 * axes.bbox.width / DPI
    axes.set_xticks(range(len(names)), names, rotation=30 if crowded else 0, ha="right" if crowded else "center")
    axes.set(xlabel=axis, ylabel=value, ylim=(0.0, 1.06 * axes.get_ylim()[1]))  # room for a whole marker at the top
    axes.set_title(title, fontsize=9)
    grid(axes)


@dataclass(frozen=True)
class Bars:
    """One panel of bars: a value for every method and row, NaN where there is none."""

    title: str
    rows: Sequence[str]
    values: Mapping[str, Sequence[float]]
    failed: Collection[int] = ()
    """The numbers of the rows for which the word "failed" stands instead of bars."""


def bar_chart(panels: Sequence[Bars], *, value: str) -> bytes:
    """Bars by row and method, a panel below the other; `value` says what they are, with their unit."""
    longest = max(len(panel.rows) for panel in panels)
    figure = new_figure(min(max(6.0, 0.45 * longest), 90.0), 3.2 * len(panels))
    every = 1 + longest // 200  # the names of more rows would overlap
    for axes, panel in zip(figure.subplots(len(panels), 1, squeeze=False)[:, 0], panels, strict=True):
        places, width = np.arange(len(panel.rows)), 0.8 / len(panel.values)
        for k, (name, values) in enumerate(panel.values.items()):
            axes.bar(places + width * (k + 0.5) - 0.4, values, width, label=name)
        for row in panel.failed:
            axes.text(row, 0.0, " failed", rotation=90, ha="center", va="bottom", color=WRONG)
        axes.set_xlim(-0.5, len(panel.rows) - 0.5)
        axes.set_xticks(places[::every], [name[:40] for name in panel.rows[::every]], rotation=30, ha="right")
        axes.set_ylabel(value)
        axes.set_title(panel.title, fontsize=9)
        axes.set_axisbelow(True)
        grid(axes, legend=any(panel.values))
    return png(figure)


@dataclass(frozen=True)
class LimbCurve:
    """What was said of limbs, and what was found."""

    false_alarms: Float[np.ndarray, "threshold"]
    """The part of the limbs in their places that are above each threshold."""
    noticed: Float[np.ndarray, "threshold"]
    """The part of the lost ones that are."""
    area: float
    said: Float[np.ndarray, "bin"]
    """Mean probability in bins."""
    found: Float[np.ndarray, "bin"]
    """The part of the bin that is lost."""


def limb_chart(curves: Mapping[str, LimbCurve]) -> bytes:
    """The ROC curve, and shares that were found lost against those that were said, for groups of frames by name."""
    figure = new_figure(8.4, 3.8)
    roc, shares = figure.subplots(1, 2)
    for name, curve in curves.items():
        roc.plot(curve.false_alarms, curve.noticed, linewidth=1.4, label=f"{name}: {curve.area:.3f}")
        shares.plot(curve.said, curve.found, "o-", markersize=4, linewidth=1.0)
    roc.set_xscale("symlog", linthresh=0.01)
    roc.set_xticks([0.0, 0.01, 0.1, 1.0], ["0", "0.01", "0.1", "1"])
    roc.set(xlim=(0.0, 1.0), ylim=(0.0, 1.02), xlabel="false alarms", ylabel="lost limbs noticed")
    roc.legend(title="area under the curve", fontsize=7, title_fontsize=7, frameon=False, loc="lower right")
    shares.plot([0.0, 1.0], [0.0, 1.0], "--", color=REFERENCE, linewidth=0.8)
    shares.set(xlim=(0.0, 1.0), ylim=(0.0, 1.02), xlabel="probability said", ylabel="share found lost")
    grid(roc, "both")
    grid(shares, "both")
    return png(figure)


def grid(axes: "Axes", which: str = "y", legend: bool = False) -> None:
    """Lines of a grid behind the curves, and a legend on request."""
    axes.grid(axis=which, color="#e4e4e4")  # pyright: ignore[reportArgumentType]
    if legend:
        axes.legend(fontsize=7, frameon=False)


def new_figure(width: float, height: float) -> "Figure":
    """An empty figure of a size in inches, which needs no display."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context({"font.size": 8}):
        return Figure(figsize=(width, height), dpi=DPI, layout="constrained")


def png(figure: "Figure") -> bytes:
    """A figure as the bytes of its file."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    return stream.getvalue()
