"""Rankings: true poses lie on the truth, and verdicts tell the objective's failures from the search's."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from climbs import Climbed, Pair
from ranking import limbs_table, oracle_table, verdicts_table, write_csv
from rankings import Ranking
from tiny_body import make_body

from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import motion_from_poses
from sogjax.model.body import Attachments
from sogjax.study.true_poses import LimbErrors, limb_of, true_poses

NAMES = ("left arm", "trunk")


def limbs(arm, trunk=0.01):
    values = np.array([[arm, trunk]], float)
    return LimbErrors(NAMES, values, values.mean(axis=1))


def ranking(tracked, reached, optimum, gain):
    one = np.array([1.0])
    pair = Pair(Climbed(one[None], {"seen": one - gain}), Climbed(one[None], {"seen": one}))
    return Ranking("set", np.array([7]), pair, limbs(tracked), limbs(reached), limbs(optimum), limbs(0.02), far=0.1)


@pytest.mark.parametrize(
    ("tracked", "reached", "optimum", "gain", "verdict"),
    [
        (0.05, 0.05, 0.02, -0.01, "kept"),
        (0.30, 0.04, 0.02, 0.01, "regained"),
        (0.30, 0.30, 0.02, 0.01, "search"),
        (0.30, 0.30, 0.02, -0.01, "objective"),
        (0.30, 0.30, 0.02, 0.00005, "objective"),
        (0.30, 0.30, 0.28, 0.01, "left"),
        (np.nan, np.nan, np.nan, np.nan, "unknown"),
    ],
)
def test_a_loss_is_the_objectives_unless_the_true_pose_is_worth_more_and_can_be_held(
    tmp_path, tracked, reached, optimum, gain, verdict
):
    found = ranking(tracked, reached, optimum, gain)
    assert found.verdicts == [verdict]
    assert found.of_limb(1).verdicts == ["unknown" if verdict == "unknown" else "kept"]
    write_csv(tmp_path / "ranking.csv", [found])
    assert f"set,7,{verdict}" in (tmp_path / "ranking.csv").read_text()
    assert ("left arm" in limbs_table([found])) is (verdict not in ("kept", "unknown"))
    assert "| set |" in verdicts_table([found])


def test_joints_belong_to_limbs_by_their_names():
    names = ("l_wrist", "right_ankle", "anna/r_elbow", "neck", "l_hip")
    limbs = ["left arm", "right leg", "anna/right arm", "trunk", "trunk"]
    assert [limb_of(name) for name in names] == limbs


@pytest.mark.slow
def test_true_poses_lie_on_labelled_joints_and_follow_markers_where_there_are_labels():
    body = make_body()
    names = ("left_elbow", "left_hip", "neck", "telescope", "spine_bend")
    joints = tuple(body.skeleton.names.index(name) for name in names)
    body = replace(body, landmarks=Attachments(names, joints, jnp.zeros((len(names), 3))))
    poses = 0.02 * np.random.default_rng(0).normal(size=(1, 16)).cumsum(axis=1) + np.arange(4)[:, None] * 0.02
    motion = motion_from_poses(body, poses, 25.0)
    points = motion.world_from_joint[:, joints][..., :3, 3].astype(float)
    points[2] = np.nan
    markers = motion.blob_means[:, [1]] + np.array([0.0, 0.0, 0.02])
    markers[2] = np.nan
    found = true_poses(body, GroundTruth(25.0, markers, ("hand",), points, names), "z")
    assert np.isfinite(found).all(axis=1).tolist() == [True, True, False, True]
    known = [0, 1, 3]
    fitted = motion_from_poses(body, found[known], 25.0)
    distances = np.linalg.norm(fitted.world_from_joint[:, joints][..., :3, 3] - points[known], axis=-1)
    assert distances.max() < 0.01
    assert np.linalg.norm(fitted.blob_means[:, 1] - motion.blob_means[known, 1], axis=-1).max() < 0.03


def test_the_oracle_takes_the_truth_where_it_is_worth_more():
    """Three frames, known gains: the truth is worth 10 % more with a lost arm, 2 % less, and as much."""
    gains, near = np.array([0.1, -0.02, 0.0]), np.full((3, 2), 0.01)
    arm_lost = np.array([[0.4, 0.01], [0.01, 0.01], [0.01, 0.01]])
    errors = lambda values: LimbErrors(NAMES, values, values.mean(axis=1))
    pair = Pair(Climbed(np.zeros((3, 1)), {"seen": 1.0 - gains}), Climbed(np.zeros((3, 1)), {"seen": np.ones(3)}))
    reached, optimum = errors(arm_lost), errors(0.5 * near)
    found = Ranking("default", np.arange(3), pair, errors(arm_lost), reached, optimum, errors(near), far=0.1)
    np.testing.assert_allclose(found.chosen, [0.005, 0.01, 0.01])
    cells = [cell.strip() for cell in oracle_table([found]).splitlines()[-1].strip("|").split("|")]
    assert cells == ["default", "3", "33 %", "+2.667 %", "1", "100 %", "+10.000 %", "75.0", "8.3"]
