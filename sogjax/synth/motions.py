"""What the people of a recording do: a pose for every moment."""

from collections.abc import Callable, Sequence

import numpy as np

from sogjax.synth.anatomy import Anatomy, Pose
from sogjax.synth.cartwheel import Cartwheel
from sogjax.synth.exercises import ARMS, Exercise, squat_kick_keys
from sogjax.synth.gait import Walk, circle, egg

Motion = Callable[[float], Pose]
"""The pose at a time in seconds."""

_LANE = 1.25
"""Metres between people who exercise beside or behind each other, where they have room for arms and legs."""
_INNER, _OUTER = 0.84, 1.50
"""Radii of the two circles on which people walk past each other."""


def motions_of(kind: str, anatomies: Sequence[Anatomy], rng: np.random.Generator) -> list[Motion]:
    """One motion for each person.

    Args:
        kind: one of `sogjax.synth.settings.MOTIONS`.
        anatomies: the people.
        rng: draws headings and small differences.
    """
    turn = float(rng.uniform(-np.pi, np.pi))
    if kind in ("walk", "pass"):
        if len(anatomies) == 1:
            return [Walk(anatomies[0], egg(2.2, 1.7, turn))]
        return _passing(anatomies, turn)
    lanes = _LANE * (np.arange(len(anatomies)) - (len(anatomies) - 1) / 2.0)
    return [
        _exercise(kind, anatomy, turn, lane, 0.35 * number)
        for number, (anatomy, lane) in enumerate(zip(anatomies, lanes, strict=True))
    ]


def _passing(anatomies: Sequence[Anatomy], turn: float) -> list[Motion]:
    """People on two circles, one within the other, walked in opposite directions: they keep meeting."""
    walks: list[Motion] = []
    inner = (len(anatomies) + 1) // 2
    for k, anatomy in enumerate(anatomies):
        ring, place = (0, k // 2) if k % 2 == 0 else (1, k // 2)
        around = 2.0 * np.pi * place / (inner if ring == 0 else len(anatomies) - inner)
        if ring == 0:
            path = circle((0.0, 0.0), _INNER, turn + around - 0.62, 1.0)
        else:
            path = circle((0.0, 0.0), _OUTER, turn + around + 0.62, -1.0)
        first = "right" if k % 2 else "left"
        walks.append(Walk(anatomy, path, delay=0.15, swing=0.7, aside=6.0, first=first))
    return walks


def _exercise(kind: str, anatomy: Anatomy, turn: float, lane: float, delay: float) -> Motion:
    """Something done on the spot, or along a lane of one's own."""
    ahead = np.array([np.cos(turn), np.sin(turn), 0.0])
    aside = np.array([-np.sin(turn), np.cos(turn), 0.0])
    if kind == "cartwheel":
        return Cartwheel(anatomy, lane * ahead, turn, delay)
    if kind == "arms":
        return Exercise(anatomy, ARMS, lane * ahead, turn, delay)
    return Exercise(anatomy, squat_kick_keys(), lane * aside, turn, delay)
