"""Motions given by a few key poses: arms, squat and kick, and the still example poses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import PchipInterpolator

from sogjax.synth.anatomy import INDEX, SIDES, Anatomy, Pose
from sogjax.synth.limbs import heading_matrix, pose_from_angles, reach
from sogjax.synth.rotations import Matrix, Vector, turned

Angles = Mapping[str, float]
"""Angles of `pose_from_angles` in degrees, and `pelvis_x/y/z`, `tip` (pelvis forwards), `yaw` (pelvis to the left),
`knees_out` and `knees_up` (parts of the direction that knees bend to), and for the feet `left_foot_x/y/z`,
`left_foot_pitch` (toes down), `left_foot_yaw` (place and toes round to the left), `left_heel` (up, toes on the floor).
Places are shares of the stature, relative to standing upright."""


def both(**angles: float) -> dict[str, float]:
    """The same angles on both sides."""
    return {f"{side}_{name}": value for side in SIDES for name, value in angles.items()}


def standing_pose(anatomy: Anatomy, angles: Angles, place: Vector, heading: float) -> Pose:
    """A pose on two feet, which stay where standing feet are unless moved."""
    get = lambda name: float(angles.get(name, 0.0)) * anatomy.stature
    facing = heading_matrix(heading)
    pelvis = np.array([get("pelvis_x"), get("pelvis_y"), anatomy.hip_height - 0.012 + get("pelvis_z")])
    tipped = facing @ turned(
        ("z", angles.get("yaw", 0.0)), ("y", angles.get("tip", 0.0)), ("x", -angles.get("roll", 0.0))
    )
    pose = pose_from_angles(angles, place + facing @ pelvis, tipped)
    for side in SIDES:
        pose = _stood(anatomy, pose, side, angles, place, facing)
    return pose


def _stood(anatomy: Anatomy, pose: Pose, side: str, angles: Angles, place: Vector, facing: Matrix) -> Pose:
    """Set one foot where the angles say, and bend its knee."""
    get = lambda name: float(angles.get(f"{side}_{name}", 0.0))
    sign = 1.0 if side == "left" else -1.0
    x, y, z = (get(f"foot_{axis}") * anatomy.stature for axis in "xyz")
    aside = 0.062 * anatomy.stature
    ankle = np.array([x + 0.01, sign * (aside + y), anatomy.ankle_height + z])
    ground, outwards = facing @ turned(("z", get("foot_yaw"))), turned(("z", 9.0 * sign))
    sole = ground @ turned(("z", 9.0 * sign), ("y", get("foot_pitch")))
    if get("heel") != 0.0:
        ball = np.array([anatomy.offsets[INDEX[f"{side}_toe"]][0], 0.0, -anatomy.ankle_height])
        raised = turned(("y", get("heel")))
        ankle, sole = ankle + outwards @ (ball - raised @ ball), sole @ raised
        pose = pose.with_rotation(f"{side}_toe", raised.T)
    out, up = angles.get("knees_out", 0.0), angles.get("knees_up", 0.0)
    knee_towards = ground @ np.array([1.0, sign * (0.12 + out), 0.15 + up])
    limb = (f"{side}_hip", f"{side}_knee", f"{side}_ankle")
    return reach(anatomy, pose, limb, place + ground @ ankle, knee_towards, sole)


@dataclass(frozen=True)
class Exercise:
    """Key poses, passed through smoothly, again and again."""

    anatomy: Anatomy
    keys: Sequence[tuple[float, Angles]]
    """Seconds and poses; the last pose equals the first."""
    place: Vector
    heading: float
    delay: float = 0.0
    """Seconds by which the person starts later."""
    _curves: dict[str, PchipInterpolator] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Lay a curve without overshoot through the values of each angle."""
        times = np.array([time for time, _ in self.keys])
        for name in sorted({name for _, angles in self.keys for name in angles}):
            values = np.array([angles.get(name, 0.0) for _, angles in self.keys])
            self._curves[name] = PchipInterpolator(times, values)

    def __call__(self, time: float) -> Pose:
        """The pose at a time (seconds)."""
        return standing_pose(self.anatomy, self.angles(time), self.place, self.heading)

    def angles(self, time: float) -> dict[str, float]:
        """What lies between the key poses at a time (seconds)."""
        since = max(time - self.delay, 0.0) % self.keys[-1][0]
        return {name: float(curve(since)) for name, curve in self._curves.items()}


READY = both(**{"raise": 16.0, "plane": 85.0, "elbow": 10.0})
"""Standing with the arms a little away from the body."""

_HUG = {
    **both(plane=4.0, roll=-72.0, elbow=112.0),
    "left_raise": 74.0,
    "right_raise": 50.0,
    "bend": 6.0,
}

ARMS: Sequence[tuple[float, Angles]] = (
    (0.0, READY),
    (0.3, READY),
    (1.0, both(**{"raise": 92.0, "plane": 80.0, "elbow": 12.0})),
    (1.75, _HUG),
    (2.5, {**_HUG, "turn": 32.0, "look": -12.0}),
    (3.2, {**both(**{"raise": 160.0, "plane": 72.0, "elbow": 14.0}), "turn": -10.0}),
    (4.0, {**both(**{"raise": 88.0, "plane": 86.0, "elbow": 92.0, "roll": 80.0}), "turn": -28.0}),
    (4.8, {**both(**{"raise": 40.0, "plane": 50.0, "elbow": 95.0, "roll": -45.0}), "lean": 8.0}),
    (5.6, READY),
    (6.0, READY),
)

_SQUAT = {
    **both(**{"raise": 118.0, "plane": 8.0, "elbow": 8.0, "roll": -10.0}),
    "pelvis_z": -0.205,
    "pelvis_x": -0.085,
    "tip": 28.0,
    "bend": 16.0,
    "nod": -22.0,
    "knees_out": 0.25,
}
_GUARD = both(**{"raise": 32.0, "plane": 40.0, "elbow": 92.0, "roll": -12.0})


def _kick(side: str) -> list[tuple[float, Angles]]:
    """Chamber, kick and draw back one leg, over 1.5 s."""
    weight = 0.052 * (-1.0 if side == "left" else 1.0)
    chamber = {
        **_GUARD,
        "pelvis_y": weight,
        "pelvis_z": -0.012,
        "tip": -4.0,
        f"{side}_foot_x": 0.02,
        f"{side}_foot_y": -0.02,
        f"{side}_foot_z": 0.20,
        f"{side}_foot_pitch": 32.0,
    }
    kick = {
        **chamber,
        "tip": -14.0,
        "bend": 4.0,
        "pelvis_x": 0.01,
        f"{side}_foot_x": 0.46,
        f"{side}_foot_y": -0.035,
        f"{side}_foot_z": 0.37,
        f"{side}_foot_pitch": -38.0,
    }
    shifted = {**_GUARD, "pelvis_y": weight, "pelvis_z": -0.008}
    return [(0.0, shifted), (0.35, chamber), (0.62, kick), (0.90, chamber), (1.3, shifted)]


def squat_kick_keys() -> list[tuple[float, Angles]]:
    """Squat, kick with the right leg, squat again, kick with the left one."""
    keys: list[tuple[float, Angles]] = [(0.0, READY), (0.3, READY)]
    for side in ("right", "left"):
        start = keys[-1][0]
        keys += [(start + 0.75, _SQUAT), (start + 0.95, _SQUAT), (start + 1.6, _GUARD)]
        keys += [(start + 1.95 + time, angles) for time, angles in _kick(side)]
        keys.append((start + 3.6, READY))
    return keys


EXAMPLE_POSES: dict[str, Angles] = {
    "tpose": both(**{"raise": 89.0, "plane": 88.0, "elbow": 3.0}),
    "arms_up": both(**{"raise": 166.0, "plane": 80.0, "elbow": 6.0}),
    "elbows": both(**{"raise": 86.0, "plane": 86.0, "roll": 88.0, "elbow": 90.0}),
    "squat": _SQUAT,
}
"""The stills from which an actor's size and colours are estimated."""
