"""A chart of what was said of limbs: the ROC curve, and shares that were found against those that were said."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sogjax.view.charts import PAPER, new_figure, png_of


@dataclass(frozen=True)
class LimbCurve:
    """Of some frames and limbs."""

    false_alarms: Float[np.ndarray, "threshold"]
    """Part of the limbs in their places that are above each threshold."""
    noticed: Float[np.ndarray, "threshold"]
    """Part of the lost ones that are."""
    area: float
    said: Float[np.ndarray, "bin"]
    """Mean probability in bins."""
    found: Float[np.ndarray, "bin"]
    """Part of the bin that is lost."""


def limb_chart(curves: Mapping[str, LimbCurve]) -> bytes:
    """Both for groups of frames by name (PNG)."""
    figure = new_figure((8.4, 3.8))
    roc, shares = figure.subplots(1, 2)
    for name, curve in curves.items():
        roc.plot(curve.false_alarms, curve.noticed, linewidth=1.4, label=f"{name}: {curve.area:.3f}")
        shares.plot(curve.said, curve.found, "o-", markersize=4, linewidth=1.0, label=name)
    roc.set(xscale="symlog", xlim=(0.0, 1.0), ylim=(0.0, 1.02), xlabel="false alarms", ylabel="lost limbs noticed")
    roc.set_xscale("symlog", linthresh=0.01)
    roc.set_xticks([0.0, 0.01, 0.1, 1.0], ["0", "0.01", "0.1", "1"])
    roc.legend(title="area under the curve", fontsize=7, title_fontsize=7, frameon=False, loc="lower right")
    shares.plot([0.0, 1.0], [0.0, 1.0], "--", color=PAPER, linewidth=0.8)
    shares.set(xlim=(0.0, 1.0), ylim=(0.0, 1.02), xlabel="probability said", ylabel="share found lost")
    for panel in (roc, shares):
        panel.grid(color="#e4e4e4")
    return png_of(figure)
