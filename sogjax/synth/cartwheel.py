"""A cartwheel to the left: the body turns about its front while feet and hands touch the floor one by one."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import PchipInterpolator

from sogjax.synth.anatomy import INDEX, SIDES, Anatomy, Pose
from sogjax.synth.exercises import READY, both
from sogjax.synth.limbs import heading_matrix, pose_from_angles, reach
from sogjax.synth.rotations import Vector, between, turned

_MIDDLE = 0.735
"""Where the body is upside down; lengths are shares of the stature, along the way from the place of the start."""
_HANDS = {"left": 0.625, "right": 0.845}
_HALF = 1.65
"""Seconds from the start to upside down."""
_REST = 0.3
"""Seconds of standing still before the way back."""
_WRIST_HEIGHT = 0.021
"""Of a hand flat on the floor."""

_FLAT_HAND = {
    # Palms down, the fingers forwards and a little inwards; an upright hand's fingers point down its -z axis.
    "left": np.stack([[0.6, -0.8, 0.0], [0.0, 0.0, 1.0], [-0.8, -0.6, 0.0]], axis=1),
    "right": np.stack([[0.6, 0.8, 0.0], [0.0, 0.0, -1.0], [-0.8, 0.6, 0.0]], axis=1),
}
"""Of a body that faces along x; columns are the hand's axes."""

_STANDING = {"left_foot": 1.0, "right_foot": 1.0, "left_foot_y": 0.062, "right_foot_y": -0.062}
_UP = both(**{"raise": 168.0, "plane": 82.0, "elbow": 4.0})
_OPEN = both(spread=48.0, knee=4.0)
_LUNGE = {**_STANDING, "left_foot_y": 0.24}
_FLYING = {"right_foot_y": -0.062, "left_foot_y": 0.24}

_FIRST_HALF: tuple[tuple[float, Mapping[str, float]], ...] = (
    (0.0, {**_STANDING, **READY, "turned": 0.0, "y": 0.0, "z": 0.0}),
    (0.15, {**_STANDING, **READY, "turned": 0.0, "y": 0.0, "z": 0.0}),
    (0.55, {**_STANDING, **_UP, "turned": -2.0, "y": -0.012}),
    (0.72, {**_LUNGE, **_UP, "left_foot_y": 0.16, "left_foot_z": 0.045, "turned": 2.0, "y": 0.03, "z": -0.012}),
    (0.90, {**_LUNGE, **_UP, "turned": 12.0, "y": 0.115, "z": -0.035, "left_hand": 0.0}),
    (1.12, {**_FLYING, **_UP, **_OPEN, "left_foot": 1.0, "turned": 50.0, "y": 0.235, "z": -0.078}),
    (1.30, {**_FLYING, **_UP, **_OPEN, "left_foot": 1.0, "turned": 90.0, "y": 0.345, "z": -0.068, "left_hand": 1.0}),
    (1.44, {**_FLYING, **_UP, **_OPEN, "turned": 126.0, "z": 0.01, "left_hand": 1.0, "right_hand": 0.35}),
    (1.53, {**_FLYING, **_UP, **_OPEN, "turned": 150.0, "z": 0.06, "left_hand": 1.0, "right_hand": 1.0}),
)


@dataclass(frozen=True)
class Cartwheel:
    """Stands, wheels to the left, stands, wheels back to the right, and so on."""

    anatomy: Anatomy
    middle: Vector
    """Metres on the floor, below the body when it is upside down."""
    heading: float
    """Radians; where the front faces. The way leads to the left of it."""
    delay: float = 0.0
    _curves: dict[str, PchipInterpolator] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Complete the first half by its mirror image and lay smooth curves through the values."""
        top = {**_FLYING, **_UP, **_OPEN, "left_hand": 1.0, "right_hand": 1.0, "turned": 180.0, "y": _MIDDLE}
        top |= {"z": self._height_upside_down(), "left_foot_y": _MIDDLE, "right_foot_y": _MIDDLE}
        first = [*_FIRST_HALF, (_HALF, top)]
        keys = first + [(2.0 * _HALF - time, _mirrored(angles)) for time, angles in first[-2::-1]]
        for name in sorted({name for _, angles in keys for name in angles}):
            known = [(time, angles) for time, angles in keys if name in angles or name not in ("y", "z")]
            values = [angles.get(name, 0.0) for _, angles in known]
            self._curves[name] = PchipInterpolator([time for time, _ in known], values)

    def __call__(self, time: float) -> Pose:
        """The pose at a time (seconds)."""
        period = 2.0 * _HALF + _REST
        since = max(time - self.delay, 0.0) % (2.0 * period)
        since = min(since, 2.0 * _HALF) if since < period else max(2.0 * period - _REST - since, 0.0)
        values = {name: float(curve(since)) for name, curve in self._curves.items()}
        facing, stature = heading_matrix(self.heading), self.anatomy.stature
        pelvis = np.array([0.0, (values["y"] - _MIDDLE) * stature, self._standing() + values["z"] * stature])
        body = facing @ turned(("x", -values["turned"]))
        floor = {name: self.middle + facing @ np.array([0.0, y * stature, 0.0]) for name, y in _places(values)}
        pose = pose_from_angles(values, self.middle + facing @ pelvis, body)
        for side in SIDES:
            pose = self._foot(pose, side, floor[f"{side}_foot"], values)
            pose = self._hand(pose, side, floor[f"{side}_hand"], values[f"{side}_hand"])
        return pose

    def _standing(self) -> float:
        return self.anatomy.hip_height - 0.012

    def _height_upside_down(self) -> float:
        """Height of the pelvis over that of standing, on almost straight arms; a share of the stature."""
        pose = pose_from_angles(_UP, np.zeros(3))
        arms = self.anatomy.world_from_joint(pose)[INDEX["left_wrist"], 2, 3]
        return 0.985 * arms / self.anatomy.stature + _WRIST_HEIGHT - self._standing() / self.anatomy.stature

    def _foot(self, pose: Pose, side: str, floor: Vector, values: Mapping[str, float]) -> Pose:
        """Hold a foot at its place on the floor, as far as its hold is 1."""
        hold, facing = values[f"{side}_foot"], heading_matrix(self.heading)
        joint = INDEX[f"{side}_ankle"]
        free = self.anatomy.world_from_joint(pose)[joint]
        lift = values.get(f"{side}_foot_z", 0.0) * self.anatomy.stature
        held = floor + np.array([0.0, 0.0, self.anatomy.ankle_height + lift])
        target = free[:3, 3] + hold * (held - free[:3, 3])
        limb = (f"{side}_hip", f"{side}_knee", f"{side}_ankle")
        pose = reach(self.anatomy, pose, limb, target, facing[:, 0] + 1e-3)
        shin = self.anatomy.world_from_joint(pose)[INDEX[f"{side}_knee"], :3, :3]
        flat = shin.T @ facing @ turned(("z", 9.0 if side == "left" else -9.0))
        pointed = turned(("y", 40.0 * (1.0 - hold)))
        return pose.with_rotation(f"{side}_ankle", between(pointed, flat, hold))

    def _hand(self, pose: Pose, side: str, floor: Vector, hold: float) -> Pose:
        """Hold a hand at its place on the floor, as far as its hold is 1."""
        free = self.anatomy.world_from_joint(pose)[INDEX[f"{side}_wrist"], :3, 3]
        held = floor + np.array([0.0, 0.0, _WRIST_HEIGHT * self.anatomy.stature])
        target = free + hold * (held - free)
        limb = (f"{side}_shoulder", f"{side}_elbow", f"{side}_wrist")
        facing = heading_matrix(self.heading)
        pose = reach(self.anatomy, pose, limb, target, -facing[:, 0])
        forearm = self.anatomy.world_from_joint(pose)[INDEX[f"{side}_elbow"], :3, :3]
        flat = forearm.T @ facing @ _FLAT_HAND[side]
        return pose.with_rotation(f"{side}_wrist", between(np.eye(3), flat, hold))


def _places(values: Mapping[str, float]) -> list[tuple[str, float]]:
    """Where along the way feet and hands are held, from the middle on."""
    feet = [(f"{side}_foot", values[f"{side}_foot_y"] - _MIDDLE) for side in SIDES]
    return feet + [(f"{side}_hand", _HANDS[side] - _MIDDLE) for side in SIDES]


def _mirrored(angles: Mapping[str, float]) -> dict[str, float]:
    """The same moment of the second half: left and right exchanged, seen from the other end of the way."""
    swap = {"left": "right", "right": "left"}
    result = {}
    for name, value in angles.items():
        side, _, rest = name.partition("_")
        swapped = f"{swap[side]}_{rest}" if side in swap else name
        if name == "turned":
            value = 360.0 - value
        elif name == "y" or name.endswith("_foot_y"):
            value = 2.0 * _MIDDLE - value
        result[swapped] = value
    return result
