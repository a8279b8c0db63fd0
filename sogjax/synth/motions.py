"""What the people of a recording do: a pose for every moment; and where furniture stands among them."""

from collections.abc import Callable, Sequence

import numpy as np

from sogjax.synth.anatomy import Anatomy, Pose
from sogjax.synth.cartwheel import Cartwheel
from sogjax.synth.contact import TABLE_AHEAD, fighting, sitting
from sogjax.synth.exercises import Exercise
from sogjax.synth.furniture import Site
from sogjax.synth.gait import Walk, circle, egg
from sogjax.synth.rotations import ahead_and_left
from sogjax.synth.routines import ARMS, dance_keys, squat_kick_keys, stoop_keys, throw_keys
from sogjax.synth.sprint import Run
from sogjax.synth.together import dancing_couple, embracing, hugging, talking

Motion = Callable[[float], Pose]
"""The pose at a time in seconds."""

_PAIRS: dict[str, Callable[[Sequence[Anatomy], float], tuple[Motion, Motion]]] = {
    **{"hug": hugging, "embrace": embracing, "talk": talking, "couple": dancing_couple, "fight": fighting},
}
_TABLES = {
    "arms": (0.95, 0.0),
    "cartwheel": (1.05, 0.0),
    "squat_kick": (-0.90, 0.0),
    "throw": (-0.90, 0.0),
    "dance": (-1.15, 0.0),
    "stoop": (1.15, 0.0),
    "hug": (0.0, 0.95),
    "fight": (0.0, 1.05),
    "talk": (0.0, 1.05),
    "embrace": (0.0, 0.95),
    "couple": (0.0, 1.15),
}
"""Metres ahead and to the left of the people at which a table stands clear of what they do; else in the middle."""
_ON_THE_SPOT = {
    **{"arms": lambda: ARMS, "squat_kick": squat_kick_keys, "stoop": stoop_keys, "throw": throw_keys},
    **{"dance": dance_keys},
}
_BEHIND_EACH_OTHER = ("arms", "cartwheel")


def motions_of(
    kind: str, anatomies: Sequence[Anatomy], rng: np.random.Generator, furnished: bool = False
) -> list[Motion]:
    """One motion for each person.

    Args:
        kind: one of `sogjax.synth.settings.MOTIONS`.
        anatomies: the people.
        rng: draws headings and small differences.
        furnished: whether furniture stands at the places of `furniture_sites`, which walkers go around.
    """
    turn = _drawn_turn(rng)
    if kind in ("walk", "pass"):
        if len(anatomies) == 1:
            return [Walk(anatomies[0], egg(3.1, 2.7, turn) if furnished else egg(2.2, 1.7, turn))]
        return _passing(anatomies, turn)
    if kind == "run":
        starts = turn + 2.0 * np.pi * np.arange(len(anatomies)) / len(anatomies)
        return [Run(a, circle((0.0, 0.0), 1.6, float(s), 1.0)) for a, s in zip(anatomies, starts, strict=True)]
    if kind in _PAIRS:
        return list(_PAIRS[kind](anatomies, turn))
    lanes = enumerate(zip(anatomies, _lanes(len(anatomies)), strict=True))
    return [_exercise(kind, anatomy, turn, lane, 0.35 * number) for number, (anatomy, lane) in lanes]


def furniture_sites(kind: str, people: int, rng: np.random.Generator) -> list[Site]:
    """Where furniture stands among people whose motions are drawn from the same random numbers."""
    turn = _drawn_turn(rng)
    ahead, aside = ahead_and_left(turn)
    if kind == "sit":
        return [Site(lane * aside + TABLE_AHEAD * ahead, turn - np.pi / 2, sitter=True) for lane in _lanes(people)]
    if kind not in _TABLES:
        return [Site(np.zeros(3), 0.0)]
    along, across = _TABLES[kind]
    last = float(_lanes(people)[-1]) if kind in _BEHIND_EACH_OTHER else 0.0
    return [Site((along + last) * ahead + across * aside, turn + (np.pi / 2 if along else 0.0))]


def _drawn_turn(rng: np.random.Generator) -> float:
    return float(rng.uniform(-np.pi, np.pi))


def _lanes(people: int) -> np.ndarray:
    """Metres aside or ahead at which people exercise, where each has room for arms and legs."""
    return 1.25 * (np.arange(people) - (people - 1) / 2.0)


def _passing(anatomies: Sequence[Anatomy], turn: float) -> list[Motion]:
    """People on two circles, one within the other, walked in opposite directions: they keep meeting."""
    walks: list[Motion] = []
    inner = (len(anatomies) + 1) // 2
    for k, anatomy in enumerate(anatomies):
        radius, sense, count = (1.50, -1.0, len(anatomies) - inner) if k % 2 else (0.84, 1.0, inner)
        around = 2.0 * np.pi * (k // 2) / count
        path = circle((0.0, 0.0), radius, turn + around - sense * 0.62, sense)
        walks.append(Walk(anatomy, path, delay=0.15, swing=0.7, aside=6.0, first="right" if k % 2 else "left"))
    return walks


def _exercise(kind: str, anatomy: Anatomy, turn: float, lane: float, delay: float) -> Motion:
    """Something done on the spot, or along a lane of one's own."""
    ahead, aside = ahead_and_left(turn)
    place = lane * (ahead if kind in _BEHIND_EACH_OTHER else aside)
    if kind == "cartwheel":
        return Cartwheel(anatomy, place, turn, delay)
    if kind == "sit":
        return sitting(anatomy, place, turn, delay)
    return Exercise(anatomy, _ON_THE_SPOT[kind](), place, turn, delay)
