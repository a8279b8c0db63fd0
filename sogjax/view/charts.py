"""Charts of studies, drawn with matplotlib (the extra `report`): means with their intervals, calibration curves."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from sogjax.errors import InputError

INK, PAPER, OTHERS = "#1f77b4", "#444444", "#b8c4d0"
_SIZE = (7.2, 2.8)
"""Inches."""
_DPI = 90
_NAME_HEIGHT = 0.06
"""Of a line of text beside a panel, in units of the panel's height."""


@dataclass(frozen=True)
class Means:
    """The means of one panel of a chart."""

    names: Sequence[str]
    """Of the rows, from left to right."""
    means: Sequence[float]
    """One per row."""
    intervals: Sequence[tuple[float, float]]
    """Low and high of each mean."""
    title: str = "here"
    members: Mapping[str, Sequence[float]] = field(default_factory=dict)
    """Further values by name, drawn as faint lines, such as the means on each recording."""


def mean_chart(panels: Sequence[Means], *, axis: str, value: str, paper: Mapping[str, float] | None = None) -> bytes:
    """Means with their intervals beside the paper's figures, as a PNG.

    Args:
        panels: what is drawn, one panel each.
        axis: what differs between the rows.
        value: what the means are, with their unit.
        paper: the paper's figures by row, in a panel of their own.
    """
    ratios = [2.0] * len(panels) + [1.0] * bool(paper)
    figure = new_figure((max(_SIZE[0], 1.5 * sum(ratios)), _SIZE[1]))
    drawn = figure.subplots(1, len(ratios), squeeze=False, width_ratios=ratios)[0]
    for panel, content in zip(drawn, panels, strict=False):
        _draw_means(panel, content.means, content.intervals, content.members)
        _finish(panel, content.names, axis, value, content.title)
        _name_lines(panel, content.members)
    if paper:
        drawn[-1].plot(range(len(paper)), list(paper.values()), "s-", color=PAPER)
        _finish(drawn[-1], list(paper), axis, value, "the paper")
    return png_of(figure)


def _draw_means(
    panel: Any,
    means: Sequence[float],
    intervals: Sequence[tuple[float, float]],
    members: Mapping[str, Sequence[float]],
) -> None:
    places = np.arange(len(means))
    for values in members.values():
        panel.plot(places, values, "-", color=OTHERS, linewidth=1)
    middle, bounds = np.asarray(means, float), np.asarray(intervals, float)
    spread = np.clip(np.stack([middle - bounds[:, 0], bounds[:, 1] - middle]), 0.0, None)
    panel.errorbar(places, middle, yerr=np.nan_to_num(spread), fmt="o", color=INK, capsize=4)


def _name_lines(panel: Any, members: Mapping[str, Sequence[float]]) -> None:
    """The names of the lines right of the panel, at the heights where they end, or as near as a line of text allows."""
    last = {name: np.asarray(values, float)[np.isfinite(values)][-1:] for name, values in members.items()}
    named = sorted((name for name, end in last.items() if end.size), key=lambda name: float(last[name][0]))
    top = panel.get_ylim()[1]
    heights = spaced([float(last[name][0]) / top for name in named], _NAME_HEIGHT)
    for name, height in zip(named, heights, strict=True):
        place, beside = (1.0, height), {"xytext": (4, 0), "textcoords": "offset points"}
        panel.annotate(name, place, xycoords="axes fraction", va="center", fontsize=6, color=PAPER, **beside)


def spaced(heights: Sequence[float], apart: float) -> list[float]:
    """Ascending heights moved apart: upward, but not above 1, and downward where there is no room."""
    moved = list(heights)
    for k in range(1, len(moved)):
        moved[k] = max(moved[k], moved[k - 1] + apart)
    ceiling = 1.0
    for k in reversed(range(len(moved))):
        moved[k] = min(moved[k], ceiling)
        ceiling = moved[k] - apart
    return moved


def _finish(panel: Any, names: Sequence[str], axis: str, value: str, title: str) -> None:
    width = panel.get_position().width * panel.figure.get_figwidth()
    crowded = max((len(name) for name in names), default=0) * len(names) > 10 * width
    panel.set_xticks(range(len(names)), names, rotation=30 if crowded else 0, ha="right" if crowded else "center")
    panel.set_xlabel(axis)
    panel.set_ylabel(value)
    panel.set_title(title, fontsize=9)
    panel.set_ylim(0.0, 1.06 * panel.get_ylim()[1])  # room for a whole marker at the top
    panel.grid(axis="y", color="#e4e4e4")


def new_figure(size: tuple[float, float] = _SIZE) -> Any:
    """An empty figure that needs no display.

    Raises:
        InputError: matplotlib is not installed.
    """
    try:
        from matplotlib import rc_context
        from matplotlib.figure import Figure
    except ImportError as error:
        raise InputError("charts need matplotlib; install it with pip install 'sogjax[report]'") from error
    with rc_context({"font.size": 8}):
        return Figure(figsize=size, dpi=_DPI, layout="constrained")


def png_of(figure: Any) -> bytes:
    """The picture of a figure."""
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    return stream.getvalue()
