"""Verdicts beside the truth: wrong actors are made as they are called, and limbs are lost where they are far off."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from motion_cases import walking_motion
from tiny_body import make_body

from sogjax.data.ground_truth import GroundTruth
from sogjax.data.motion import motion_from_poses
from sogjax.evaluation.verdict import verdicts
from sogjax.study.verdict_trials import CASES, VerdictTrial, judged_run, scaled
from sogjax.study.verdicts import limb_errors

NAMES = ("left_elbow", "right_elbow", "root_tx")
TRIAL = VerdictTrial("walk", 4, "pictures", "own actor")


def truth_of(motion, names):
    columns = [motion.joint_names.tolist().index(name) for name in names]
    return GroundTruth(motion.fps, joints=motion.world_from_joint[:, columns][..., :3, 3].copy(), joint_names=names)


def judged(off, frames):
    motion = walking_motion()
    truth = truth_of(motion, NAMES)
    truth.joints[frames, 0] += [off, 0.0, 0.0]
    return judged_run(TRIAL, "anna", motion, truth, verdicts({"anna": motion}, {})["anna"])


@pytest.mark.parametrize(
    ("off", "frames", "lost"),
    [
        (0.2, slice(3, 8), {"left arm": 5}),
        (0.2, slice(3, 5), {}),
        (0.08, slice(0, 12), {}),
    ],
)
def test_a_limb_is_lost_where_it_is_far_off_for_some_frames(off, frames, lost):
    run = judged(off, frames)
    assert run.lost == lost
    assert run.right is not bool(lost)
    assert run.looks_right


def test_a_larger_actor_is_larger_in_every_pose():
    body = make_body()
    pose = jnp.zeros(body.skeleton.num_dofs)
    before, after = body.posed_blobs(pose), scaled(body, 1.2).posed_blobs(pose)
    np.testing.assert_allclose(after.means, 1.2 * before.means, atol=1e-6)
    np.testing.assert_allclose(after.sigmas, 1.2 * before.sigmas, rtol=1e-6)


def test_wrong_actors_are_what_they_are_called():
    body, other = make_body(), replace(make_body(), name="other")
    (exchanged,) = CASES["red and blue exchanged"]([body], [])
    np.testing.assert_array_equal(exchanged.blob_colors[:, 0], body.blob_colors[:, 2])
    assert [one.name for one in CASES["another person"]([body], [other])] == [body.name]


def test_limbs_are_judged_where_the_truth_ends_before_the_motion():
    body = make_body()
    poses = np.zeros((4, body.skeleton.num_dofs))
    motion = motion_from_poses(body, poses, 25.0)
    truth = truth_of(motion, ("left_elbow", "left_hip"))
    shorter = replace(truth, joints=truth.joints[:3] + 0.01)
    errors = limb_errors([body], shorter, np.array([1, 2, 3]), poses[1:])
    assert np.isfinite(errors.limbs).all(axis=1).tolist() == [True, True, False]
