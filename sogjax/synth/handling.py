"""Exercises whose hands go to places: a table's top, another person's back."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sogjax.synth.anatomy import INDEX, SIDES, Pose
from sogjax.synth.exercises import Angles, Exercise
from sogjax.synth.limbs import heading_matrix, reach
from sogjax.synth.rotations import between, unit

Frame = Float[np.ndarray, "4 4"]
Direction = tuple[float, float, float]


@dataclass(frozen=True)
class Handling:
    """An exercise in which the wrists are held at places, as far as the keys `left_hand` and `right_hand` are 1.

    The keys `left_hand_x/y/z` say where: metres in `frame`.
    """

    exercise: Exercise
    frame: Callable[[float], Frame]
    """World from the frame of the hands' places, at a time (seconds)."""
    elbows: tuple[Direction, Direction] = ((-0.3, 0.7, -0.8), (-0.3, 0.7, -0.8))
    """Where the left and the right elbow point while the hand is held: forwards, outwards, upwards of the chest."""
    flat: bool = False
    """Whether held hands lie flat, palms down."""

    def __call__(self, time: float) -> Pose:
        """The pose at a time (seconds)."""
        pose, values, frame = self.exercise(time), self.exercise.angles(time), self.frame(time)
        for side in SIDES:
            pose = self._hand(pose, side, values, frame)
        return pose

    def _hand(self, pose: Pose, side: str, values: Angles, frame: Frame) -> Pose:
        hold = values.get(f"{side}_hand", 0.0)
        if hold <= 0.0:
            return pose
        anatomy = self.exercise.anatomy
        limb = (f"{side}_shoulder", f"{side}_elbow", f"{side}_wrist")
        frames = anatomy.world_from_joint(pose)
        shoulder, elbow, wrist = (frames[INDEX[joint], :3, 3] for joint in limb)
        held = frame[:3, :3] @ [values[f"{side}_hand_{axis}"] for axis in "xyz"] + frame[:3, 3]
        ahead, outwards, upwards = self.elbows[SIDES.index(side)]
        wanted = np.array([ahead, outwards if side == "left" else -outwards, upwards])
        # The free elbow lies aside of the line from shoulder to wrist: from there it moves over to where it is wanted.
        free = unit(elbow - 0.5 * (shoulder + wrist))
        pole = (1.0 - hold) * free + hold * unit(frames[INDEX["chest"], :3, :3] @ wanted)
        pose = reach(anatomy, pose, limb, wrist + hold * (held - wrist), pole)
        return self._laid(pose, side, hold) if self.flat else pose

    def _laid(self, pose: Pose, side: str, hold: float) -> Pose:
        """Turn a hand palm down, its fingers where the forearm points to."""
        forearm = self.exercise.anatomy.world_from_joint(pose)[INDEX[f"{side}_elbow"], :3, :3]
        back = unit(forearm[:, 2] * [1.0, 1.0, 0.0])
        over = np.array([0.0, 0.0, 1.0 if side == "left" else -1.0])
        hand = np.stack([np.cross(over, back), over, back], axis=1)
        wrist = f"{side}_wrist"
        return pose.with_rotation(wrist, between(pose.rotations[INDEX[wrist]], forearm.T @ hand, hold))


def at_the_place(exercise: Exercise) -> Callable[[float], Frame]:
    """The frame of an exercise's own place on the floor: x forwards, y to the left."""
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = heading_matrix(exercise.heading), exercise.place
    return lambda time: frame


def at_the_chest(exercise: Exercise) -> Callable[[float], Frame]:
    """The frame of somebody's chest, in units of 1/1.75 of that person's stature."""

    def frame(time: float) -> Frame:
        anatomy = exercise.anatomy
        chest = anatomy.world_from_joint(exercise(time))[INDEX["chest"]].copy()
        chest[:3, :3] *= anatomy.stature / 1.75
        return chest

    return frame
