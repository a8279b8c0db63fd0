"""A chart of rankings: what the true pose is worth more, and the errors of both, over the frames."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from sogjax.view.charts import PAPER, new_figure, png_of

MM = 1000.0
_SHARE = 100.0
_SIZE = (5.2, 7.4)
"""Inches of one column."""

Curve = Float[np.ndarray, "frame"]


@dataclass(frozen=True)
class RankedCurves:
    """One column of the chart: a set of terms."""

    title: str
    frames: Int[np.ndarray, "frame"]
    gain: Curve
    """By what share of the energy the true pose is worth more."""
    gain_by_term: Mapping[str, Curve]
    """The same that each term adds to it."""
    errors: Mapping[str, Curve]
    """Metres, by whose pose."""
    limbs: Mapping[str, tuple[Curve, Curve]]
    """Metres: the tracked pose's and the optimum's error of each limb that differs."""


def ranking_chart(columns: Sequence[RankedCurves]) -> bytes:
    """Differences of energies, joint errors and errors of limbs, a column for each set of terms (PNG)."""
    figure = new_figure((_SIZE[0] * len(columns), _SIZE[1]))
    panels = figure.subplots(3, len(columns), squeeze=False, sharex=True, sharey="row")
    for (worth, errors, limbs), content in zip(panels.T, columns, strict=True):
        worth.set_title(content.title, fontsize=9)
        _draw_worth(worth, content)
        for name, curve in content.errors.items():
            errors.plot(content.frames, MM * curve, label=name, linewidth=1.2)
        for number, (name, (tracked, optimum)) in enumerate(content.limbs.items()):
            limbs.plot(content.frames, MM * tracked, "-", color=f"C{number}", label=name, linewidth=1.2)
            limbs.plot(content.frames, MM * optimum, "--", color=f"C{number}", linewidth=1.0)
        worth.set_ylabel("true pose is worth more, %")
        errors.set_ylabel("mean joint error, mm")
        limbs.set_ylabel("limb (line: tracked, dashed:\noptimum at the truth), mm")
        limbs.set_xlabel("frame")
        for panel in (worth, errors, limbs):
            _finish(panel)
    return png_of(figure)


def _draw_worth(panel: Any, content: RankedCurves) -> None:
    gain = _SHARE * content.gain
    panel.axhline(0.0, color=PAPER, linewidth=0.8)
    panel.fill_between(content.frames, 0.0, gain, where=gain < 0.0, color="#d62728", alpha=0.25, linewidth=0)
    panel.plot(content.frames, gain, color="black", linewidth=1.6, label="energy")
    for name, curve in content.gain_by_term.items():
        panel.plot(content.frames, _SHARE * curve, linewidth=1.0, label=name)


def _finish(panel: Any) -> None:
    panel.grid(axis="y", color="#e4e4e4")
    if panel.get_legend_handles_labels()[0]:
        panel.legend(fontsize=7, frameon=False)
