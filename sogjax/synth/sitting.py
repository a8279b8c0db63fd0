"""Sitting down at a table, doing something there, and standing up again."""

from sogjax.synth.anatomy import Anatomy
from sogjax.synth.exercises import READY, Angles, Exercise, both
from sogjax.synth.furniture import EDGE, SEAT_HEIGHT, SITTER_SEAT, TABLE_HEIGHT, TABLE_SIZE
from sogjax.synth.handling import Handling, at_the_place
from sogjax.synth.rotations import Vector

TABLE_AHEAD = EDGE + 0.5 * TABLE_SIZE[1]
"""Metres from where the person stands to the middle of the table."""
_FLESH = 0.104
"""Metres from the hips to the seat, sitting, of a person of average stature and girth."""


def sitting(anatomy: Anatomy, place: Vector, heading: float, delay: float = 0.0) -> Handling:
    """A person who stands before a chair, sits down, reaches over the table, drinks, and stands up."""
    exercise = Exercise(anatomy, sit_keys(anatomy), place, heading, delay)
    return Handling(exercise, at_the_place(exercise), flat=True)


def sit_keys(anatomy: Anatomy) -> list[tuple[float, Angles]]:
    """Key poses for a chair behind and a table in front of the person."""
    stature = anatomy.stature
    hips = SEAT_HEIGHT + _FLESH * anatomy.girth * stature / 1.75
    down = (hips - anatomy.hip_height + 0.012) / stature
    back = SITTER_SEAT / stature
    half = {"pelvis_x": 0.72 * back, "pelvis_z": 0.55 * down, "tip": 34.0, "bend": 24.0, "nod": -26.0, "knees_out": 0.1}
    going = {**half, **both(**{"raise": 34.0, "plane": 30.0, "elbow": 88.0}), **_hands(1.0, 0.25, 0.06)}
    bent = {"pelvis_x": 0.34 * back, "pelvis_z": 0.2 * down, "tip": 22.0, "bend": 16.0, "nod": -16.0}
    bent |= both(**{"raise": 28.0, "plane": 40.0, "elbow": 96.0}) | _hands(1.0, 0.20, 0.17)
    seated = {"pelvis_x": back, "pelvis_z": down, "tip": 6.0, "bend": 20.0, "knees_out": 0.1, **_ON_TABLE}
    standing = {**READY, **_hands(0.0, 0.25, 0.06)}
    raised = {**both(**{"raise": 22.0, "plane": 50.0, "elbow": 92.0}), **_hands(0.0, 0.25, 0.06)}
    drawn = {**both(**{"raise": 26.0, "plane": 128.0, "elbow": 84.0}), **_hands(0.0, 0.25, 0.06)}
    return [
        (0.0, standing),
        (0.15, standing),
        (0.28, drawn),
        (0.42, {**raised, "tip": 6.0, "bend": 6.0}),
        (0.6, bent),
        (0.82, going),
        (1.2, {**seated, "nod": 4.0}),
        (1.45, {**seated, "nod": 6.0, "turn": 4.0}),
        (1.9, {**seated, **_at("right", 0.42, -0.36), "turn": -16.0, "bend": 26.0, "look": -14.0, "nod": 8.0}),
        (2.05, {**seated, **_at("right", 0.42, -0.36), "turn": -16.0, "bend": 26.0, "look": -12.0, "nod": 8.0}),
        (2.55, {**seated, **_DRINK, "bend": 8.0, "turn": 4.0, "nod": -12.0}),
        (2.85, {**seated, **_DRINK, "bend": 8.0, "turn": 2.0, "nod": -16.0}),
        (3.35, {**seated, **_at("right", 0.40, -0.30), "turn": 8.0, "look": 20.0}),
        (3.75, {**seated, **_at("left", 0.44, 0.38), "turn": 18.0, "bend": 28.0, "look": 16.0, "nod": 6.0}),
        (4.2, {**seated, "turn": -6.0, "lean": 5.0, "look": -18.0}),
        (4.5, seated),
        (5.0, going),
        (5.2, bent),
        (5.4, {**raised, "tip": 6.0, "bend": 6.0}),
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


_ON_TABLE = _hands(1.0) | both(**{"raise": 34.0, "plane": 30.0, "elbow": 80.0, "palm": -75.0})
_DRINK = _ON_TABLE | {
    **{"right_hand": 0.0, "right_raise": 62.0, "right_plane": 18.0, "right_elbow": 136.0, "right_roll": -16.0},
    **{"right_palm": -20.0, "right_hand_x": 0.1, "right_hand_z": TABLE_HEIGHT + 0.3},
}
"""The right hand at the mouth."""
