"""Key poses of what people do on the spot: arms, squat and kick, stoop, an overarm throw, a dance."""

from collections.abc import Mapping

from sogjax.synth.exercises import READY, SQUAT, Angles, both, of_arms

_Keys = list[tuple[float, Angles]]

_HUG = both(plane=4.0, roll=-72.0, elbow=112.0) | {"left_raise": 74.0, "right_raise": 50.0, "bend": 6.0}
ARMS: _Keys = [
    (0.0, READY),
    (0.3, READY),
    (1.0, of_arms(92.0, 80.0, 12.0)),
    (1.75, _HUG),
    (2.5, _HUG | {"turn": 32.0, "look": -12.0}),
    (3.2, of_arms(160.0, 72.0, 14.0) | {"turn": -10.0}),
    (4.0, of_arms(88.0, 86.0, 92.0, roll=80.0) | {"turn": -28.0}),
    (4.8, of_arms(40.0, 50.0, 95.0, roll=-45.0) | {"lean": 8.0}),
    (5.6, READY),
    (6.0, READY),
]
_GUARD = of_arms(32.0, 40.0, 92.0, roll=-12.0)


def squat_kick_keys() -> _Keys:
    """Squat, kick with the right leg, squat again, kick with the left one."""
    keys: _Keys = [(0.0, READY), (0.3, READY)]
    for side in ("right", "left"):
        start = keys[-1][0]
        keys += [(start + 0.75, SQUAT), (start + 0.95, SQUAT), (start + 1.6, _GUARD)]
        keys += [(start + 1.95 + time, angles) for time, angles in _kick(side)]
        keys.append((start + 3.6, READY))
    return keys


def _kick(side: str) -> _Keys:
    """Chamber, kick and draw back one leg, over 1.5 s."""

    def foot(x: float, y: float, z: float, pitch: float) -> dict[str, float]:
        return {f"{side}_foot_x": x, f"{side}_foot_y": y, f"{side}_foot_z": z, f"{side}_foot_pitch": pitch}

    weight = {"pelvis_y": 0.052 * (-1.0 if side == "left" else 1.0)}
    chamber = _GUARD | weight | foot(0.02, -0.02, 0.20, 32.0) | {"pelvis_z": -0.012, "tip": -4.0}
    kick = chamber | foot(0.46, -0.035, 0.37, -38.0) | {"tip": -14.0, "bend": 4.0, "pelvis_x": 0.01}
    shifted = _GUARD | weight | {"pelvis_z": -0.008}
    return [(0.0, shifted), (0.35, chamber), (0.62, kick), (0.90, chamber), (1.3, shifted)]


_BENT = {"tip": 44.0, "bend": 44.0, "nod": -24.0, "pelvis_x": -0.075, "pelvis_z": -0.045, "knees_out": 0.1}
_PICK = _BENT | of_arms(72.0, 12.0, 8.0) | {"pelvis_z": -0.15, "tip": 48.0}
_LIFT = of_arms(30.0, 10.0, 86.0, roll=-10.0) | {"bend": 10.0, "tip": 4.0}
_REACH = {
    **{"right_raise": 152.0, "right_plane": 40.0, "right_elbow": 12.0, "left_raise": 24.0, "left_plane": 70.0},
    **{"left_elbow": 30.0, "lean": 10.0, "look": -12.0, "nod": -20.0, "right_heel": 12.0, "left_heel": 12.0},
}
_SIDEWAYS = _BENT | {
    **{"left_raise": 58.0, "left_plane": 40.0, "left_elbow": 14.0, "right_raise": 34.0, "right_plane": 20.0},
    **{"right_elbow": 70.0, "turn": 24.0, "look": 10.0},
}
"""The left hand at the floor beside the left foot, the right one at the knee."""


def stoop_keys() -> _Keys:
    """Stoop for something, lift it, put it on high, stoop to the side, work bent down; feet stay, over 6 s."""
    return [
        (0.0, READY),
        (0.1, READY),
        (0.65, _PICK),
        (0.85, _PICK | {"bend": 48.0}),
        (1.3, _LIFT),
        (1.75, _REACH),
        (2.05, _REACH | {"right_raise": 158.0, "lean": 14.0}),
        (2.5, _LIFT | {"turn": 12.0}),
        (3.0, _SIDEWAYS),
        (3.35, _SIDEWAYS | {"left_plane": 60.0}),
        (3.8, _BENT | of_arms(60.0, 20.0, 40.0, roll=-14.0)),
        (4.2, _BENT | of_arms(66.0, 10.0, 24.0) | {"turn": -16.0}),
        (4.6, _BENT | of_arms(52.0, 30.0, 60.0, roll=-20.0) | {"turn": 10.0}),
        (5.4, READY),
        (6.0, READY),
    ]


def _right_arm(raised: float, plane: float, elbow: float, roll: float) -> dict[str, float]:
    return {"right_raise": raised, "right_plane": plane, "right_elbow": elbow, "right_roll": roll}


_AIM = {"left_raise": 78.0, "left_plane": 22.0, "left_elbow": 18.0}
_FREE = {"left_raise": 30.0, "left_plane": 70.0, "left_elbow": 60.0}
_STEPPED = {"left_foot_x": 0.30, "left_foot_y": 0.015}
_WIND_UP = {
    **_AIM,
    **_right_arm(62.0, 110.0, 70.0, 20.0),
    **{"yaw": -40.0, "turn": -24.0, "look": 42.0, "pelvis_x": -0.055, "pelvis_z": -0.016, "right_foot_yaw": -24.0},
}
_COCKED = {
    **_AIM,
    **_STEPPED,
    **_right_arm(94.0, 106.0, 92.0, 98.0),
    **{"yaw": -28.0, "turn": -26.0, "look": 40.0, "pelvis_x": 0.06, "pelvis_z": -0.055, "right_foot_yaw": -24.0},
}
_RELEASE = {
    **_FREE,
    **_STEPPED,
    **_right_arm(122.0, 52.0, 30.0, 62.0),
    **{"yaw": 12.0, "turn": 22.0, "bend": 12.0, "tip": 6.0, "look": -14.0, "pelvis_x": 0.155, "pelvis_z": -0.062},
    **{"right_foot_yaw": -8.0, "right_heel": 24.0},
}
_FOLLOWED = {
    **_FREE,
    **_STEPPED,
    **_right_arm(52.0, -16.0, 26.0, -12.0),
    **{"left_plane": 105.0, "yaw": 24.0, "turn": 30.0, "bend": 30.0, "tip": 16.0, "nod": -26.0, "look": -22.0},
    **{"pelvis_x": 0.205, "pelvis_z": -0.075, "right_heel": 46.0},
}


def throw_keys() -> _Keys:
    """Wind-up, step, a right-handed throw, follow-through and the way back, over 3 s."""
    stepping = {name: 0.5 * (_WIND_UP.get(name, 0.0) + _COCKED.get(name, 0.0)) for name in {*_WIND_UP, *_COCKED}}
    stepping |= {"left_foot_x": 0.14, "left_foot_z": 0.075, "left_foot_pitch": -8.0}
    return [
        (0.0, READY),
        (0.2, READY),
        (0.72, _WIND_UP),
        (0.86, stepping),
        (1.0, _COCKED),
        (1.16, _RELEASE),
        (1.42, _FOLLOWED),
        (1.66, _FOLLOWED | {"right_raise": 44.0, "bend": 26.0}),
        (2.0, READY | _STEPPED | {"pelvis_x": 0.14, "pelvis_z": -0.05, "yaw": 8.0, "bend": 8.0}),
        (2.3, READY | {"left_foot_x": 0.15, "left_foot_z": 0.03, "pelvis_x": 0.05, "pelvis_z": -0.02, "yaw": 6.0}),
        (2.6, READY),
        (2.9, READY),
    ]


_OPEN, _HIGH = of_arms(96.0, 84.0, 22.0), of_arms(156.0, 62.0, 38.0)


def dance_keys() -> _Keys:
    """Side steps with swinging arms, a twisted trunk, a lunge, a whole turn, over 6.4 s."""
    turned = READY | _facing({"left": 360.0, "right": 360.0})
    return [(0.0, READY), (0.15, READY), *_side_steps(0.15), *_twists(2.35), *_turn(3.75), (6.1, turned), (6.4, turned)]


def _swing(side: str) -> dict[str, float]:
    """Both arms swung to one side at the height of the shoulders, the trunk with them."""
    other, sign = ("right", 1.0) if side == "left" else ("left", -1.0)
    arms = {f"{side}_raise": 88.0, f"{side}_plane": 78.0, f"{side}_elbow": 14.0}
    arms |= {f"{other}_raise": 78.0, f"{other}_plane": 2.0, f"{other}_elbow": 66.0, f"{other}_roll": -50.0}
    return arms | {"turn": 20.0 * sign, "yaw": 10.0 * sign, "look": 22.0 * sign, "lean": -7.0 * sign}


def _side_steps(start: float) -> _Keys:
    """Steps to the left and to the right again, twice as far back as forth, ending in the middle."""
    s = 0.115  # a step's share of the stature
    left, right = _swing("left"), _swing("right")
    steps = [
        (0.22, _OPEN, 0.6 * s, 0.0, "left", 0.2 * s, -0.012),
        (0.42, left, s, 0.0, "", 0.75 * s, -0.04),
        (0.62, left, s, 0.6 * s, "right", s, -0.03),
        (0.82, _OPEN, s, s, "", 0.85 * s, -0.008),
        (1.04, _OPEN, s, 0.1 * s, "right", 0.7 * s, -0.012),
        (1.24, right, s, -s, "", -0.7 * s, -0.075),
        (1.46, right, 0.0, -s, "left", -s, -0.03),
        (1.66, _OPEN, -s, -s, "", -0.9 * s, -0.008),
        (1.92, _HIGH, -0.3 * s, -s, "left", -0.8 * s, -0.012),
        (2.1, _HIGH, 0.3 * s, -0.3 * s, "", 0.0, -0.03),
    ]
    keys: _Keys = []
    for time, arms, left_foot, right_foot, lifted, across, up in steps:
        feet = {"left_foot_y": left_foot, "right_foot_y": -right_foot}
        feet |= {f"{lifted}_foot_z": 0.05, f"{lifted}_foot_pitch": 12.0} if lifted else {}
        keys.append((start + time, arms | feet | {"pelvis_y": across, "pelvis_z": up}))
    return keys


def _twists(start: float) -> _Keys:
    """Hips one way and shoulders the other, deeper each time."""

    def twist(angle: float, deep: float) -> Angles:
        trunk = {"yaw": -0.6 * angle, "turn": angle, "look": -0.3 * angle, "bend": 6.0}
        return both(foot_y=0.0345) | of_arms(58.0, 66.0, 98.0, roll=6.0) | trunk | {"pelvis_z": -deep, "knees_out": 0.2}

    turns = [(0.25, 32.0, 0.04), (0.5, -32.0, 0.07), (0.75, 34.0, 0.10), (1.0, -30.0, 0.06)]
    return [*((start + time, twist(angle, deep)) for time, angle, deep in turns), (start + 1.25, _OPEN | _LOW)]


_LOW = {"pelvis_z": -0.03} | both(foot_y=0.035)
"""Feet far enough apart to turn without touching."""


def _turn(start: float) -> _Keys:
    """Once round to the left in six steps, of 140 degrees but the last; the feet take turns and never meet."""
    targets = [("right", 70.0), ("left", 140.0), ("right", 210.0), ("left", 280.0), ("right", 360.0), ("left", 360.0)]
    yaw, time = {"left": 0.0, "right": 0.0}, start
    keys: _Keys = []
    for number, (side, goal) in enumerate(targets):
        trunk = _LOW | (_HIGH if number in (2, 3) else _OPEN) | {"turn": 12.0, "look": 14.0}
        middle = yaw | {side: 0.5 * (yaw[side] + goal)}
        yaw = yaw | {side: goal}
        keys.append((time + 0.18, trunk | _facing(middle) | {f"{side}_foot_z": 0.035}))
        keys.append((time + 0.34, trunk | _facing(yaw)))
        time += 0.34
    return keys


def _facing(yaw: Mapping[str, float]) -> dict[str, float]:
    """Feet turned by so many degrees, the pelvis half-way between them."""
    return {"yaw": 0.5 * (yaw["left"] + yaw["right"]), **{f"{side}_foot_yaw": angle for side, angle in yaw.items()}}
