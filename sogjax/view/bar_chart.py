"""A chart of rows that are not compared with each other: bars of every method beside each other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from sogjax.view.charts import new_figure, png_of

_INCHES, _LEAST, _HEIGHT = 0.45, 4.0, 3.2
"""Width of a row's bars, of a panel at least, and height of a panel."""
_BARS = 0.8
"""Part of a row's width that bars fill."""


@dataclass(frozen=True)
class Bars:
    """One panel: a value for every method and row, NaN where there is none."""

    title: str
    rows: Sequence[str]
    values: Mapping[str, Sequence[float]]


def bar_chart(panels: Sequence[Bars], *, value: str) -> bytes:
    """Bars by row and method, a panel below the other (PNG).

    Args:
        panels: what is drawn.
        value: what the values are, with their unit.
    """
    width = max(_LEAST, _INCHES * max(len(panel.rows) for panel in panels))
    figure = new_figure((width, _HEIGHT * len(panels)))
    drawn = figure.subplots(len(panels), 1, squeeze=False)[:, 0]
    for axes, panel in zip(drawn, panels, strict=True):
        places, count = np.arange(len(panel.rows)), len(panel.values)
        for k, (name, values) in enumerate(panel.values.items()):
            axes.bar(places + _BARS * ((k + 0.5) / count - 0.5), values, _BARS / count, label=name)
        axes.set_xticks(places, panel.rows, rotation=30, ha="right")
        axes.set_ylabel(value)
        axes.set_title(panel.title, fontsize=9)
        axes.grid(axis="y", color="#e4e4e4")
        axes.set_axisbelow(True)
        axes.legend(fontsize=7, frameon=False)
    return png_of(figure)
