"""Limbs that are held inside each other for longer than they may pass."""

from dataclasses import replace

import numpy as np
import pytest
from body_cases import shipped
from motion_cases import walking_motion

from sogjax.quality.passages import passages
from sogjax.quality.verdict import verdicts

HUMAN = shipped("human")


def clip_of(poses, fps=30.0):
    """A motion of these poses."""
    motion = walking_motion(len(poses))
    names = np.array(HUMAN.skeleton.dof_names)
    return replace(motion, pose=np.asarray(poses, np.float64), dof_names=names, fps=fps)


def legs_inside_each_other(share):
    pose = np.asarray(HUMAN.poses["rest"], np.float64).copy()
    for name, value in (("left_hip_side", -0.25), ("right_hip_side", -0.25)):
        pose[HUMAN.skeleton.dof_names.index(name)] += share * value
    return pose


@pytest.mark.parametrize("name", ["rest", "tpose", "squat", "walk_left", "hands_on_hips"])
def test_named_poses_hold_nothing_inside_something_else(name):
    assert passages(HUMAN, clip_of([np.asarray(HUMAN.poses[name])] * 12)) == []


def test_legs_that_stay_inside_each_other_are_named_and_an_instant_is_not():
    apart, inside = legs_inside_each_other(0.0), legs_inside_each_other(1.0)
    said = passages(HUMAN, clip_of([apart] * 5 + [inside] * 12 + [apart] * 5))
    assert said == ["look at frames 5-16, left leg through right leg"]
    assert passages(HUMAN, clip_of([apart] * 5 + [inside] * 4 + [apart] * 5)) == []
    motion = clip_of([inside] * 12)
    found = verdicts({"human": motion}, {}, limbs={"human": passages(HUMAN, motion)})["human"]
    assert found.sentence == "look at frames 0-11, left leg through right leg"
    assert not found.wrong
