"""A chart of searches: what they said of their poses, and how far off these were."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from sogjax.view.charts import INK, PAPER, new_figure, png_of

MM = 1000.0
_LEAST = 1e-4
"""Confidences below this are drawn there: their axis is logarithmic."""


@dataclass(frozen=True)
class Reliability:
    """Poses in the order of their confidence."""

    confidence: Float[np.ndarray, "search"]
    error: Float[np.ndarray, "search"]
    """Metres, mean over the joints."""
    sure: Bool[np.ndarray, "search"]
    right: Bool[np.ndarray, "search"]
    bins: Sequence[tuple[int, int]]
    """First search and the one after the last of each."""
    limit: float
    """Metres, above which a pose is wrong."""


def reliability_chart(found: Reliability) -> bytes:
    """Errors over confidence, and the share of right poses in bins of confidence (PNG)."""
    figure = new_figure((8.4, 3.6))
    errors, shares = figure.subplots(1, 2)
    confidence = np.maximum(found.confidence, _LEAST)
    for chosen, marker, label in ((found.sure, "o", "sure"), (~found.sure, "x", "not sure")):
        for right, color in ((True, INK), (False, "#d62728")):
            those = chosen & (found.right == right)
            words = f"{label}, {'right' if right else 'wrong'}: {int(those.sum())}"
            errors.plot(confidence[those], MM * found.error[those], marker, color=color, markersize=4, label=words)
    errors.axhline(MM * found.limit, color=PAPER, linewidth=0.8, linestyle="--")
    errors.set(xscale="log", yscale="log", xlabel="confidence", ylabel="mean joint error, mm")
    errors.legend(fontsize=7, frameon=False)
    middles = [float(np.median(confidence[first:stop])) for first, stop in found.bins]
    right = [float(found.right[first:stop].mean()) for first, stop in found.bins]
    shares.plot(middles, right, "o-", color=INK, markersize=4)
    for middle, share, (first, stop) in zip(middles, right, found.bins, strict=True):
        shares.annotate(f"{stop - first}", (middle, share), xytext=(0, 5), textcoords="offset points", fontsize=6)
    shares.set(xscale="log", ylim=(0.0, 1.08), xlabel="confidence (median of a bin)", ylabel="share of right poses")
    for panel in (errors, shares):
        panel.grid(color="#e4e4e4")
    return png_of(figure)
