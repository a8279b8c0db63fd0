"""Plots for a page, drawn by matplotlib as SVG within it, in colours that the page's style decides.

matplotlib is imported where a figure is made, since it is slow to import.
"""

import io
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

from sogjax.view.page.document import text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLORS = {
    "ink": "#010203",
    "muted": "#010204",
    "line": "#010205",
    "accent": "#010206",
    "left": "#010207",
    "right": "#010208",
    "bad": "#010209",
    "good": "#01020a",
}
"""What stands in a figure for each of the style's colours."""
FONT = 11.0
"""Pixels."""
_INCH = 72.0
"""Pixels of an SVG."""


@dataclass(frozen=True)
class Curves:
    """One panel: some curves over the frames."""

    title: str
    unit: str
    curves: Mapping[str, Float[np.ndarray, "frame"]]
    """By colour of the style."""


def curve_plots(frames: Int[np.ndarray, "frame"], panels: Sequence[Curves], names: Mapping[str, str]) -> str:
    """Panels side by side, as many as the page has room for; `names` are those of the colours."""
    return f'<div class="panels">{"".join(_panel(frames, panel, names) for panel in panels)}</div>'


def _panel(frames: Int[np.ndarray, "frame"], panel: Curves, names: Mapping[str, str]) -> str:
    drawn = new_figure(340.0, 150.0)
    axes = drawn.add_axes((0.125, 0.15, 0.855, 0.70))
    values = np.concatenate([*panel.curves.values()])
    for color, curve in panel.curves.items():
        axes.plot(frames, curve, color=COLORS[color], linewidth=1.3, solid_joinstyle="round")
    axes.set_title(f"{panel.title}, {panel.unit}", loc="left", fontsize=FONT, color=COLORS["ink"], pad=5)
    style(axes, frames)
    axes.locator_params(axis="y", nbins=4)
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = max(0.06 * (high - low), 0.02 if panel.unit == "m/s" else 1.0)
    axes.set_ylim(0.0 if panel.unit == "m/s" else low - margin, high + margin)
    of_each = "; ".join(
        f"{names.get(color, '') + ' ' if len(panel.curves) > 1 else ''}{np.nanmin(curve):.3g} to {np.nanmax(curve):.3g}"
        for color, curve in panel.curves.items()
    )
    return plot(drawn, axes, frames, f"{panel.title} over the frames, {panel.unit}: {of_each}")


def new_figure(width: float, height: float) -> "Figure":
    """An empty, transparent figure of a size in pixels."""
    from matplotlib.figure import Figure

    found = Figure(figsize=(width / _INCH, height / _INCH), dpi=_INCH)
    found.patch.set_alpha(0.0)
    return found


def style(axes: "Axes", frames: Int[np.ndarray, "frame"], labels: bool = True) -> None:
    """Quiet axes over the frames of a clip."""
    axes.patch.set_alpha(0.0)
    for side, spine in axes.spines.items():
        spine.set_visible(side == "bottom")
        spine.set_color(COLORS["line"])
    axes.grid(axis="y", color=COLORS["line"], linewidth=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(length=0, labelsize=FONT - 1, labelcolor=COLORS["muted"], labelbottom=labels)
    axes.locator_params(axis="x", nbins=5, integer=True)
    axes.set_xlim(*span(frames))


def span(frames: Int[np.ndarray, "frame"]) -> tuple[float, float]:
    """The left and right end of the axis of frames, each of which is as wide as their distance."""
    half = 0.5 * float(frames[1] - frames[0]) if len(frames) > 1 else 0.5
    return float(frames[0]) - half, float(frames[-1]) + half


def plot(drawn: "Figure", axes: "Axes", frames: Int[np.ndarray, "frame"], description: str, kind: str = "") -> str:
    """A figure as HTML that can be clicked: `axes` say where its frames are."""
    box, (first, last) = axes.get_position(), span(frames)
    place = f'data-left="{box.x0:.4f}" data-right="{box.x1:.4f}" data-first="{first:g}" data-last="{last:g}"'
    return f'<div class="plot {kind}" {place}>{svg(drawn, description)}<i class="cursor"></i></div>'


def svg(drawn: "Figure", description: str) -> str:
    """A figure as an SVG element with a description."""
    from matplotlib import rc_context

    stream = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "page", "path.simplify_threshold": 0.3}):
        drawn.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
    content = stream.getvalue()
    content = content[content.index("<svg") :]
    content = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", content, flags=re.DOTALL)
    content = re.sub(r'\sid="(?![mpic][0-9a-f]{6,}|image)[^"]*"', "", content)  # names of groups, used by nobody
    content = re.sub(r"font: ([\d.]+)px [^;\"]*", r"font-size: \1px", content)
    for color, stand_in in COLORS.items():
        content = content.replace(stand_in, f"var(--{color})")
    label = text(description)
    head = re.search(r'viewBox="[^"]*"', content)
    assert head is not None
    tag = f'<svg role="img" aria-label="{label}" {head[0]}>'
    return re.sub(r"\n\s*", "\n", tag + content[content.index(">") + 1 :])
