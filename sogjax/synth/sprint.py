"""Running round a circle: one foot on the floor at a time, and neither between two steps."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import PchipInterpolator

from sogjax.synth.anatomy import INDEX, SIDES, Anatomy, Pose
from sogjax.synth.gait import Path
from sogjax.synth.limbs import heading_matrix, pose_from_angles, reach
from sogjax.synth.rotations import Matrix, Vector, turned

_STANCE = 0.27
"""Half of the share of a step's time that its foot stands."""
_BEHIND = 0.022
"""Share of the stature by which the foot is behind the hips in the middle of its stance."""
_FIRST_STEPS = (0.16, 0.40, 0.53)
"""Lengths of the first steps, as shares of the stature; the later ones are of full length."""
_FIRST_LIFTS = {"right": 0.30, "left": 0.95}
"""Beats at which the feet leave their places at the start."""
_HEEL_OFF, _TOES_UP = 46.0, -6.0
"""Degrees by which a foot is pitched where it leaves the floor and where it meets it."""
_MAX_STEPS = 2000


@dataclass(frozen=True)
class Run:
    """A person who stands still, then runs along a path; step n (from 1) has its foot under the body at beat n."""

    anatomy: Anatomy
    path: Path
    delay: float = 0.1
    """Seconds before the start."""
    cadence: float = 3.25
    """Steps per second."""
    stride: float = 0.65
    """Length of a step, as a share of the stature."""
    bank: float = 13.0
    """Degrees by which the body leans to the left, into the bend."""

    def __call__(self, time: float) -> Pose:
        """The pose at a time (seconds)."""
        beat = self._beat(time)
        effort = float(np.clip(0.5 * beat, 0.0, 1.0)) ** 2
        ground, heading = self.path(self._metres(beat))
        facing = heading_matrix(heading)
        lean = np.deg2rad(self.bank) * effort
        # Lowest in the middle of a stance, highest in the middle of a flight.
        bob = 0.017 * effort * np.cos(2.0 * np.pi * (beat - 0.5))
        height = self.anatomy.hip_height - 0.012 + self.anatomy.stature * (bob - 0.044 * effort)
        offset = np.array([0.015 * effort, np.sin(lean) * height, np.cos(lean) * height])
        lead = effort * np.cos(np.pi * beat)
        pelvis = facing @ turned(("x", -np.rad2deg(lean)), ("z", 7.0 * lead), ("y", 9.0 * effort))
        pose = pose_from_angles(self._angles(lead, effort), np.array([*ground, 0.0]) + facing @ offset, pelvis)
        for side in SIDES:
            pose = self._leg(pose, side, beat)
        return pose

    def _angles(self, lead: float, effort: float) -> dict[str, float]:
        """Trunk and arms; `lead` is 1 while the left leg is at its foremost, -1 while the right one is."""
        angles = {"bend": 4.0 + 4.0 * effort, "turn": -14.0 * lead, "look": 7.0 * lead, "nod": -8.0 * effort}
        for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
            swing, aside = -40.0 * sign * lead - 14.0 * effort, 11.0 + 9.0 * effort
            angles |= {
                f"{side}_raise": float(np.hypot(swing, aside)),
                f"{side}_plane": float(np.rad2deg(np.arctan2(aside, swing))),
                f"{side}_elbow": 12.0 + 84.0 * effort - 14.0 * sign * lead,
                f"{side}_roll": -14.0 * effort,
            }
        return angles

    def _beat(self, time: float) -> float:
        """Steps made, as a real number; it starts smoothly."""
        ramp, since = 0.45, max(time - self.delay, 0.0)
        return self.cadence * (since - ramp / 2 if since > ramp else since**2 / (2 * ramp))

    def _metres(self, beat: float) -> float:
        _, way = _way(self.stride * self.anatomy.stature, self.anatomy.stature)
        return float(way(min(beat, _MAX_STEPS)))

    def _footprint(self, side: str, step: int) -> tuple[Vector, float]:
        """Where a foot stands flat in its step (0 and before: at the start): below the ankle, and its heading."""
        stature = self.anatomy.stature
        marks, _ = _way(self.stride * stature, stature)
        ground, heading = self.path(float(marks[max(step, 0)]) - (_BEHIND * stature if step > 0 else 0.0))
        sign = 1.0 if side == "left" else -1.0
        aside = stature * (0.055 if step <= 0 else 0.03)
        normal = np.array([-np.sin(heading), np.cos(heading)])
        return np.array([*(ground + sign * aside * normal), 0.0]), heading + sign * np.deg2rad(5.0)

    def _leg(self, pose: Pose, side: str, beat: float) -> Pose:
        """Set one leg: its foot stands around the beats of its steps and flies between them."""
        first = 1 if side == "right" else 2
        step = first + 2 * int(np.floor((beat + _STANCE - first) / 2.0))
        begins, ends = (step - _STANCE, step + _STANCE) if step >= first else (0.0, _FIRST_LIFTS[side])
        share = (beat - begins) / (ends - begins)
        if share <= 1.0:
            return self._set_leg(pose, side, *self._rolled(side, step, self._pitch(share, step)))
        return self._flying(pose, side, step, (beat - ends) / (step + 2 - _STANCE - ends))

    def _pitch(self, share: float, step: int) -> float:
        """Pitch of a standing foot after a share of its stance."""
        down = float(np.clip(1.0 - share / 0.3, 0.0, 1.0)) if step > 0 else 0.0
        up = float(np.clip((share - 0.45) / 0.55, 0.0, 1.0))
        return _TOES_UP * down + _HEEL_OFF * up * up * (1.5 - 0.5 * up)

    def _rolled(self, side: str, step: int, pitch: float) -> tuple[Vector, Matrix, float, float]:
        """Ankle, rotation, pitch and heading of a foot turned about its ball (heel up) or its heel (toes up)."""
        ground, heading = self._footprint(side, step)
        flat, height = heading_matrix(heading), self.anatomy.ankle_height
        ball = self.anatomy.offsets[INDEX[f"{side}_toe"]]
        pivot = np.array([ball[0] if pitch > 0.0 else -0.62 * height, 0.0, -height])
        rotation = turned(("y", pitch))
        ankle = np.array([0.0, 0.0, height]) + pivot - rotation @ pivot
        return ground + flat @ ankle, flat @ rotation, max(pitch, 0.0), heading

    def _flying(self, pose: Pose, side: str, step: int, share: float) -> Pose:
        """The heel comes up behind, the knee comes through, the foot reaches forwards."""
        start, _, _, from_heading = self._rolled(side, step, _HEEL_OFF)
        end, _, _, to_heading = self._rolled(side, step + 2, _TOES_UP)
        eased = share * share * (3.0 - 2.0 * share)
        heading = from_heading + eased * (to_heading - from_heading)
        height = self.anatomy.stature * (0.17 if step > 0 else 0.11)
        ankle = start + eased * (end - start)
        ankle[2] += height * np.sin(np.pi * share**0.75) ** 2
        pitch = (1.0 - eased) * _HEEL_OFF + eased * _TOES_UP + 34.0 * np.sin(np.pi * share) ** 2 * (1.0 - share)
        rotation = heading_matrix(heading) @ turned(("y", pitch))
        return self._set_leg(pose, side, ankle, rotation, _HEEL_OFF * (1.0 - share) ** 3, heading)

    def _set_leg(self, pose: Pose, side: str, ankle: Vector, rotation: Matrix, toe: float, heading: float) -> Pose:
        limb = (f"{side}_hip", f"{side}_knee", f"{side}_ankle")
        pole = heading_matrix(heading) @ np.array([1.0, 0.0, 0.25])
        pose = reach(self.anatomy, pose, limb, ankle, pole, rotation)
        return pose.with_rotation(f"{side}_toe", turned(("y", -toe)))


@cache
def _way(step_length: float, stature: float) -> tuple[np.ndarray, PchipInterpolator]:
    """Metres along the path at the beats, and a smooth curve through them."""
    lengths = np.full(_MAX_STEPS + 1, step_length)
    lengths[: len(_FIRST_STEPS)] = np.minimum(np.array(_FIRST_STEPS) * stature, step_length)
    marks = np.concatenate([[0.0], np.cumsum(lengths)])
    return marks, PchipInterpolator(np.arange(len(marks)), marks)
