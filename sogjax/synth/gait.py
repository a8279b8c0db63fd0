"""Walking along a curve: footsteps planned first, then legs that reach for them."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float
from scipy.interpolate import PchipInterpolator

from sogjax.synth.anatomy import INDEX, SIDES, Anatomy, Pose
from sogjax.synth.limbs import heading_matrix, leg, pose_from_angles, reach
from sogjax.synth.rotations import Matrix, Vector, turned

Path = Callable[[float], tuple[Float[np.ndarray, "2"], float]]
"""Place on the floor and heading (radians) after so many metres."""
Footprint = tuple[Vector, float]
"""Where a foot stands flat, below the ankle, and its heading."""

_SWING = 0.76
"""Share of a step's time that its foot is in the air."""
_STRIDE = 0.36
"""Length of a step, as a share of the stature."""
_MAX_STEPS = 4000


def circle(centre: tuple[float, float], radius: float, start: float, sense: float) -> Path:
    """A circle; `start` is the angle it begins at, `sense` is 1 counter-clockwise and -1 clockwise."""

    def place(metres: float) -> tuple[Float[np.ndarray, "2"], float]:
        angle = start + sense * metres / radius
        point = np.array(centre) + radius * np.array([np.cos(angle), np.sin(angle)])
        return point, angle + sense * np.pi / 2

    return place


def egg(length: float, width: float, start: float) -> Path:
    """A closed curve, longer than wide and wider at one end, walked counter-clockwise from the angle `start`."""
    angles = start + np.linspace(0.0, 2.0 * np.pi, 721)
    wider = 1.0 + 0.15 * np.cos(angles)
    points = 0.5 * np.stack([length * np.cos(angles), width * np.sin(angles) * wider], 1)
    steps = np.diff(points, axis=0)
    run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(steps, axis=1))])
    headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
    middles = 0.5 * (run[1:] + run[:-1])
    middles = np.concatenate([[middles[-1] - run[-1]], middles, [middles[0] + run[-1]]])
    headings = np.concatenate([[headings[-1] - 2 * np.pi], headings, [headings[0] + 2 * np.pi]])

    def place(metres: float) -> tuple[Float[np.ndarray, "2"], float]:
        laps = np.floor(metres / run[-1])
        rest = metres - laps * run[-1]
        point = np.array([np.interp(rest, run, points[:, k]) for k in range(2)])
        return point, float(np.interp(rest, middles, headings) + 2.0 * np.pi * laps)

    return place


def eased(since: float, ramp: float) -> float:
    """Seconds in motion, some time after a start that takes `ramp` seconds."""
    since = max(since, 0.0)
    return since - ramp / 2 if since > ramp else since**2 / (2 * ramp)


def footprint(path: Path, metres: float, side: str, aside: float, outwards: float) -> Footprint:
    """A foot so many metres beside a path, its toes turned outwards by so many degrees."""
    ground, heading = path(metres)
    sign = 1.0 if side == "left" else -1.0
    normal = np.array([-np.sin(heading), np.cos(heading)])
    return np.array([*(ground + sign * aside * normal), 0.0]), heading + sign * np.deg2rad(outwards)


def rolled(anatomy: Anatomy, side: str, print_: Footprint, pitch: float) -> tuple[Vector, Matrix]:
    """Ankle and rotation of a foot that is pitched (degrees) about its heel (toes up) or its ball (heel up)."""
    ground, heading = print_
    flat, height = heading_matrix(heading), anatomy.ankle_height
    ball = anatomy.offsets[INDEX[f"{side}_toe"]]
    pivot = np.array([ball[0] if pitch > 0.0 else -0.62 * height, 0.0, -height])
    rotation = turned(("y", pitch))
    ankle = np.array([0.0, 0.0, height]) + pivot - rotation @ pivot
    return ground + flat @ ankle, flat @ rotation


def with_foot(anatomy: Anatomy, pose: Pose, side: str, foot: tuple[Vector, Matrix], toe: float, pole: Vector) -> Pose:
    """The pose with an ankle and a foot's rotation reached, and its toes bent upwards by so many degrees."""
    pose = reach(anatomy, pose, leg(side), foot[0], pole, foot[1])
    return pose.with_rotation(f"{side}_toe", turned(("y", -toe)))


@dataclass(frozen=True)
class Walk:
    """A person who stands still, then walks along a path.

    Step n (from 1) lifts one foot and sets it down; feet alternate. Before it both feet stand side by side.
    """

    anatomy: Anatomy
    path: Path
    delay: float = 0.2
    """Seconds before the first step."""
    swing: float = 1.0
    """How far the arms swing, 1 = as usual."""
    aside: float = 9.0
    """Degrees by which hanging arms are held away from the body."""
    first: str = "right"

    def __call__(self, time: float) -> Pose:
        """The pose at a time (seconds)."""
        beat = 1.75 * eased(time - self.delay, 0.5)  # steps made, as a real number
        effort = float(np.clip(beat, 0.0, 1.0)) ** 2
        ground, heading = self.path(float(_progress_of(_STRIDE * self.anatomy.stature)(min(beat, _MAX_STEPS))))
        side = 1.0 if self.first == "right" else -1.0
        sway, lead = side * effort * np.sin(np.pi * beat), -side * effort * np.cos(np.pi * beat)
        # Low while both feet stand wide apart (whole beats), high while one leg passes the other.
        bob = 0.014 * np.cos(2.0 * np.pi * (beat - 0.5)) * effort
        height = self.anatomy.hip_height - 0.012 - 0.024 * effort + bob
        facing = heading_matrix(heading)
        position = np.array([*ground, height]) + facing @ np.array([0.03 * effort, 0.018 * sway, 0.0])
        pelvis = facing @ turned(("z", 5.0 * lead), ("x", 2.0 * sway), ("y", 3.0))
        pose = pose_from_angles(self._angles(lead, effort), position, pelvis)
        for name in SIDES:
            pose = self._leg(pose, name, beat)
        return pose

    def _angles(self, lead: float, effort: float) -> dict[str, float]:
        """Trunk and arms; `lead` is 1 when the left leg is behind and the right one in front, -1 the other way."""
        angles = {"bend": 2.0 + 3.0 * effort, "turn": -9.0 * lead, "look": 4.0 * lead, "nod": 2.0}
        for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
            swing = self.swing * (24.0 * sign * lead * 0.9 + 4.0 * effort)
            angles |= {
                # A raise in the plane between forwards and sideways keeps the hand clear of the thigh.
                f"{side}_raise": float(np.hypot(swing, self.aside)),
                f"{side}_plane": float(np.rad2deg(np.arctan2(self.aside, swing))),
                f"{side}_elbow": 16.0 + self.swing * (14.0 * effort + 0.45 * max(swing, 0.0)),
                f"{side}_palm": -10.0,
            }
        return angles

    def _footprint(self, side: str, step: int) -> Footprint:
        """Where a foot stands after its step: at the start (0) as far apart as the hips, then nearly on one line."""
        metres = 0.0 if step <= 0 else (step - 0.5) * _STRIDE * self.anatomy.stature
        return footprint(self.path, metres, side, self.anatomy.stature * (0.055 if step <= 0 else 0.042), 6.0)

    def _leg(self, pose: Pose, side: str, beat: float) -> Pose:
        """Set one leg: find the step its foot is in, roll over heel and ball while it stands."""
        step = int(np.floor(beat)) + 1
        if step % 2 != (1 if side == self.first else 0):
            step -= 1
        # `step` is the foot's latest step; it flies during the middle of [step - 1, step].
        flight = (beat - (step - 1) - (1.0 - _SWING) / 2) / _SWING
        if step >= 1 and 0.0 < flight < 1.0:
            return self._flying(pose, side, flight, step)
        stood = step if step >= 1 and flight >= 1.0 else step - 2
        print_, pitch = self._footprint(side, stood), _pitch(beat, stood) if stood > 0 else 0.0
        return self._set_leg(pose, side, rolled(self.anatomy, side, print_, pitch), max(pitch, 0.0), print_[1])

    def _flying(self, pose: Pose, side: str, flight: float, step: int) -> Pose:
        before, after = self._footprint(side, step - 2), self._footprint(side, step)
        from_pitch = 34.0 if step > 2 else 0.0
        start, _ = rolled(self.anatomy, side, before, from_pitch)
        end, _ = rolled(self.anatomy, side, after, -16.0)
        share = flight * flight * (3.0 - 2.0 * flight)
        heading = before[1] + share * (after[1] - before[1])
        pitch = (1.0 - share) * from_pitch - 16.0 * share + 24.0 * np.sin(np.pi * flight) ** 2 * (1.0 - flight)
        ankle = start + share * (end - start)
        ankle[2] += 0.055 * np.sin(np.pi * flight) ** 2
        foot = ankle, heading_matrix(heading) @ turned(("y", pitch))
        return self._set_leg(pose, side, foot, from_pitch * (1.0 - share) ** 3, heading)

    def _set_leg(self, pose: Pose, side: str, foot: tuple[Vector, Matrix], toe: float, heading: float) -> Pose:
        return with_foot(self.anatomy, pose, side, foot, toe, heading_matrix(heading)[:, 0])


def _pitch(beat: float, step: int) -> float:
    """Pitch of a foot that stands after a step, in degrees: toes up after touch-down, heel up before it lifts."""
    touched = step - (1.0 - _SWING) / 2
    lifted = step + 1.0 + (1.0 - _SWING) / 2
    share = (beat - touched) / (lifted - touched)
    down = float(np.clip(1.0 - share / 0.16, 0.0, 1.0))
    up = float(np.clip((share - 0.52) / 0.48, 0.0, 1.0))
    return -16.0 * down**2 * (3 - 2 * down) + 34.0 * up * up


@cache
def _progress_of(step_length: float) -> PchipInterpolator:
    """Metres of the pelvis along the path over the beat: midway between the feet at whole beats."""
    count = np.arange(_MAX_STEPS + 2)
    marks = np.where(count == 0, 0.0, (count - 0.5) * step_length)
    middle = np.concatenate([[0.0], 0.5 * (marks[1:] + marks[:-1])])
    return PchipInterpolator(count, middle)
