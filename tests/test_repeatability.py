"""Luck: initial poses that are moved by known amounts, and what is made of the errors of runs from them."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from repeatability import Outcome, Repeated, moved_pose, outcome_of, repeated_table, write_repeated

from sogjax.errors import InputError
from sogjax.quality.evaluation import Evaluation, GroupEvaluation
from sogjax.quality.markers import PointErrors

JOINTS = ("left_wrist", "left_elbow", "right_ankle")


def drawn(seed=3):
    return np.random.default_rng(seed)


def test_roots_are_moved_by_a_centimetre_and_angles_by_two_degrees():
    body = shipped("human")
    rest = np.clip(np.zeros(body.skeleton.num_dofs, np.float32) + 0.3, body.skeleton.dof_lower, body.skeleton.dof_upper)
    free = replace(body, skeleton=replace(body.skeleton, dof_lower=jnp.full(len(rest), -jnp.inf)))
    free = replace(free, skeleton=replace(free.skeleton, dof_upper=jnp.full(len(rest), jnp.inf)))
    pose = np.concatenate([rest, rest])
    moved = moved_pose([free, free], pose, drawn())
    assert moved.dtype == pose.dtype
    for half in np.split(moved - pose, 2):
        roots = [k for k, name in enumerate(body.skeleton.dof_names) if name in ("root_x", "root_y", "root_z")]
        assert len(roots) == 3
        assert np.linalg.norm(half[roots]) == pytest.approx(0.01, rel=1e-4)
        np.testing.assert_allclose(np.abs(np.rad2deg(np.delete(half, roots))), 2.0, rtol=1e-3)
    np.testing.assert_array_equal(moved, moved_pose([free, free], pose, drawn()))
    assert not np.array_equal(moved, moved_pose([free, free], pose, drawn(4)))


def test_no_angle_is_moved_beyond_its_limit():
    body = shipped("human")
    pose = np.where(np.isfinite(body.skeleton.dof_upper), body.skeleton.dof_upper, 0.0).astype(np.float32)
    moved = moved_pose([body], pose, drawn())
    assert np.all(moved <= np.asarray(body.skeleton.dof_upper))
    assert np.any(moved < pose - 0.03)


def evaluated(**errors):
    """The comparison of actors, from errors of their joints."""
    of = {name: PointErrors(JOINTS, JOINTS, np.asarray(values, float)) for name, values in errors.items()}
    frames = np.arange(8)
    return GroupEvaluation({name: Evaluation(name, frames, None, joints, ()) for name, joints in of.items()})


def frames_off(joint, count, distance=0.3):
    """Errors of 2 cm, but for a joint in the first frames."""
    errors = np.full((8, len(JOINTS)), 0.02)
    errors[:count, JOINTS.index(joint)] = distance
    return errors


@pytest.mark.parametrize(
    ("errors", "lost"),
    [
        ({"anna": frames_off("left_wrist", 5)}, ("left arm",)),
        ({"anna": frames_off("left_wrist", 4)}, ()),
        ({"anna": frames_off("left_wrist", 8, 0.19)}, ()),
        ({"anna": frames_off("left_wrist", 0), "ben": frames_off("right_ankle", 6)}, ("ben/right leg",)),
    ],
)
def test_a_limb_is_lost_where_a_joint_is_far_off_for_five_frames(errors, lost):
    found = outcome_of(evaluated(**errors))
    assert found.lost == lost
    assert found.mean == pytest.approx(np.mean([each.mean() for each in errors.values()]))


def test_another_distance_loses_more():
    errors = evaluated(anna=frames_off("left_elbow", 6, 0.18))
    assert outcome_of(errors, 0.15).lost == ("left arm",)
    assert outcome_of(errors).lost == ()


def test_a_run_without_truth_is_refused():
    with pytest.raises(InputError, match=r"give one with ground_truth\.npz"):
        outcome_of(None)


def test_spread_and_share_of_losses_are_those_of_the_runs(tmp_path):
    """21 errors, evenly from 0 to 20 mm: five of a hundred below 1 mm, five above 19 mm."""
    outcomes = tuple(Outcome(1e-3 * k, ("left arm",) if k > 14 else ()) for k in range(21))
    found = Repeated("walk", outcomes)
    assert found.spread == pytest.approx(0.018)
    assert found.share_lost == pytest.approx(6 / 21)
    line = repeated_table([found]).splitlines()[-1]
    assert [cell.strip() for cell in line.strip("|").split("|")] == [
        *("walk", "21", "10.0", "1.0", "19.0", "18.0"),
        *("6", "29 %", "left arm (6)"),
    ]
    write_repeated(tmp_path / "runs.csv", [found])
    rows = (tmp_path / "runs.csv").read_text().splitlines()
    assert len(rows) == 22
    assert rows[-1] == "walk,20,20.00,left arm"
