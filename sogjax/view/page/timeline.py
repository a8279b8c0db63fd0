"""The timeline of a motion: what of the actor is explained, and how sure each limb is, over the frames."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.io.motion import Motion
from sogjax.quality.metrics import stretches
from sogjax.view.page.plots import COLORS, FONT, new_figure, plot, span, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTHS = {"large": 680.0, "small": 350.0}
"""Pixels of the timeline of a large and of a small screen."""
ROW, CURVE = {"large": 34.0, "small": 26.0}, {"large": 130.0, "small": 96.0}
"""Pixels of a limb's row, and of the curve above them, by size."""


@dataclass(frozen=True)
class Marks:
    """Stretches of limbs that a reader should know of."""

    hidden: Bool[np.ndarray, "frame limb"]
    """Seen in too few pictures to be placed."""
    revised: Bool[np.ndarray, "frame limb"]
    """Taken from another pass over the clip."""


def timeline(motion: Motion, marks: Marks, expected: float | None) -> str:
    """The timeline of one actor in both sizes, of which the style shows one; `expected` is what examples explain."""
    return "".join(_drawn(motion, marks, expected, kind, width) for kind, width in WIDTHS.items())


def _drawn(motion: Motion, marks: Marks, expected: float | None, kind: str, width: float) -> str:
    names = [] if motion.limb_names is None else [str(name).rpartition("/")[2] for name in motion.limb_names]
    rows, curve, above, below = ROW[kind] * len(names), CURVE[kind], 22.0, 22.0
    height = above + curve + (10.0 + rows if names else 0.0) + below
    drawn = new_figure(width, height)
    left, right = max(6.2 * max(map(len, names), default=0) + 10.0, 40.0) / width, 1.0 - 14.0 / width
    upper = drawn.add_axes((left, 1.0 - (above + curve) / height, right - left, curve / height))
    title = _curve(upper, motion, expected)
    upper.set_title(title, loc="left", fontsize=FONT, color=COLORS["ink"], pad=6)
    style(upper, motion.frame, labels=not names)
    upper.set_ylim(0.0, max(upper.get_ylim()[1], 1e-3))
    if names:
        limbs = drawn.add_axes((left, below / height, right - left, rows / height))
        _limbs(limbs, motion, marks, names)
    return plot(drawn, upper, motion.frame, _described(motion, names, title), kind)


def _curve(axes: "Axes", motion: Motion, expected: float | None) -> str:
    """The curve above the limbs; what it is."""
    if motion.explained is None:
        axes.plot(motion.frame, motion.similarity, color=COLORS["accent"], linewidth=1.4)
        return "similarity of the body to the pictures"
    axes.fill_between(motion.frame, 0.0, 100.0 * motion.explained, color=COLORS["accent"], alpha=0.18, linewidth=0)
    axes.plot(motion.frame, 100.0 * motion.explained, color=COLORS["accent"], linewidth=1.4)
    if expected is None:
        return "explained, %"
    axes.axhline(100.0 * expected, color=COLORS["muted"], linewidth=1.0, linestyle=(0, (4, 3)))
    return "explained, % (dashed: in the example poses)"


def _limbs(axes: "Axes", motion: Motion, marks: Marks, names: list[str]) -> None:
    assert motion.limb_doubt is not None
    low, high = span(motion.frame)
    count = len(names)
    for row in range(count):
        strip = confidence_colors(1.0 - motion.limb_doubt[:, row])[None]
        extent = (low, high, row + 0.84, row + 0.16)
        axes.imshow(strip, extent=extent, aspect="auto", interpolation="nearest")  # pyright: ignore[reportArgumentType]
    for limb, row in enumerate(range(count)):
        hidden = _spans(motion.frame, marks.hidden[:, limb])
        look: dict[str, Any] = {"facecolors": "none", "edgecolors": COLORS["ink"], "linewidth": 0.0}
        axes.broken_barh(hidden, (row + 0.16, 0.68), hatch="//////", **look)
        revised = _spans(motion.frame, marks.revised[:, limb])
        axes.broken_barh(revised, (row + 0.88, 0.10), facecolors=COLORS["ink"], linewidth=0.0)
    style(axes, motion.frame)
    axes.grid(visible=False)
    axes.set_ylim(count, 0.0)
    axes.set_yticks(np.arange(count) + 0.5, names)


def _spans(frames: Int[np.ndarray, "frame"], marked: Bool[np.ndarray, "frame"]) -> list[tuple[float, float]]:
    """Begin and width of each marked stretch."""
    half = span(frames)
    step = (half[1] - half[0]) / len(frames)
    return [(half[0] + first * step, (stop - first) * step) for first, stop in stretches(marked, 1)]


def confidence_colors(confidence: Float[np.ndarray, "frame"]) -> Float[np.ndarray, "frame 4"]:
    """Sure is a quiet green, half is amber, lost is red; readable before white and black."""
    places = np.array([0.0, 0.4, 0.6, 0.85, 1.0])
    colors = np.array(
        [[0.78, 0.16, 0.16, 1], [0.88, 0.38, 0.16, 1], [0.93, 0.66, 0.22, 1], [0.45, 0.69, 0.57, 0.9],
         [0.27, 0.60, 0.52, 0.75]]
    )  # fmt: skip
    return np.stack([np.interp(np.clip(confidence, 0.0, 1.0), places, channel) for channel in colors.T], axis=-1)


def _described(motion: Motion, names: list[str], title: str) -> str:
    """The timeline in words."""
    frames = f"frames {motion.frame[0]} to {motion.frame[-1]}"
    if motion.limb_doubt is None:
        return f"Timeline of {frames}: {title}"
    worst = 1.0 - motion.limb_doubt.max(axis=0)
    told = ", ".join(f"{name} at least {value:.0%}" for name, value in zip(names, worst.tolist(), strict=True))
    return f"Timeline of {frames}: {title}; confidence of the limbs: {told}"
