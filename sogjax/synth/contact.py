"""Two people in contact: they embrace, or they box and kick."""

from collections.abc import Callable, Sequence

import numpy as np

from sogjax.synth.anatomy import Anatomy
from sogjax.synth.exercises import READY, Angles, Exercise, both
from sogjax.synth.handling import Direction, Handling, at_the_chest
from sogjax.synth.rotations import Vector

Keys = list[tuple[float, Angles]]

_MEETING, _EMBRACED = 1.50, 0.42
"""Metres between two people before an embrace and in it."""
_ASIDE = 0.06
"""Metres by which each stands to the left of the line between them, so that the heads pass each other."""
_FIGHTING = 1.02
"""Metres between fighters."""
_KICK = 0.28
"""Metres by which a kicking ankle stays away from the middle of the other one's place."""
_HALF = 2.7
"""Seconds after which the fighters change parts."""


def hugging(anatomies: Sequence[Anatomy], turn: float) -> tuple[Handling, Handling]:
    """Two people who walk up to each other, embrace, and part."""
    elbows = ((0.1, 0.85, 0.35), (0.0, 0.8, -0.6))
    return _facing(anatomies, turn, _MEETING, _ASIDE, lambda anatomy, _: _hug_keys(anatomy.stature), elbows)


def fighting(anatomies: Sequence[Anatomy], turn: float) -> tuple[Handling, Handling]:
    """Two people who box: punches, blocks and a kick that meets the other; then the other one attacks."""
    elbows = ((0.0, 0.5, -0.85), (0.0, 0.5, -0.85))
    return _facing(anatomies, turn, _FIGHTING, 0.0, lambda anatomy, k: _fight_keys(anatomy.stature, k), elbows)


def _facing(
    anatomies: Sequence[Anatomy],
    turn: float,
    distance: float,
    aside: float,
    keys: Callable[[Anatomy, int], Keys],
    elbows: tuple[Direction, Direction],
) -> tuple[Handling, Handling]:
    """Two people who face each other; the places of each one's hands are given in the frame of the other's chest."""
    ahead, left = np.array([np.cos(turn), np.sin(turn), 0.0]), np.array([-np.sin(turn), np.cos(turn), 0.0])
    offset: Vector = -0.5 * distance * ahead + aside * left
    one = Exercise(anatomies[0], keys(anatomies[0], 0), offset, turn)
    other = Exercise(anatomies[1], keys(anatomies[1], 1), -offset, turn + np.pi)
    return Handling(one, at_the_chest(other), elbows), Handling(other, at_the_chest(one), elbows)


def _hug_keys(stature: float) -> Keys:
    """Key poses of either one, over 4.7 s."""
    way = 0.5 * (_MEETING - _EMBRACED) / stature
    close = {**_ROUND, "left_foot_x": way, "right_foot_x": way, "pelvis_x": way, "bend": 8.0, "tilt": 9.0, "nod": 4.0}
    arrival = [(0.2 + time, _open(min(time / 0.9, 1.0)) | feet) for time, feet in _approach(way)]
    departure = [(3.95 - time, _open(min(time / 0.9, 1.0)) | feet) for time, feet in reversed(_approach(way))]
    return [
        (0.0, {**READY, **_NO_HANDS}),
        *arrival,
        (1.75, {**close, "lean": 2.0}),
        (2.1, {**close, "lean": -5.0}),
        (2.45, {**close, "lean": 4.0}),
        *departure,
        (4.3, {**READY, **_NO_HANDS}),
    ]


def _approach(way: float) -> list[tuple[float, dict[str, float]]]:
    """Three steps that lead so far ahead, over 1.15 s: pelvis and feet."""
    places = (
        (0.0, 0.0, 0.0, 0.0, ""),
        (0.19, 0.12, 0.0, 0.25, "right"),
        (0.38, 0.30, 0.0, 0.5, ""),
        (0.58, 0.52, 0.5, 0.5, "left"),
        (0.78, 0.74, 1.0, 0.5, ""),
        (0.96, 0.92, 1.0, 0.78, "right"),
        (1.15, 1.0, 1.0, 1.0, ""),
    )
    return [
        (
            time,
            {"pelvis_x": pelvis * way, "left_foot_x": left * way, "right_foot_x": right * way}
            | ({f"{lifted}_foot_z": 0.035, f"{lifted}_foot_pitch": 8.0, "pelvis_z": -0.01} if lifted else {}),
        )
        for time, pelvis, left, right, lifted in places
    ]


_NO_HANDS = {
    **{"left_hand": 0.0, "left_hand_x": -0.10, "left_hand_y": -0.12, "left_hand_z": 0.29},
    **{"right_hand": 0.0, "right_hand_x": -0.05, "right_hand_y": 0.195, "right_hand_z": -0.05},
}
"""The left hand is meant for the other one's right shoulder, the right hand for the left side of the back."""
_ROUND = {
    **_NO_HANDS,
    **{"left_hand": 1.0, "left_raise": 96.0, "left_plane": 30.0, "left_elbow": 40.0, "left_wrist": -34.0},
    **{"right_hand": 1.0, "right_raise": 62.0, "right_plane": 48.0, "right_elbow": 45.0},
    **{"right_palm": 62.0, "right_wrist": -46.0},
}


def _open(share: float) -> dict[str, float]:
    """Arms on their way from hanging to open."""
    opened = {
        **{"left_raise": 98.0, "left_plane": 52.0, "left_elbow": 24.0},
        **{"right_raise": 56.0, "right_plane": 58.0, "right_elbow": 24.0},
    }
    return {name: READY[name] + share * (value - READY[name]) for name, value in opened.items()} | _NO_HANDS


_STANCE = {
    **{"left_foot_x": 0.075, "right_foot_x": -0.085, "right_foot_yaw": -14.0, "yaw": -14.0},
    **{"pelvis_z": -0.028, "knees_out": 0.1},
}
_AT_FACE = both(hand=0.0, hand_x=0.30, hand_y=0.0, hand_z=0.33)
_GUARD = {
    **_STANCE,
    **_AT_FACE,
    **both(**{"raise": 42.0, "plane": 22.0, "elbow": 118.0, "roll": -8.0}),
    **{"bend": 10.0, "look": 12.0},
}
_WIND = _GUARD | {"turn": -16.0, "right_raise": 36.0, "right_plane": 60.0}
_STRIKE = {"turn": 38.0, "yaw": 6.0, "pelvis_x": 0.045, "bend": 12.0, "look": -22.0, "right_heel": 16.0}
_PUNCH = _GUARD | _STRIKE | {"right_hand": 1.0, "right_raise": 84.0, "right_plane": 6.0, "right_elbow": 30.0}
_JAB = _GUARD | {
    **{"turn": -16.0, "yaw": -20.0, "pelvis_x": 0.04, "look": 26.0, "left_hand": 1.0},
    **{"left_raise": 84.0, "left_plane": 6.0, "left_elbow": 30.0},
}
_LEFT_BLOCK = _GUARD | {
    **{"left_raise": 66.0, "left_plane": 52.0, "left_elbow": 112.0, "left_roll": 42.0},
    **{"pelvis_x": -0.03, "bend": -2.0, "lean": -5.0, "nod": 6.0},
}
_RIGHT_BLOCK = _GUARD | {
    **{"right_raise": 66.0, "right_plane": 52.0, "right_elbow": 112.0, "right_roll": 42.0},
    **{"pelvis_x": -0.03, "bend": -2.0, "lean": 5.0, "nod": 6.0},
}
_STRUCK = _GUARD | {"pelvis_x": -0.05, "pelvis_z": -0.045, "tip": 8.0, "bend": 26.0, "nod": -20.0}


def _kicking(stature: float) -> tuple[Angles, Angles]:
    """Both moments of a kick with the right foot: drawn up, and at the other one's body."""
    lifted = _GUARD | {
        **{"pelvis_y": 0.05, "pelvis_x": 0.04, "pelvis_z": -0.012, "tip": -4.0, "yaw": 0.0, "right_foot_yaw": 0.0},
        **{"right_foot_x": 0.05, "right_foot_y": -0.03, "right_foot_z": 0.26, "right_foot_pitch": 24.0, "bend": 12.0},
        **{"knees_up": 1.2},
    }
    ahead = (_FIGHTING - _KICK) / stature
    return lifted, lifted | {
        **{"right_foot_x": ahead, "right_foot_y": -0.045, "right_foot_z": 0.40, "right_foot_pitch": -40.0},
        **{"tip": -13.0, "pelvis_x": 0.055},
    }


def _attack(stature: float) -> Keys:
    """A punch, a block, a kick."""
    chamber, kick = _kicking(stature)
    hits = [(0.28, _WIND), (0.48, _PUNCH), (0.56, _PUNCH), (0.85, _GUARD), (1.0, _GUARD), (1.18, _RIGHT_BLOCK)]
    kicks = [(1.26, _RIGHT_BLOCK), (1.5, _GUARD), (1.8, chamber), (2.0, kick), (2.06, kick), (2.32, chamber)]
    return [*hits, *kicks, (_HALF, _GUARD)]


def _defence() -> Keys:
    """A block, a jab, a kick taken."""
    first = [(0.28, _GUARD), (0.46, _LEFT_BLOCK), (0.60, _LEFT_BLOCK), (0.85, _GUARD), (1.0, _GUARD), (1.18, _JAB)]
    return [*first, (1.26, _JAB), (1.5, _GUARD), (1.85, _GUARD), (2.12, _STRUCK), (2.35, _STRUCK), (_HALF, _GUARD)]


def _fight_keys(stature: float, number: int) -> Keys:
    """Key poses of the one who attacks first (0) or second (1), over 6.4 s."""
    parts = [_attack(stature), _defence()]
    first, second = parts if number == 0 else parts[::-1]
    start = 0.45
    ready = {**READY, **_AT_FACE}
    keys: Keys = [(0.0, ready), (0.1, ready), (start, _GUARD)]
    keys += [(start + time, angles) for time, angles in first]
    keys += [(start + _HALF + time, angles) for time, angles in second]
    return [*keys, (start + 2 * _HALF + 0.4, ready), (start + 2 * _HALF + 0.55, ready)]
