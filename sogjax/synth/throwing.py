"""An overarm throw: wind-up, step, throw, follow-through."""

from sogjax.synth.exercises import READY, Angles

_AIM = {"left_raise": 78.0, "left_plane": 22.0, "left_elbow": 18.0}
_FREE = {"left_raise": 30.0, "left_plane": 70.0, "left_elbow": 60.0}
_STEPPED = {"left_foot_x": 0.30, "left_foot_y": 0.015}

_WIND_UP = {
    **_AIM,
    "right_raise": 62.0,
    "right_plane": 110.0,
    "right_elbow": 70.0,
    "right_roll": 20.0,
    "yaw": -40.0,
    "turn": -24.0,
    "look": 42.0,
    "pelvis_x": -0.055,
    "pelvis_z": -0.016,
    "right_foot_yaw": -24.0,
}
_COCKED = {
    **_AIM,
    **_STEPPED,
    "right_raise": 94.0,
    "right_plane": 106.0,
    "right_elbow": 92.0,
    "right_roll": 98.0,
    "yaw": -28.0,
    "turn": -26.0,
    "look": 40.0,
    "pelvis_x": 0.06,
    "pelvis_z": -0.055,
    "right_foot_yaw": -24.0,
}
_RELEASE = {
    **_FREE,
    **_STEPPED,
    "right_raise": 122.0,
    "right_plane": 52.0,
    "right_elbow": 30.0,
    "right_roll": 62.0,
    "yaw": 12.0,
    "turn": 22.0,
    "bend": 12.0,
    "tip": 6.0,
    "look": -14.0,
    "pelvis_x": 0.155,
    "pelvis_z": -0.062,
    "right_foot_yaw": -8.0,
    "right_heel": 24.0,
}
_FOLLOWED = {
    **_FREE,
    **_STEPPED,
    "left_plane": 105.0,
    "right_raise": 52.0,
    "right_plane": -16.0,
    "right_elbow": 26.0,
    "right_roll": -12.0,
    "yaw": 24.0,
    "turn": 30.0,
    "bend": 30.0,
    "tip": 16.0,
    "nod": -26.0,
    "look": -22.0,
    "pelvis_x": 0.205,
    "pelvis_z": -0.075,
    "right_heel": 46.0,
}


def throw_keys() -> list[tuple[float, Angles]]:
    """Key poses of a right-handed throw and the way back, over 3 s."""
    stepping = {name: 0.5 * (_WIND_UP.get(name, 0.0) + _COCKED.get(name, 0.0)) for name in {*_WIND_UP, *_COCKED}}
    stepping |= {"left_foot_x": 0.14, "left_foot_z": 0.075, "left_foot_pitch": -8.0}
    back = {**READY, "left_foot_x": 0.15, "left_foot_z": 0.03, "pelvis_x": 0.05, "pelvis_z": -0.02, "yaw": 6.0}
    return [
        (0.0, READY),
        (0.2, READY),
        (0.72, _WIND_UP),
        (0.86, stepping),
        (1.0, _COCKED),
        (1.16, _RELEASE),
        (1.42, _FOLLOWED),
        (1.66, _FOLLOWED | {"right_raise": 44.0, "bend": 26.0}),
        (2.0, {**READY, **_STEPPED, "pelvis_x": 0.14, "pelvis_z": -0.05, "yaw": 8.0, "bend": 8.0}),
        (2.3, back),
        (2.6, READY),
        (2.9, READY),
    ]
