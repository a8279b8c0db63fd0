"""Two people close together: they embrace, talk at arm's length, or dance as a couple."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from jaxtyping import Float

from sogjax.synth.anatomy import SIDES, Anatomy
from sogjax.synth.contact import KeyPoses, chest_of, facing
from sogjax.synth.exercises import READY, Angles, Exercise, Handling, of_arms
from sogjax.synth.rotations import Vector, about, ahead_and_left

_MEETING, _NEAR, _EMBRACED = 1.50, 0.86, 0.42
"""Metres between two people who walk up to each other, between others who only step, and in the embrace."""
_ARMS_LENGTH = 0.80
"""Metres between two who talk."""
_COUPLE, _ASIDE = 0.52, 0.07
"""Metres between the two of a couple, and by which each stands aside, so that feet do not meet."""

_Places = Sequence[tuple[float, float, float, float, str]]
"""Seconds, the shares of the way that pelvis, left and right foot have gone, and the foot that is lifted."""
_THREE_STEPS: _Places = (
    (0.0, 0.0, 0.0, 0.0, ""),
    (0.19, 0.12, 0.0, 0.25, "right"),
    (0.38, 0.30, 0.0, 0.5, ""),
    (0.58, 0.52, 0.5, 0.5, "left"),
    (0.78, 0.74, 1.0, 0.5, ""),
    (0.96, 0.92, 1.0, 0.78, "right"),
    (1.15, 1.0, 1.0, 1.0, ""),
)
_ONE_STEP: _Places = (
    (0.0, 0.0, 0.0, 0.0, ""),
    (0.15, 0.2, 0.0, 0.5, "right"),
    (0.30, 0.5, 0.0, 1.0, ""),
    (0.46, 0.8, 0.5, 1.0, "left"),
    (0.62, 1.0, 1.0, 1.0, ""),
)


def hugging(anatomies: Sequence[Anatomy], turn: float) -> tuple[Handling, Handling]:
    """Two people who walk up to each other, embrace, and part; they pass each other's heads by 6 cm on either side."""
    return facing(anatomies, turn, _MEETING, 0.06, lambda anatomy, _: _hug_keys(anatomy.stature), _ROUND_ELBOWS)


def embracing(anatomies: Sequence[Anatomy], turn: float) -> tuple[Handling, Handling]:
    """Two people who stand close, embrace for a long time, and step back."""
    return facing(anatomies, turn, _NEAR, 0.06, lambda anatomy, _: _embrace_keys(anatomy.stature), _ROUND_ELBOWS)


def _hug_keys(stature: float) -> KeyPoses:
    """Key poses of either one, over 4.3 s."""
    way = 0.5 * (_MEETING - _EMBRACED) / stature
    approach = [(time, _opened(min(time / 0.9, 1.0)) | feet) for time, feet in _steps_ahead(way, _THREE_STEPS)]
    close = _closed(way)
    return [
        (0.0, READY | _NO_HANDS),
        *((0.2 + time, angles) for time, angles in approach),
        (1.75, close | {"lean": 2.0}),
        (2.1, close | {"lean": -5.0}),
        (2.45, close | {"lean": 4.0}),
        *((3.95 - time, angles) for time, angles in reversed(approach)),
        (4.3, READY | _NO_HANDS),
    ]


def _embrace_keys(stature: float) -> KeyPoses:
    """Key poses of either one, over 5 s, for three of which arms are about the other one."""
    way = 0.5 * (_NEAR - _EMBRACED) / stature
    approach = [(time, _opened(min(time / 0.5, 1.0)) | feet) for time, feet in _steps_ahead(way, _ONE_STEP)]
    close = _closed(way)
    sways = ((1.15, 2.0), (1.6, -4.0), (2.1, 3.0), (2.6, -4.0), (3.1, 3.0), (3.5, -3.0), (3.85, 2.0))
    return [
        (0.0, READY | _NO_HANDS),
        *((0.1 + time, angles) for time, angles in approach),
        *((time, close | {"lean": lean, "yaw": -lean}) for time, lean in sways),
        *((4.9 - time, angles) for time, angles in reversed(approach)),
        (5.0, READY | _NO_HANDS),
    ]


def _closed(way: float) -> dict[str, float]:
    """The embrace, so far ahead of where each one stood."""
    trunk = {"bend": 8.0, "tilt": 9.0, "nod": 4.0}
    return _ROUND | {"left_foot_x": way, "right_foot_x": way, "pelvis_x": way} | trunk


def _steps_ahead(way: float, places: _Places) -> list[tuple[float, dict[str, float]]]:
    """Steps that lead so far ahead: pelvis and feet."""
    raised = lambda side: {f"{side}_foot_z": 0.035, f"{side}_foot_pitch": 8.0, "pelvis_z": -0.01} if side else {}
    return [
        (time, {"pelvis_x": pelvis * way, "left_foot_x": left * way, "right_foot_x": right * way} | raised(side))
        for time, pelvis, left, right, side in places
    ]


_NO_HANDS = {
    **{"left_hand": 0.0, "left_hand_x": -0.10, "left_hand_y": -0.12, "left_hand_z": 0.29},
    **{"right_hand": 0.0, "right_hand_x": -0.05, "right_hand_y": 0.195, "right_hand_z": -0.05},
}
"""The left hand is meant for the other one's right shoulder, the right hand for the left side of the back."""
_ROUND = _NO_HANDS | {
    **{"left_hand": 1.0, "left_raise": 96.0, "left_plane": 30.0, "left_elbow": 40.0, "left_wrist": -34.0},
    **{"right_hand": 1.0, "right_raise": 62.0, "right_plane": 48.0, "right_elbow": 45.0},
    **{"right_palm": 62.0, "right_wrist": -46.0},
}


def _opened(share: float) -> dict[str, float]:
    """Arms on their way from hanging to open."""
    wide = {"left_raise": 98.0, "left_plane": 52.0, "left_elbow": 24.0}
    wide |= {"right_raise": 56.0, "right_plane": 58.0, "right_elbow": 24.0}
    return {name: READY[name] + share * (value - READY[name]) for name, value in wide.items()} | _NO_HANDS


_ROUND_ELBOWS = ((0.1, 0.85, 0.35), (0.0, 0.8, -0.6))


def talking(anatomies: Sequence[Anatomy], turn: float) -> tuple[Exercise, Exercise]:
    """Two people at arm's length who talk in turns: hands speak, the trunk turns a little, feet stay where they are."""
    ahead, _ = ahead_and_left(turn)
    places = ((-0.5 * _ARMS_LENGTH * ahead, turn + 0.14), (0.5 * _ARMS_LENGTH * ahead, turn + np.pi + 0.14))
    pairs = zip(anatomies, (_first_to_talk(), _second_to_talk()), places, strict=True)
    one, other = (Exercise(anatomy, keys, *place) for anatomy, keys, place in pairs)
    return one, other


_OWN_WEIGHT = {"pelvis_y": 0.018, "lean": -3.0}
_FOLDED = of_arms(18.0, 34.0, 100.0, roll=-58.0) | {"bend": 3.0}
"""Forearms before the belly."""
_EXPLAIN = {
    **{"left_raise": 22.0, "left_plane": 62.0, "left_elbow": 84.0, "left_roll": 12.0, "left_palm": -70.0},
    **{"right_raise": 34.0, "right_plane": 58.0, "right_elbow": 108.0, "right_roll": 14.0, "right_palm": -60.0},
}
"""Both forearms up, outwards."""
_COUNT = _EXPLAIN | {"left_elbow": 112.0, "left_roll": 28.0, "right_elbow": 78.0, "right_raise": 26.0}
_POINT = {
    **{"left_raise": 72.0, "left_plane": 82.0, "left_elbow": 22.0, "right_raise": 16.0, "right_plane": 60.0},
    **{"right_elbow": 60.0, "turn": 16.0, "look": 24.0},
}
"""The left arm out to the side."""
_THINK = {
    **{"right_raise": 34.0, "right_plane": 14.0, "right_elbow": 138.0, "right_roll": -34.0, "nod": 8.0},
    **{"left_raise": 20.0, "left_plane": 30.0, "left_elbow": 96.0, "left_roll": -62.0, "bend": 6.0},
}
"""A hand below the chin, the other one below its elbow."""


def _first_to_talk() -> KeyPoses:
    """Key poses over 5.2 s."""
    return [
        (0.0, READY),
        (0.1, READY),
        (0.5, _EXPLAIN | {"turn": 5.0}),
        (0.8, _COUNT | {"turn": -4.0, "nod": 6.0}),
        (1.1, _EXPLAIN | _OWN_WEIGHT),
        (1.6, _POINT | _OWN_WEIGHT),
        (2.0, _POINT | _OWN_WEIGHT | {"left_raise": 84.0, "yaw": 6.0}),
        (2.6, _FOLDED | {"nod": 4.0}),
        (3.1, _FOLDED | {"turn": -8.0, "nod": -4.0, "look": 6.0}),
        (3.6, _THINK | {"pelvis_y": -0.018}),
        (4.2, _THINK | {"turn": 8.0, "look": -6.0, "pelvis_y": -0.018}),
        (4.9, READY),
        (5.2, READY),
    ]


def _second_to_talk() -> KeyPoses:
    """Key poses over 5.2 s."""
    return [
        (0.0, READY),
        (0.15, READY),
        (0.65, _FOLDED | {"pelvis_y": -0.018}),
        (1.1, _FOLDED | {"nod": 10.0, "pelvis_y": -0.018}),
        (1.5, _THINK | {"look": -14.0, "turn": -6.0}),
        (2.1, _THINK | {"look": -20.0, "turn": -10.0}),
        (2.6, _EXPLAIN | {"turn": 6.0}),
        (2.95, _COUNT | {"turn": -6.0}),
        (3.3, _EXPLAIN | _OWN_WEIGHT),
        (3.8, _POINT | _OWN_WEIGHT),
        (4.3, _EXPLAIN | {"nod": 6.0}),
        (4.9, READY),
        (5.2, READY),
    ]


def dancing_couple(anatomies: Sequence[Anatomy], turn: float) -> tuple[Handling, Handling]:
    """Two people who hold each other and turn about their middle with small steps, once round."""
    ahead, left = ahead_and_left(turn)
    offset: Vector = -0.5 * _COUPLE * ahead + _ASIDE * left
    leader = Exercise(anatomies[0], _couple_keys(anatomies[0].stature, _LEAD, _LOW), offset, turn)
    other = Exercise(anatomies[1], _couple_keys(anatomies[1].stature, _FOLLOW, _HIGH), -offset, turn + np.pi)
    clasped = (-0.4, 0.4, -0.85)
    return (
        Handling(leader, _middle_of(leader, other), (clasped, (0.0, 0.85, -0.3))),
        Handling(other, _middle_of(other, leader), ((0.0, 0.9, -0.2), clasped)),
    )


def _middle_of(own: Exercise, other: Exercise) -> Callable[[float], Float[np.ndarray, "4 4"]]:
    """The frame between two chests, level, which looks from one's own to the other one's."""

    def frame(time: float) -> Float[np.ndarray, "4 4"]:
        here, there = (chest_of(each)(time)[:3, 3] for each in (own, other))
        away = there - here
        level = np.eye(4)
        # the other one stands aside by twice what either does
        level[:3, :3] = about("z", float(np.arctan2(away[1], away[0]) + np.arctan2(2.0 * _ASIDE, _COUPLE)))
        level[:3, 3] = 0.5 * (here + there)
        return level

    return frame


def _at(side: str, hold: float, x: float, y: float, z: float) -> dict[str, float]:
    """Where a hand is held, in metres from the middle of the couple."""
    return {f"{side}_hand": hold, f"{side}_hand_x": x, f"{side}_hand_y": y, f"{side}_hand_z": z}


_LEAD = (
    _at("left", 1.0, -0.07, 0.60, 0.10)
    | {"left_raise": 66.0, "left_plane": 62.0, "left_elbow": 60.0, "left_wrist": -10.0}
    | _at("right", 1.0, 0.33, -0.30, -0.03)
    | {"right_raise": 52.0, "right_plane": 50.0, "right_elbow": 60.0, "right_palm": 62.0, "right_wrist": -20.0}
)
"""The left hand holds the other one's right hand, the right one lies on the other one's back."""
_FOLLOW = (
    _at("right", 1.0, -0.07, -0.60, 0.10)
    | {"right_raise": 66.0, "right_plane": 62.0, "right_elbow": 60.0, "right_wrist": -10.0}
    | _at("left", 1.0, 0.14, 0.14, 0.24)
    | {"left_raise": 72.0, "left_plane": 40.0, "left_elbow": 70.0, "left_wrist": -20.0}
)
"""The left hand lies on the other one's right shoulder."""


_LOW = {
    **{"right_raise": 44.0, "right_plane": 84.0, "right_elbow": 20.0},
    **{"left_raise": 54.0, "left_plane": 110.0, "left_elbow": 36.0},
}
_HIGH = {
    **{"left_raise": 112.0, "left_plane": 70.0, "left_elbow": 40.0},
    **{"right_raise": 78.0, "right_plane": 110.0, "right_elbow": 30.0},
}
"""Arms on their way: the leader's below the other one's."""


def _couple_keys(stature: float, hold: dict[str, float], between: Angles) -> KeyPoses:
    """Key poses over 6.2 s: take hold, twelve steps of which each turns the couple by 30 degrees, let go."""
    free = {name: 0.0 if name.endswith("_hand") else value for name, value in hold.items() if "_hand" in name}
    standing, open_ = READY | free, {**hold, **free, **between}
    whole = {"yaw": 360.0, "left_foot_yaw": 360.0, "right_foot_yaw": 360.0}
    keys: KeyPoses = [(0.0, standing), (0.1, standing), (0.34, open_), (0.6, hold)]
    yaw, time = dict.fromkeys(SIDES, 0.0), 0.6
    for number in range(1, 13):
        side = "right" if number % 2 else "left"
        before, yaw = yaw, yaw | {side: min(30.0 * (number + 1), 360.0)}
        sway = {"lean": 4.0 if side == "left" else -4.0, "pelvis_z": -0.016}
        lifted = {f"{side}_foot_z": 0.03, f"{side}_foot_pitch": 8.0}
        half = {name: 0.5 * (before[name] + yaw[name]) for name in SIDES}
        keys.append((time + 0.19, hold | sway | lifted | _round_the_middle(stature, half)))
        keys.append((time + 0.38, hold | {"pelvis_z": -0.008} | _round_the_middle(stature, yaw)))
        time += 0.38
    return [*keys, (time + 0.3, open_ | whole), (time + 0.7, standing | whole), (time + 1.0, standing | whole)]


def _round_the_middle(stature: float, yaw: Mapping[str, float]) -> dict[str, float]:
    """Feet gone so many degrees round the middle of the couple, and the pelvis half-way between them."""
    middle = np.array([0.5 * _COUPLE, -_ASIDE, 0.0]) / stature
    between = 0.5 * (yaw["left"] + yaw["right"])
    pelvis = middle - about("z", np.deg2rad(between)) @ middle
    angles = {"yaw": between, "pelvis_x": float(pelvis[0]), "pelvis_y": float(pelvis[1])}
    for side in SIDES:
        foot = about("z", -np.deg2rad(yaw[side])) @ middle - middle  # turns with the foot's yaw
        sign = 1.0 if side == "left" else -1.0
        angles |= {f"{side}_foot_yaw": yaw[side], f"{side}_foot_x": float(foot[0])}
        angles |= {f"{side}_foot_y": sign * float(foot[1])}  # outwards
    return angles
