"""Curves of a Rerun file: what was found in each frame."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import rerun as rr

from sogjax.io.motion import Motion
from sogjax.view.bones import LEFT, MIDDLE, RIGHT, actor_palette
from sogjax.view.rerun.stream import entity_part, time_columns

_COLORS = ((90, 170, 255), (255, 170, 60), (120, 220, 120), (255, 110, 120), (190, 140, 255), (240, 220, 90))
_OF_LIMBS = {"doubt_": "doubts", "rival_": "rivals"}
"""What the name of a limb's curve begins with, and its plot."""
_PLOTS = {
    "errors": "Error, mm",
    "energy": "Similarity and energy",
    "penalties": "Penalties",
    "terms": "Further terms of the energy",
    "iterations": "Iterations",
    "doubts": "How likely limbs are more than 10 cm off",
    "rivals": "What the best other way to hold a limb gains, % of the energy",
}


def own_curves(motion: Motion) -> dict[str, np.ndarray]:
    """The curves of a motion that are known; those of each limb where these were judged."""
    curves = {"similarity": motion.similarity, "energy": motion.energy, "iterations": motion.iterations}
    rivals = None if motion.limb_rival is None else 100.0 * motion.limb_rival
    for begins, of_limbs in zip(_OF_LIMBS, (motion.limb_doubt, rivals), strict=True):
        if of_limbs is not None and motion.limb_names is not None:
            names = (begins + str(name).replace(" ", "_") for name in motion.limb_names)
            curves |= dict(zip(names, of_limbs.T, strict=True))
    return {name: values for name, values in curves.items() if np.isfinite(values).any()}


def log_curve_looks(
    stream: rr.RecordingStream, actor: str | None, curves: Mapping[str, np.ndarray], first_color: int
) -> None:
    """Log titles and colours of curves."""
    for k, name in enumerate(curves):
        _log_look(stream, name, actor, _COLORS[(first_color + k) % len(_COLORS)])


def log_body_curve_looks(stream: rr.RecordingStream, run: str, curves: Mapping[str, np.ndarray], body: int) -> None:
    """Log titles of a run's curves in its body's colours: in each plot those of left, right and middle in turn."""
    in_plot: Counter[str] = Counter()
    for name in curves:
        side = (LEFT, RIGHT, MIDDLE)[in_plot[_plot(name)] % 3]
        in_plot[_plot(name)] += 1
        _log_look(stream, name, run, actor_palette(body)[side])


def _log_look(stream: rr.RecordingStream, name: str, actor: str | None, color: Any) -> None:
    title = f"{name} {actor}" if actor else name
    stream.log(_curve(name, actor), rr.SeriesLines(names=title, colors=color, widths=1.5), static=True)


def log_curves(stream: rr.RecordingStream, motion: Motion, actor: str | None, curves: Mapping[str, np.ndarray]) -> None:
    """Log the values of curves over a motion's frames."""
    for name, values in curves.items():
        scalars = rr.Scalars.columns(scalars=np.asarray(values, float))
        stream.send_columns(_curve(name, actor), time_columns(motion), scalars)


def plots_with(curves: Iterable[str]) -> dict[str, str]:
    """Titles of the plots that have something to show of these curves."""
    used = {_plot(name) for name in curves}
    return {plot: title for plot, title in _PLOTS.items() if plot in used}


def _curve(name: str, actor: str | None) -> str:
    return f"/curves/{_plot(name)}/{name}" + (f"/{entity_part(actor)}" if actor else "")


def _plot(curve: str) -> str:
    """The plot that a curve belongs in; what is not known is a term that a user added."""
    for begins, plot in _OF_LIMBS.items():
        if curve.startswith(begins):
            return plot
    if "penalty" in curve:
        return "penalties"
    known = {"similarity": "energy", "energy": "energy", "iterations": "iterations", "error_mm": "errors"}
    return known.get(curve, "terms")
