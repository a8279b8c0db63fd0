"""Motions given by a few key poses, on two feet, with hands that may be held at places."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from scipy.interpolate import PchipInterpolator

from sogjax.synth.anatomy import INDEX, SIDES, Anatomy, Pose
from sogjax.synth.limbs import arm, heading_matrix, leg, pose_from_angles, reach
from sogjax.synth.rotations import Matrix, Vector, between, turned, unit

Angles = Mapping[str, float]
"""Angles of `pose_from_angles` in degrees, and `pelvis_x/y/z`, `tip` (pelvis forwards), `yaw` (pelvis to the left),
`knees_out` and `knees_up` (parts of the direction that knees bend to), and for the feet `left_foot_x/y/z`,
`left_foot_pitch` (toes down), `left_foot_yaw` (place and toes round to the left), `left_heel` (up, toes on the floor).
Places are shares of the stature, relative to standing upright."""
Keys = Sequence[tuple[float, Angles]]
"""Seconds and poses."""
Direction = tuple[float, float, float]


def both(**angles: float) -> dict[str, float]:
    """The same angles on both sides."""
    return {f"{side}_{name}": value for side in SIDES for name, value in angles.items()}


def of_arms(raise_: float, plane: float, elbow: float, **more: float) -> dict[str, float]:
    """The same angles of both arms."""
    return both(**{"raise": raise_, "plane": plane, "elbow": elbow, **more})


def curves_through(keys: Keys, only_where_named: tuple[str, ...] = ()) -> dict[str, PchipInterpolator]:
    """A curve without overshoot for each angle; a pose that does not name it has 0 there, or leaves it free."""
    curves = {}
    for name in sorted({name for _, angles in keys for name in angles}):
        known = [(time, angles) for time, angles in keys if name in angles or name not in only_where_named]
        values = [angles.get(name, 0.0) for _, angles in known]
        curves[name] = PchipInterpolator([time for time, _ in known], values)
    return curves


def standing_pose(anatomy: Anatomy, angles: Angles, place: Vector, heading: float) -> Pose:
    """A pose on two feet, which stay where standing feet are unless moved."""
    get = lambda name: float(angles.get(name, 0.0))
    facing = heading_matrix(heading)
    x, y, z = (get(f"pelvis_{axis}") * anatomy.stature for axis in "xyz")
    pelvis = np.array([x, y, anatomy.hip_height - 0.012 + z])
    tipped = facing @ turned(("z", get("yaw")), ("y", get("tip")))
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
    return reach(anatomy, pose, leg(side), place + ground @ ankle, knee_towards, sole)


@dataclass(frozen=True)
class Exercise:
    """Key poses, passed through smoothly, again and again."""

    anatomy: Anatomy
    keys: Keys
    """The last pose equals the first."""
    place: Vector
    heading: float
    delay: float = 0.0
    """Seconds by which the person starts later."""
    _curves: dict[str, PchipInterpolator] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Lay curves through the key poses."""
        self._curves.update(curves_through(self.keys))

    def __call__(self, time: float) -> Pose:
        """The pose at a time (seconds)."""
        return standing_pose(self.anatomy, self.angles(time), self.place, self.heading)

    def angles(self, time: float) -> dict[str, float]:
        """What lies between the key poses at a time (seconds)."""
        since = max(time - self.delay, 0.0) % self.keys[-1][0]
        return {name: float(curve(since)) for name, curve in self._curves.items()}


@dataclass(frozen=True)
class Handling:
    """An exercise in which the wrists are held at places, as far as the keys `left_hand` and `right_hand` are 1.

    The keys `left_hand_x/y/z` say where: metres in `frame`.
    """

    exercise: Exercise
    frame: Callable[[float], Float[np.ndarray, "4 4"]]
    """World from the frame of the hands' places, at a time (seconds)."""
    elbows: tuple[Direction, Direction] = ((-0.3, 0.7, -0.8), (-0.3, 0.7, -0.8))
    """Where the left and the right elbow point while the hand is held: forwards, outwards, upwards of the chest."""
    flat: bool = False
    """Whether held hands lie flat, palms down."""

    def __call__(self, time: float) -> Pose:
        """The pose at a time (seconds)."""
        pose, values, frame = self.exercise(time), self.exercise.angles(time), self.frame(time)
        for side in SIDES:
            if values[f"{side}_hand"] > 0.0:
                pose = self._held(pose, side, values, frame)
        return pose

    def _held(self, pose: Pose, side: str, values: Angles, frame: Float[np.ndarray, "4 4"]) -> Pose:
        hold, anatomy = values[f"{side}_hand"], self.exercise.anatomy
        frames = anatomy.world_from_joint(pose)
        shoulder, elbow, wrist = (frames[INDEX[joint], :3, 3] for joint in arm(side))
        held = frame[:3, :3] @ [values[f"{side}_hand_{axis}"] for axis in "xyz"] + frame[:3, 3]
        ahead, outwards, upwards = self.elbows[SIDES.index(side)]
        wanted = np.array([ahead, outwards if side == "left" else -outwards, upwards])
        # The free elbow lies aside of the line from shoulder to wrist: from there it moves over to where it is wanted.
        free = unit(elbow - 0.5 * (shoulder + wrist))
        pole = (1.0 - hold) * free + hold * unit(frames[INDEX["chest"], :3, :3] @ wanted)
        pose = reach(anatomy, pose, arm(side), wrist + hold * (held - wrist), pole)
        return self._laid(pose, side, hold) if self.flat else pose

    def _laid(self, pose: Pose, side: str, hold: float) -> Pose:
        """Turn a hand palm down, its fingers where the forearm points to."""
        forearm = self.exercise.anatomy.world_from_joint(pose)[INDEX[f"{side}_elbow"], :3, :3]
        back = unit(forearm[:, 2] * [1.0, 1.0, 0.0])
        over = np.array([0.0, 0.0, 1.0 if side == "left" else -1.0])
        hand = np.stack([np.cross(over, back), over, back], axis=1)
        wrist = f"{side}_wrist"
        return pose.with_rotation(wrist, between(pose.rotations[INDEX[wrist]], forearm.T @ hand, hold))


READY = of_arms(16.0, 85.0, 10.0)
"""Standing with the arms a little away from the body."""
SQUAT = of_arms(118.0, 8.0, 8.0, roll=-10.0) | {
    **{"pelvis_z": -0.205, "pelvis_x": -0.085, "tip": 28.0, "bend": 16.0, "nod": -22.0, "knees_out": 0.25}
}
EXAMPLE_POSES: dict[str, Angles] = {
    "tpose": of_arms(89.0, 88.0, 3.0),
    "arms_up": of_arms(166.0, 80.0, 6.0),
    "elbows": of_arms(86.0, 86.0, 90.0, roll=88.0),
    "squat": SQUAT,
}
"""The stills from which an actor's size and colours are estimated."""
