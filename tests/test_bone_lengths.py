"""Bone lengths against a truth made by hand from the body itself."""

from dataclasses import replace

import numpy as np
import pytest
from body_cases import shipped

from sogjax.io.ground_truth import GroundTruth
from sogjax.quality.metrics import BONES, bone_errors

SHORT = {"left_": "l_", "right_": "r_"}


def truth_of(body, scale):
    """The body's own landmarks in two frames, one elsewhere, all farther apart by a factor."""
    points = scale * np.asarray(body.posed_landmarks(body.poses["rest"]), float)
    names = list(body.landmarks.names)
    for long, short in SHORT.items():
        names = [name.replace(long, short) for name in names]
    return GroundTruth(25.0, None, (), np.stack([points, points + 3.0]), tuple(names))


@pytest.mark.parametrize("scale", [1.0, 1.25])
def test_a_truth_that_is_larger_by_a_factor_makes_every_bone_shorter_by_it(scale):
    body = shipped("human")
    errors = bone_errors(body, truth_of(body, scale))
    assert errors.keys() == BONES.keys()
    np.testing.assert_allclose([*errors.values()], 1.0 / scale - 1.0, atol=1e-6)


def test_one_side_alone_counts_by_half():
    body = shipped("human")
    truth = truth_of(body, 1.0)
    names, joints = list(truth.joint_names), truth.joints.copy()
    knee, ankle = names.index("l_knee"), names.index("l_ankle")
    joints[:, ankle] = joints[:, knee] + 2.0 * (joints[:, ankle] - joints[:, knee])
    errors = bone_errors(body, replace(truth, joints=joints))
    assert errors["shank"] == pytest.approx(1.0 / 1.5 - 1.0, abs=1e-6)
    assert errors["thigh"] == pytest.approx(0.0, abs=1e-6)
