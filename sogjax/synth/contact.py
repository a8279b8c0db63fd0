"""People whose hands are held at places: one sits down at a table; two box and kick."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from sogjax.synth.anatomy import INDEX, Anatomy
from sogjax.synth.exercises import READY, Angles, Direction, Exercise, Handling, both, of_arms
from sogjax.synth.furniture import EDGE, SEAT_HEIGHT, SITTER_SEAT, TABLE_HEIGHT, TABLE_SIZE
from sogjax.synth.limbs import heading_matrix
from sogjax.synth.rotations import Vector, ahead_and_left

KeyPoses = list[tuple[float, Angles]]

TABLE_AHEAD = EDGE + 0.5 * TABLE_SIZE[1]
"""Metres from where a sitter stands to the middle of the table."""
_FIGHTING = 1.02
"""Metres between fighters."""
_HALF = 2.7
"""Seconds after which the fighters change parts."""


def sitting(anatomy: Anatomy, place: Vector, heading: float, delay: float = 0.0) -> Handling:
    """A person who stands before a chair, sits down, reaches over the table, drinks, and stands up."""
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = heading_matrix(heading), place
    return Handling(Exercise(anatomy, _sit_keys(anatomy), place, heading, delay), lambda time: frame, flat=True)


def _sit_keys(anatomy: Anatomy) -> KeyPoses:
    """Key poses for a chair behind and a table in front of the person."""
    stature = anatomy.stature
    hips = SEAT_HEIGHT + 0.104 * anatomy.girth * stature / 1.75  # on the flesh of a person of average stature and girth
    down = (hips - anatomy.hip_height + 0.012) / stature
    back = SITTER_SEAT / stature
    half = {"pelvis_x": 0.72 * back, "pelvis_z": 0.55 * down, "tip": 34.0, "bend": 24.0, "nod": -26.0, "knees_out": 0.1}
    going = half | of_arms(34.0, 30.0, 88.0) | _hands(1.0, 0.25, 0.06)
    bent = {"pelvis_x": 0.34 * back, "pelvis_z": 0.2 * down, "tip": 22.0, "bend": 16.0, "nod": -16.0}
    bent |= of_arms(28.0, 40.0, 96.0) | _hands(1.0, 0.20, 0.17)
    seated = {"pelvis_x": back, "pelvis_z": down, "tip": 6.0, "bend": 20.0, "knees_out": 0.1} | _ON_TABLE
    free = _hands(0.0, 0.25, 0.06)
    standing, drawn = READY | free, of_arms(26.0, 128.0, 84.0) | free
    raised = of_arms(22.0, 50.0, 92.0) | free | {"tip": 6.0, "bend": 6.0}
    far = seated | _at("right", 0.42, -0.36) | {"turn": -16.0, "bend": 26.0, "nod": 8.0}
    return [
        (0.0, standing),
        (0.15, standing),
        (0.28, drawn),
        (0.42, raised),
        (0.6, bent),
        (0.82, going),
        (1.2, seated | {"nod": 4.0}),
        (1.45, seated | {"nod": 6.0, "turn": 4.0}),
        (1.9, far | {"look": -14.0}),
        (2.05, far | {"look": -12.0}),
        (2.55, seated | _DRINK | {"bend": 8.0, "turn": 4.0, "nod": -12.0}),
        (2.85, seated | _DRINK | {"bend": 8.0, "turn": 2.0, "nod": -16.0}),
        (3.35, seated | _at("right", 0.40, -0.30) | {"turn": 8.0, "look": 20.0}),
        (3.75, seated | _at("left", 0.44, 0.38) | {"turn": 18.0, "bend": 28.0, "look": 16.0, "nod": 6.0}),
        (4.2, seated | {"turn": -6.0, "lean": 5.0, "look": -18.0}),
        (4.5, seated),
        (5.0, going),
        (5.2, bent),
        (5.4, raised),
        (5.58, drawn),
        (5.85, standing),
        (6.2, standing),
    ]


def _hands(hold: float, x: float = 0.29, above: float = 0.035) -> dict[str, float]:
    """Both hands so far ahead and above the table."""
    return both(hand=hold, hand_x=x, hand_z=TABLE_HEIGHT + above) | {"left_hand_y": 0.17, "right_hand_y": -0.17}


def _at(side: str, x: float, y: float) -> dict[str, float]:
    """One hand elsewhere on the table."""
    return {f"{side}_hand_x": x, f"{side}_hand_y": y}


_ON_TABLE = _hands(1.0) | of_arms(34.0, 30.0, 80.0, palm=-75.0)
_DRINK = _ON_TABLE | {
    **{"right_hand": 0.0, "right_raise": 62.0, "right_plane": 18.0, "right_elbow": 136.0, "right_roll": -16.0},
    **{"right_palm": -20.0, "right_hand_x": 0.1, "right_hand_z": TABLE_HEIGHT + 0.3},
}
"""The right hand at the mouth."""


def fighting(anatomies: Sequence[Anatomy], turn: float) -> tuple[Handling, Handling]:
    """Two people who box: punches, blocks and a kick that meets the other; then the other one attacks."""
    elbows = ((0.0, 0.5, -0.85), (0.0, 0.5, -0.85))
    return facing(anatomies, turn, _FIGHTING, 0.0, lambda anatomy, k: _fight_keys(anatomy.stature, k), elbows)


def facing(
    anatomies: Sequence[Anatomy],
    turn: float,
    distance: float,
    aside: float,
    keys: Callable[[Anatomy, int], KeyPoses],
    elbows: tuple[Direction, Direction],
) -> tuple[Handling, Handling]:
    """Two people who face each other; the places of each one's hands are given in the frame of the other's chest."""
    ahead, left = ahead_and_left(turn)
    offset: Vector = -0.5 * distance * ahead + aside * left
    one = Exercise(anatomies[0], keys(anatomies[0], 0), offset, turn)
    other = Exercise(anatomies[1], keys(anatomies[1], 1), -offset, turn + np.pi)
    return Handling(one, chest_of(other), elbows), Handling(other, chest_of(one), elbows)


def chest_of(exercise: Exercise) -> Callable[[float], Float[np.ndarray, "4 4"]]:
    """The frame of somebody's chest, in units of 1/1.75 of that person's stature."""

    def frame(time: float) -> Float[np.ndarray, "4 4"]:
        chest = exercise.anatomy.world_from_joint(exercise(time))[INDEX["chest"]].copy()
        chest[:3, :3] *= exercise.anatomy.stature / 1.75
        return chest

    return frame


_AT_FACE = both(hand=0.0, hand_x=0.30, hand_y=0.0, hand_z=0.33)
_GUARD = (
    _AT_FACE
    | of_arms(42.0, 22.0, 118.0, roll=-8.0)
    | {"left_foot_x": 0.075, "right_foot_x": -0.085, "right_foot_yaw": -14.0, "yaw": -14.0}
    | {"pelvis_z": -0.028, "knees_out": 0.1, "bend": 10.0, "look": 12.0}
)
_WIND = _GUARD | {"turn": -16.0, "right_raise": 36.0, "right_plane": 60.0}
_PUNCH = _GUARD | {
    **{"turn": 38.0, "yaw": 6.0, "pelvis_x": 0.045, "bend": 12.0, "look": -22.0, "right_heel": 16.0},
    **{"right_hand": 1.0, "right_raise": 84.0, "right_plane": 6.0, "right_elbow": 30.0},
}
_JAB = _GUARD | {
    **{"turn": -16.0, "yaw": -20.0, "pelvis_x": 0.04, "look": 26.0, "left_hand": 1.0},
    **{"left_raise": 84.0, "left_plane": 6.0, "left_elbow": 30.0},
}
_STRUCK = _GUARD | {"pelvis_x": -0.05, "pelvis_z": -0.045, "tip": 8.0, "bend": 26.0, "nod": -20.0}


def _block(side: str) -> Angles:
    """One arm before the face, the trunk away from the fist."""
    arm = {f"{side}_raise": 66.0, f"{side}_plane": 52.0, f"{side}_elbow": 112.0, f"{side}_roll": 42.0}
    return _GUARD | arm | {"pelvis_x": -0.03, "bend": -2.0, "lean": -5.0 if side == "left" else 5.0, "nod": 6.0}


def _attack(stature: float) -> KeyPoses:
    """A punch, a block, a kick with the right foot, whose ankle stays 28 cm away from the other one's place."""
    drawn = _GUARD | {
        **{"pelvis_y": 0.05, "pelvis_x": 0.04, "pelvis_z": -0.012, "tip": -4.0, "yaw": 0.0, "right_foot_yaw": 0.0},
        **{"right_foot_x": 0.05, "right_foot_y": -0.03, "right_foot_z": 0.26, "right_foot_pitch": 24.0, "bend": 12.0},
        **{"knees_up": 1.2},
    }
    kick = drawn | {
        **{"right_foot_x": (_FIGHTING - 0.28) / stature, "right_foot_y": -0.045, "right_foot_z": 0.40},
        **{"right_foot_pitch": -40.0, "tip": -13.0, "pelvis_x": 0.055},
    }
    block = _block("right")
    hits = [(0.28, _WIND), (0.48, _PUNCH), (0.56, _PUNCH), (0.85, _GUARD), (1.0, _GUARD), (1.18, block), (1.26, block)]
    kicks = [(1.5, _GUARD), (1.8, drawn), (2.0, kick), (2.06, kick), (2.32, drawn), (_HALF, _GUARD)]
    return [*hits, *kicks]


def _defence() -> KeyPoses:
    """A block, a jab, a kick taken."""
    block = _block("left")
    first = [(0.28, _GUARD), (0.46, block), (0.60, block), (0.85, _GUARD), (1.0, _GUARD), (1.18, _JAB), (1.26, _JAB)]
    return [*first, (1.5, _GUARD), (1.85, _GUARD), (2.12, _STRUCK), (2.35, _STRUCK), (_HALF, _GUARD)]


def _fight_keys(stature: float, number: int) -> KeyPoses:
    """Key poses of the one who attacks first (0) or second (1), over 6.4 s."""
    parts = [_attack(stature), _defence()]
    first, second = parts if number == 0 else parts[::-1]
    start, ready = 0.45, READY | _AT_FACE
    return [
        *((0.0, ready), (0.1, ready), (start, _GUARD)),
        *((start + time, angles) for time, angles in first),
        *((start + _HALF + time, angles) for time, angles in second),
        *((start + 2 * _HALF + 0.4, ready), (start + 2 * _HALF + 0.55, ready)),
    ]
