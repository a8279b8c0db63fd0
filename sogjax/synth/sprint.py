"""Running round a circle: one foot on the floor at a time, and neither between two steps."""

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import PchipInterpolator

from sogjax.synth.anatomy import SIDES, Anatomy, Pose
from sogjax.synth.gait import Footprint, Path, eased, footprint, rolled, with_foot
from sogjax.synth.limbs import heading_matrix, pose_from_angles
from sogjax.synth.rotations import Matrix, Vector, turned

_STANCE = 0.27
"""Half of the share of a step's time that its foot stands."""
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

    def __call__(self, time: float) -> Pose:
        """The pose at a time (seconds)."""
        beat = 3.25 * eased(time - 0.1, 0.45)  # steps made, as a real number
        effort = float(np.clip(0.5 * beat, 0.0, 1.0)) ** 2
        ground, heading = self.path(float(_way(self.anatomy.stature)[1](min(beat, _MAX_STEPS))))
        facing = heading_matrix(heading)
        lean = np.deg2rad(13.0) * effort  # to the left, into the bend
        # Lowest in the middle of a stance, highest in the middle of a flight.
        bob = 0.017 * effort * np.cos(2.0 * np.pi * (beat - 0.5))
        height = self.anatomy.hip_height - 0.012 + self.anatomy.stature * (bob - 0.044 * effort)
        offset = np.array([0.015 * effort, np.sin(lean) * height, np.cos(lean) * height])
        lead = effort * np.cos(np.pi * beat)
        pelvis = facing @ turned(("x", -np.rad2deg(lean)), ("z", 7.0 * lead), ("y", 9.0 * effort))
        pose = pose_from_angles(_angles(lead, effort), np.array([*ground, 0.0]) + facing @ offset, pelvis)
        for side in SIDES:
            pose = self._leg(pose, side, beat)
        return pose

    def _footprint(self, side: str, step: int) -> Footprint:
        """Where a foot stands flat in its step (0 and before: at the start), a little behind the hips."""
        stature = self.anatomy.stature
        metres = float(_way(stature)[0][max(step, 0)]) - (0.022 * stature if step > 0 else 0.0)
        return footprint(self.path, metres, side, stature * (0.055 if step <= 0 else 0.03), 5.0)

    def _leg(self, pose: Pose, side: str, beat: float) -> Pose:
        """Set one leg: its foot stands around the beats of its steps and flies between them."""
        first = 1 if side == "right" else 2
        step = first + 2 * int(np.floor((beat + _STANCE - first) / 2.0))
        begins, ends = (step - _STANCE, step + _STANCE) if step >= first else (0.0, _FIRST_LIFTS[side])
        share = (beat - begins) / (ends - begins)
        if share > 1.0:
            return self._flying(pose, side, step, (beat - ends) / (step + 2 - _STANCE - ends))
        print_, pitch = self._footprint(side, step), _pitch(share, step)
        return self._set_leg(pose, side, rolled(self.anatomy, side, print_, pitch), max(pitch, 0.0), print_[1])

    def _flying(self, pose: Pose, side: str, step: int, share: float) -> Pose:
        """The heel comes up behind, the knee comes through, the foot reaches forwards."""
        before, after = self._footprint(side, step), self._footprint(side, step + 2)
        start, _ = rolled(self.anatomy, side, before, _HEEL_OFF)
        end, _ = rolled(self.anatomy, side, after, _TOES_UP)
        gone = share * share * (3.0 - 2.0 * share)
        heading = before[1] + gone * (after[1] - before[1])
        height = self.anatomy.stature * (0.17 if step > 0 else 0.11)
        ankle = start + gone * (end - start)
        ankle[2] += height * np.sin(np.pi * share**0.75) ** 2
        pitch = (1.0 - gone) * _HEEL_OFF + gone * _TOES_UP + 34.0 * np.sin(np.pi * share) ** 2 * (1.0 - share)
        foot = ankle, heading_matrix(heading) @ turned(("y", pitch))
        return self._set_leg(pose, side, foot, _HEEL_OFF * (1.0 - share) ** 3, heading)

    def _set_leg(self, pose: Pose, side: str, foot: tuple[Vector, Matrix], toe: float, heading: float) -> Pose:
        return with_foot(self.anatomy, pose, side, foot, toe, heading_matrix(heading) @ np.array([1.0, 0.0, 0.25]))


def _angles(lead: float, effort: float) -> dict[str, float]:
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


def _pitch(share: float, step: int) -> float:
    """Pitch of a standing foot after a share of its stance, in degrees."""
    down = float(np.clip(1.0 - share / 0.3, 0.0, 1.0)) if step > 0 else 0.0
    up = float(np.clip((share - 0.45) / 0.55, 0.0, 1.0))
    return _TOES_UP * down + _HEEL_OFF * up * up * (1.5 - 0.5 * up)


@cache
def _way(stature: float) -> tuple[np.ndarray, PchipInterpolator]:
    """Metres along the path at the beats, and a smooth curve through them; the first three steps are shorter."""
    lengths = np.full(_MAX_STEPS + 1, 0.65 * stature)
    lengths[:3] = np.minimum(np.array([0.16, 0.40, 0.53]) * stature, 0.65 * stature)
    marks = np.concatenate([[0.0], np.cumsum(lengths)])
    return marks, PchipInterpolator(np.arange(len(marks)), marks)
