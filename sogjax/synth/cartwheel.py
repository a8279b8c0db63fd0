"""A cartwheel to the left: the body turns about its front while feet and hands touch the floor one by one."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import PchipInterpolator

from sogjax.synth.anatomy import INDEX, SIDES, Anatomy, Pose
from sogjax.synth.exercises import READY, Angles, both, curves_through, of_arms
from sogjax.synth.limbs import arm, heading_matrix, leg, pose_from_angles, reach
from sogjax.synth.rotations import Matrix, Vector, between, turned

_MIDDLE = 0.735
"""Where the body is upside down; lengths are shares of the stature, along the way from the place of the start."""
_HANDS = {"left": 0.625, "right": 0.845}
_HALF = 1.65
"""Seconds from the start to upside down."""
_REST = 0.3
"""Seconds of standing still before the way back."""
_WRIST_HEIGHT = 0.021
"""Height of the wrist of a hand flat on the floor."""

_FLAT_HAND = {
    # Palms down, the fingers forwards and a little inwards; an upright hand's fingers point down its -z axis.
    "left": np.stack([[0.6, -0.8, 0.0], [0.0, 0.0, 1.0], [-0.8, -0.6, 0.0]], axis=1),
    "right": np.stack([[0.6, 0.8, 0.0], [0.0, 0.0, -1.0], [-0.8, 0.6, 0.0]], axis=1),
}
"""The hands of a body that faces along x; columns are the hand's axes."""

_STANDING = {"left_foot": 1.0, "right_foot": 1.0, "left_foot_y": 0.062, "right_foot_y": -0.062}
_UP = of_arms(168.0, 82.0, 4.0)
_LUNGE = _STANDING | _UP | {"left_foot_y": 0.24}
_FLYING = {"right_foot_y": -0.062, "left_foot_y": 0.24} | _UP | both(spread=48.0, knee=4.0)
_READY = _STANDING | READY | {"turned": 0.0, "y": 0.0, "z": 0.0}
_FIRST_HALF: tuple[tuple[float, Angles], ...] = (
    (0.0, _READY),
    (0.15, _READY),
    (0.55, _STANDING | _UP | {"turned": -2.0, "y": -0.012}),
    (0.72, _LUNGE | {"left_foot_y": 0.16, "left_foot_z": 0.045, "turned": 2.0, "y": 0.03, "z": -0.012}),
    (0.90, _LUNGE | {"turned": 12.0, "y": 0.115, "z": -0.035, "left_hand": 0.0}),
    (1.12, _FLYING | {"left_foot": 1.0, "turned": 50.0, "y": 0.235, "z": -0.078}),
    (1.30, _FLYING | {"left_foot": 1.0, "turned": 90.0, "y": 0.345, "z": -0.068, "left_hand": 1.0}),
    (1.44, _FLYING | {"turned": 126.0, "z": 0.01, "left_hand": 1.0, "right_hand": 0.35}),
    (1.53, _FLYING | {"turned": 150.0, "z": 0.06, "left_hand": 1.0, "right_hand": 1.0}),
)
"""Places of hands and feet, how far these are held there, and how far the body is turned."""


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
        top = _FLYING | {"left_hand": 1.0, "right_hand": 1.0, "turned": 180.0, "y": _MIDDLE}
        top |= {"z": self._height_upside_down(), "left_foot_y": _MIDDLE, "right_foot_y": _MIDDLE}
        first = [*_FIRST_HALF, (_HALF, top)]
        keys = first + [(2.0 * _HALF - time, _mirrored(angles)) for time, angles in first[-2::-1]]
        self._curves.update(curves_through(keys, only_where_named=("y", "z")))

    def __call__(self, time: float) -> Pose:
        """The pose at a time (seconds)."""
        period = 2.0 * _HALF + _REST
        since = max(time - self.delay, 0.0) % (2.0 * period)
        since = min(since, 2.0 * _HALF) if since < period else max(2.0 * period - _REST - since, 0.0)
        values = {name: float(curve(since)) for name, curve in self._curves.items()}
        facing, stature = heading_matrix(self.heading), self.anatomy.stature
        pelvis = np.array([0.0, (values["y"] - _MIDDLE) * stature, self._standing() + values["z"] * stature])
        pose = pose_from_angles(values, self.middle + facing @ pelvis, facing @ turned(("x", -values["turned"])))
        floor = lambda y: self.middle + facing @ np.array([0.0, (y - _MIDDLE) * stature, 0.0])
        for side in SIDES:
            pose = self._foot(pose, side, floor(values[f"{side}_foot_y"]), values, facing)
            pose = self._hand(pose, side, floor(_HANDS[side]), values[f"{side}_hand"], facing)
        return pose

    def _standing(self) -> float:
        return self.anatomy.hip_height - 0.012

    def _height_upside_down(self) -> float:
        """Height of the pelvis over that of standing, on almost straight arms; a share of the stature."""
        pose = pose_from_angles(_UP, np.zeros(3))
        arms = self.anatomy.world_from_joint(pose)[INDEX["left_wrist"], 2, 3]
        return 0.985 * arms / self.anatomy.stature + _WRIST_HEIGHT - self._standing() / self.anatomy.stature

    def _foot(self, pose: Pose, side: str, floor: Vector, values: Mapping[str, float], facing: Matrix) -> Pose:
        """Hold a foot at its place on the floor, as far as its hold is 1."""
        hold = values[f"{side}_foot"]
        free = self.anatomy.world_from_joint(pose)[INDEX[f"{side}_ankle"], :3, 3]
        lift = values.get(f"{side}_foot_z", 0.0) * self.anatomy.stature
        held = floor + np.array([0.0, 0.0, self.anatomy.ankle_height + lift])
        pose = reach(self.anatomy, pose, leg(side), free + hold * (held - free), facing[:, 0] + 1e-3)
        shin = self.anatomy.world_from_joint(pose)[INDEX[f"{side}_knee"], :3, :3]
        flat = shin.T @ facing @ turned(("z", 9.0 if side == "left" else -9.0))
        pointed = turned(("y", 40.0 * (1.0 - hold)))
        return pose.with_rotation(f"{side}_ankle", between(pointed, flat, hold))

    def _hand(self, pose: Pose, side: str, floor: Vector, hold: float, facing: Matrix) -> Pose:
        """Hold a hand at its place on the floor, as far as its hold is 1."""
        free = self.anatomy.world_from_joint(pose)[INDEX[f"{side}_wrist"], :3, 3]
        held = floor + np.array([0.0, 0.0, _WRIST_HEIGHT * self.anatomy.stature])
        pose = reach(self.anatomy, pose, arm(side), free + hold * (held - free), -facing[:, 0])
        forearm = self.anatomy.world_from_joint(pose)[INDEX[f"{side}_elbow"], :3, :3]
        flat = forearm.T @ facing @ _FLAT_HAND[side]
        return pose.with_rotation(f"{side}_wrist", between(np.eye(3), flat, hold))


def _mirrored(angles: Angles) -> dict[str, float]:
    """The matching moment of the second half: left and right exchanged, seen from the other end of the way."""
    swap = {"left": "right", "right": "left"}
    result = {}
    for name, value in angles.items():
        side, _, rest = name.partition("_")
        if name == "turned":
            value = 360.0 - value
        elif name == "y" or name.endswith("_foot_y"):
            value = 2.0 * _MIDDLE - value
        result[f"{swap[side]}_{rest}" if side in swap else name] = value
    return result
