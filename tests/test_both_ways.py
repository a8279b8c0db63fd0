"""Tracking both ways: which pass each part of the body is taken from, and what comes of it."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from body_cases import shipped
from walking_dog import FRAMES

from sogjax.model.body import concatenate
from sogjax.tracking.body_parts import body_parts, merged_pose
from sogjax.tracking.both_ways import told_both_ways
from sogjax.tracking.limbs import limb_names, limbs
from sogjax.tracking.mirrored import means_of
from sogjax.tracking.taken_parts import APART, BIAS, CHANGE, best_choice, stretches, taken_parts

LOST = slice(4, 7)


def backwards(cells, asked=None):
    def frames(first, stop):
        if asked is not None:
            asked.append((first, stop))
        return cells[first:stop][::-1]

    return frames


def with_lost_limb(walking_dog, doubt=0.9):
    """The pass with a leg bent far in some frames; the leg's number."""
    tracker, _, passed = walking_dog
    limb = next(k for k, name in enumerate(limb_names(tracker.body)) if "leg" in name)
    poses, doubts = passed.poses.copy(), np.zeros_like(passed.doubts)
    poses[LOST, limbs(tracker.body.skeleton)[limb][0]] += 0.8
    doubts[LOST, limb] = doubt
    return replace(passed, poses=poses, doubts=doubts), limb


def test_a_lost_limb_comes_back_from_the_other_side(walking_dog):
    tracker, cells, right = walking_dog
    passed, limb = with_lost_limb(walking_dog)
    found = told_both_ways(tracker, passed, backwards(cells))
    rows = sorted(found.frames)
    assert {*range(LOST.start, LOST.stop)} <= {*rows} <= {*range(LOST.start - 1, LOST.stop + 1)}
    assert found.parts == {limb_names(tracker.body)[limb]: len(rows)}
    body = tracker.body
    off = lambda poses: np.linalg.norm(means_of(body, poses) - means_of(body, right.poses[rows]), axis=-1).max()
    assert off(passed.poses[rows]) > 0.05
    assert off(np.stack([found.frames[row].pose for row in rows])) < 0.01


def test_what_holds_then_is_said_with_it(walking_dog):
    tracker, cells, right = walking_dog
    passed, limb = with_lost_limb(walking_dog)
    found = told_both_ways(tracker, passed, backwards(cells)).frames[LOST.start]
    assert found.terms["similarity"] > 0.9 * right.energy
    assert found.judged.doubt[limb] < 0.3


def test_nothing_is_read_where_no_limb_is_in_doubt(walking_dog):
    tracker, cells, _ = walking_dog
    asked = []
    passed, _ = with_lost_limb(walking_dog, doubt=0.1)
    assert not told_both_ways(tracker, passed, backwards(cells, asked)).frames
    assert asked == []


def test_a_right_pass_stays_though_it_is_doubted(walking_dog):
    tracker, cells, right = walking_dog
    doubts = np.zeros_like(right.doubts)
    doubts[LOST] = 0.9
    asked = []
    assert not told_both_ways(tracker, replace(right, doubts=doubts), backwards(cells, asked)).frames
    assert asked == [(0, LOST.stop)]


def test_a_clip_that_ends_in_doubt_is_looked_at_from_its_last_frame(walking_dog):
    tracker, cells, right = walking_dog
    doubts = np.zeros_like(right.doubts)
    doubts[-2:] = 0.9
    asked = []
    told_both_ways(tracker, replace(right, doubts=doubts), backwards(cells, asked))
    assert asked == [(0, FRAMES)]


def test_stretches_join_over_short_gaps():
    marked = np.array([0, 1, 1, 0, 1, 0, 0, 0, 1], bool)
    assert stretches(marked) == [(1, 2), (4, 4), (8, 8)]
    assert stretches(marked, gap=3) == [(1, 4), (8, 8)]
    assert stretches(np.zeros(3, bool)) == []


@pytest.mark.parametrize("seed", range(5))
def test_the_choice_over_time_is_the_best_of_all(seed):
    random = np.random.default_rng(seed)
    worth, change = random.normal(size=9), random.uniform(0.0, 1.0, 9)

    def value(taken):
        inside = sum(0.5 * (change[t - 1] + change[t]) for t in range(1, 9) if taken[t] != taken[t - 1])
        return worth @ taken - inside - change[0] * taken[0] - change[-1] * taken[-1]

    found = best_choice(worth, change)
    assert value(found.astype(float)) == pytest.approx(
        max(value(np.array(way, float)) for way in product((0, 1), repeat=9))
    )


def test_limbs_are_left_where_the_trunk_is_elsewhere_and_slight_gains_are_none():
    parts = body_parts(shipped("dog"))
    limb = next(k for k, part in enumerate(parts) if part.whole is not None)
    apart, gains = np.full((6, len(parts)), 0.01), np.full((6, len(parts)), -0.1)
    apart[2:4, limb], gains[2:4, limb] = 2.0 * APART, 10.0 * CHANGE * APART
    assert taken_parts(parts, apart, gains, 1.0)[:, limb].tolist() == [False, False, True, True, False, False]
    assert not taken_parts(parts, apart, np.where(gains > 0.0, 0.5 * BIAS, 0.0), 1.0).any()
    apart[:, 0] = 2.0 * APART
    assert not taken_parts(parts, apart, gains, 1.0).any()


def test_a_limb_is_taken_to_its_place_though_the_trunk_is_turned():
    body = shipped("human")
    parts = body_parts(body)
    limb = next(k for k, part in enumerate(parts) if part.name == "left arm")
    pose = np.asarray(body.poses["tpose"])
    other = pose.copy()
    other[3:6] += 0.1
    taken = np.arange(len(parts)) == limb
    means, others = means_of(body, np.stack([pose, other]))
    found = means_of(body, merged_pose(body, parts, pose, other, taken)[None])[0]
    off = lambda target: np.linalg.norm(found - target, axis=-1)
    assert off(others)[parts[limb].blobs].mean() < 0.03 < 0.05 < off(means)[parts[limb].blobs].mean()
    assert off(means)[~parts[limb].blobs].mean() < 0.01


def test_actors_are_parts_of_their_own():
    body = concatenate([replace(shipped("dog"), name="rex"), replace(shipped("dog"), name="bello")])
    parts = body_parts(body)
    assert [part.name for part in parts if part.whole is None] == ["rex/whole body", "bello/whole body"]
    assert sum(len(part.dofs) for part in parts if part.whole is None) == body.skeleton.num_dofs
    assert all(
        part.name.split("/")[0] == parts[part.whole].name.split("/")[0] for part in parts if part.whole is not None
    )


def test_a_limb_that_is_not_taken_stays_though_it_is_beyond_its_limits():
    body = shipped("human")
    parts, names = body_parts(body), list(body.skeleton.dof_names)
    limb = next(k for k, part in enumerate(parts) if part.name == "left arm")
    pose = np.asarray(body.poses["tpose"]).copy()
    beyond = next(k for k in parts[1].dofs if np.isfinite(body.skeleton.dof_upper[k]))
    assert beyond not in parts[limb].dofs, names[beyond]
    pose[beyond] = float(body.skeleton.dof_upper[beyond]) + 0.2
    other = pose.copy()
    other[parts[limb].dofs[0]] += 0.3
    found = merged_pose(body, parts, pose, other, np.arange(len(parts)) == limb)
    assert found[beyond] == pytest.approx(pose[beyond], abs=0.02)
