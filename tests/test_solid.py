"""Bodies are solid: distances of segments against a fine grid, and who is in whom."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from hypothesis import given, settings
from hypothesis import strategies as st

from sogjax.model.body import concatenate
from sogjax.model.solid import Solid, segment_distance

HUMAN = shipped("human")
distance_of = jax.jit(segment_distance)
excess_of = jax.jit(lambda solid, body, pose: solid.excess(body.posed_blobs(pose).means).max())


@given(seed=st.integers(0, 10_000), flat=st.booleans())
@settings(deadline=None, max_examples=40)
def test_the_distance_of_segments_is_the_least_of_their_points(seed, flat):
    one, two = np.random.default_rng(seed).normal(size=(2, 2, 3)).astype(np.float32)
    if flat:
        two[1] = two[0]  # a point
    shares = np.linspace(0.0, 1.0, 401)[:, None]
    points = [ends[0] + shares * (ends[1] - ends[0]) for ends in (one, two)]
    least = np.linalg.norm(points[0][:, None] - points[1][None], axis=-1).min()
    assert float(distance_of(one, two)) == pytest.approx(least, abs=2e-3)


def test_no_named_pose_of_a_body_is_within_itself():
    solid = Solid.of(HUMAN)
    assert max(float(excess_of(solid, HUMAN, pose)) for pose in HUMAN.poses.values()) == 0.0


def test_legs_through_each_other_are_told():
    solid, names = Solid.of(HUMAN), list(HUMAN.skeleton.dof_names)
    crossed = np.array(HUMAN.poses["rest"])
    for side, sign in (("left", -1.0), ("right", -1.0)):
        crossed[names.index(f"{side}_hip_side")] = sign * 0.5
    assert float(excess_of(solid, HUMAN, jnp.asarray(crossed))) > 0.04


def test_two_actors_in_one_place_are_told_and_side_by_side_they_are_not():
    both = concatenate([replace(HUMAN, name="anna"), replace(HUMAN, name="ben")])
    solid = Solid.of(both)
    assert float(excess_of(solid, both, apart(both, 2.0))) == 0.0
    assert float(excess_of(solid, both, apart(both, 0.1))) > 0.1


def apart(both, metres):
    pose = np.array(both.poses["rest"])
    pose[list(both.skeleton.dof_names).index("ben/root_y")] += metres
    return jnp.asarray(pose)


@pytest.mark.slow
def test_of_a_solid_about_some_blobs_only_their_pairs_are_left():
    both = concatenate([replace(HUMAN, name="anna"), replace(HUMAN, name="ben")])
    whole, hand = Solid.of(both), np.array([HUMAN.num_blobs - 1])
    about = whole.about(hand)
    real = np.isfinite(np.asarray(about.allowed))
    of_hand = np.isin(np.asarray(whole.ends)[np.asarray(whole.pairs)].reshape(-1, 4), hand).any(axis=1)
    assert 0 < real.sum() == of_hand.sum() < len(of_hand)
    means = both.posed_blobs(apart(both, 0.1)).means
    np.testing.assert_array_equal(about.excess(means)[real], whole.excess(means)[of_hand])
    assert not np.asarray(about.excess(means))[~real].any()
    assert whole.about(np.zeros(0, int)).impossibility(means) == 0.0
