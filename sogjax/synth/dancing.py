"""A dance on the spot: side steps with swinging arms, a twisted trunk, a lunge, a whole turn."""

from sogjax.synth.exercises import READY, Angles, both

_SIDE = 0.115
"""Share of the stature by which a side step goes aside."""
_WIDE = both(foot_y=0.035)
"""Feet far enough apart to turn without touching."""
_OPEN = both(**{"raise": 96.0, "plane": 84.0, "elbow": 22.0})
_HIGH = both(**{"raise": 156.0, "plane": 62.0, "elbow": 38.0})
_DOWN = {"pelvis_z": -0.03, **_WIDE}


def dance_keys() -> list[tuple[float, Angles]]:
    """Key poses of the dance, over 6.4 s."""
    turned = {**READY, **_turned({"left": 360.0, "right": 360.0})}
    return [(0.0, READY), (0.15, READY), *_side_steps(0.15), *_twists(2.35), *_turn(3.75), (6.1, turned), (6.4, turned)]


def _swing(side: str) -> dict[str, float]:
    """Both arms swung to one side at the height of the shoulders, the trunk with them."""
    other = "right" if side == "left" else "left"
    sign = 1.0 if side == "left" else -1.0
    arms = {f"{side}_raise": 88.0, f"{side}_plane": 78.0, f"{side}_elbow": 14.0}
    arms |= {f"{other}_raise": 78.0, f"{other}_plane": 2.0, f"{other}_elbow": 66.0, f"{other}_roll": -50.0}
    return arms | {"turn": 20.0 * sign, "yaw": 10.0 * sign, "look": 22.0 * sign, "lean": -7.0 * sign}


def _side_steps(start: float) -> list[tuple[float, Angles]]:
    """To the left and to the right again, twice as far back as forth, ending in the middle."""
    feet = lambda left, right: {"left_foot_y": left, "right_foot_y": -right}
    lifted = lambda side: {f"{side}_foot_z": 0.05, f"{side}_foot_pitch": 12.0}
    s = _SIDE
    return [
        (start + 0.22, {**_OPEN, **feet(0.6 * s, 0.0), **lifted("left"), "pelvis_y": 0.2 * s, "pelvis_z": -0.012}),
        (start + 0.42, {**_swing("left"), **feet(s, 0.0), "pelvis_y": 0.75 * s, "pelvis_z": -0.04}),
        (start + 0.62, {**_swing("left"), **feet(s, 0.6 * s), **lifted("right"), "pelvis_y": s, "pelvis_z": -0.03}),
        (start + 0.82, {**_OPEN, **feet(s, s), "pelvis_y": 0.85 * s, "pelvis_z": -0.008}),
        (start + 1.04, {**_OPEN, **feet(s, 0.1 * s), **lifted("right"), "pelvis_y": 0.7 * s, "pelvis_z": -0.012}),
        (start + 1.24, {**_swing("right"), **feet(s, -s), "pelvis_y": -0.7 * s, "pelvis_z": -0.075}),
        (start + 1.46, {**_swing("right"), **feet(0.0, -s), **lifted("left"), "pelvis_y": -s, "pelvis_z": -0.03}),
        (start + 1.66, {**_OPEN, **feet(-s, -s), "pelvis_y": -0.9 * s, "pelvis_z": -0.008}),
        (start + 1.92, {**_HIGH, **feet(-0.3 * s, -s), **lifted("left"), "pelvis_y": -0.8 * s, "pelvis_z": -0.012}),
        (start + 2.1, {**_HIGH, **feet(0.3 * s, -0.3 * s), "pelvis_y": 0.0, "pelvis_z": -0.03}),
    ]


def _twists(start: float) -> list[tuple[float, Angles]]:
    """Hips one way and shoulders the other, deeper each time."""
    still = both(foot_y=0.3 * _SIDE)
    elbows = both(**{"raise": 58.0, "plane": 66.0, "elbow": 98.0, "roll": 6.0})
    twist = lambda angle, deep: {
        **still,
        **elbows,
        "yaw": -0.6 * angle,
        "turn": angle,
        "look": -0.3 * angle,
        "pelvis_z": -deep,
        "knees_out": 0.2,
        "bend": 6.0,
    }
    return [
        (start + 0.25, twist(32.0, 0.04)),
        (start + 0.5, twist(-32.0, 0.07)),
        (start + 0.75, twist(34.0, 0.10)),
        (start + 1.0, twist(-30.0, 0.06)),
        (start + 1.25, {**_DOWN, **_OPEN}),
    ]


def _turn(start: float) -> list[tuple[float, Angles]]:
    """Once round to the left in five steps of 140 degrees; the feet take turns and never meet."""
    targets = [("right", 70.0), ("left", 140.0), ("right", 210.0), ("left", 280.0), ("right", 360.0), ("left", 360.0)]
    yaw = {"left": 0.0, "right": 0.0}
    keys: list[tuple[float, Angles]] = []
    time = start
    for number, (side, goal) in enumerate(targets):
        middle = {**yaw, side: 0.5 * (yaw[side] + goal)}
        keys.append((time + 0.18, _turning(middle, number, {f"{side}_foot_z": 0.035})))
        yaw[side] = goal
        keys.append((time + 0.34, _turning(yaw, number, {})))
        time += 0.34
    return keys


def _turning(yaw: dict[str, float], number: int, lifted: Angles) -> Angles:
    arms = _HIGH if number in (2, 3) else _OPEN
    return {**_DOWN, **arms, **_turned(yaw), **lifted, "turn": 12.0, "look": 14.0}


def _turned(yaw: dict[str, float]) -> dict[str, float]:
    return {"yaw": 0.5 * (yaw["left"] + yaw["right"]), **{f"{side}_foot_yaw": angle for side, angle in yaw.items()}}
