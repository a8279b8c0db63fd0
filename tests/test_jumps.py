"""Limbs that are elsewhere in the next frame: that is said, and passes are taken in which they are not."""

from dataclasses import replace

import numpy as np
import pytest
from body_cases import shipped
from motion_cases import walking_motion
from test_both_ways import reader, with_lost_limb

from sogjax.model.limbs import limb_blobs, limb_names
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.jumps import FAR, FPS, jumps, largest_step, limb_jumps, peaks, steps
from sogjax.quality.verdict import verdicts
from sogjax.search.jump_passes import chosen_rows, largest_jump, leaps_between
from sogjax.search.merge_passes import merge_passes
from sogjax.search.other_pass import Compared
from sogjax.search.placed_body import means_of

COSTS = fitted_numbers().merge_passes
BODY = shipped("human")
ARM = limb_names(BODY).index("left arm")


def with_arm(motion):
    """The motion, whose last blob is the left arm's."""
    of_joint = np.where(np.arange(len(motion.joint_names)) == motion.blob_joint[-1], 0, -1)
    return replace(motion, limb_names=np.array(["left arm"]), joint_limb=of_joint)


def moved(means, rows, blobs, far=0.3):
    found = means.copy()
    found[np.ix_(rows, blobs)] += [0.0, 0.0, far]
    return found


def test_a_step_is_seen_where_it_is_and_half_of_it_beside():
    path = np.where(np.arange(10)[:, None] > 4, [0.3, 0.0, 0.0], 0.0)
    np.testing.assert_allclose(steps(path), [0, 0, 0, 0.15, 0.3, 0.15, 0, 0, 0, 0], atol=1e-12)
    assert np.flatnonzero(peaks(steps(path)) & (steps(path) > 0.0)).tolist() == [4]


def test_what_moves_steadily_or_is_only_begun_does_not_jump():
    t = np.arange(12)[:, None]
    np.testing.assert_allclose(steps(0.1 * t * [1.0, 0.0, 0.0] + 0.02 * t**2 * [0.0, 1.0, 0.0]), 0.0, atol=1e-12)
    assert steps(np.ones((3, 5, 3))).shape == (3, 5)


def test_jumps_are_named_with_their_frames_and_walking_is_none():
    motion = with_arm(walking_motion(num_frames=24))
    assert jumps(motion) == []
    wrong = replace(motion, blob_means=moved(motion.blob_means, range(10, 24), [-1]))
    first, last = int(motion.frame[9]), int(motion.frame[10])
    assert jumps(wrong) == [f"look at frames {first}-{last}, left arm jumps by 30 cm"]
    assert "left arm jumps" in verdicts({"anna": wrong}, {})["anna"].sentence
    assert jumps(replace(wrong, limb_names=None)) == []


def test_where_frames_lie_apart_limbs_may_go_farther():
    assert largest_step(2.0 * FPS) == FAR
    assert largest_step(0.5 * FPS) == pytest.approx(8.0 * FAR)
    motion = with_arm(walking_motion(num_frames=24))
    wrong = replace(motion, blob_means=moved(motion.blob_means, range(10, 24), [-1]), fps=0.5 * FPS)
    assert jumps(wrong) == []


def passed_of(poses, walking_dog):
    _, _, right = walking_dog
    return replace(right, poses=poses, energies=np.ones(len(poses)))


def test_the_largest_jump_is_found_and_none_twice(walking_dog):
    tracker, _, right = walking_dog
    passed, limb = with_lost_limb(walking_dog)
    jump = largest_jump(tracker.body, passed, 0.05, set())
    assert jump is not None
    assert jump.row in (3, 6)
    assert any(np.array_equal(limb_blobs(tracker.body)[limb], blobs) for blobs in jump.limbs)
    assert jump.spared[jump.row] > 0.0
    other = largest_jump(tracker.body, passed, 0.05, {jump.row})
    assert other is None or other.row != jump.row
    assert largest_jump(tracker.body, right, 0.05, set()) is None


def test_leaps_count_beyond_how_far_the_smoother_pass_goes():
    known = np.zeros((6, BODY.num_blobs, 3)) + 0.1 * np.arange(6)[:, None, None] * [1.0, 0.0, 0.0]
    leaping = moved(known, range(3, 6), np.flatnonzero(limb_blobs(BODY)[ARM]))
    limbs = limb_blobs(BODY)[[ARM]]
    found = leaps_between(leaping, known, limbs)
    far = np.hypot(0.1, 0.3) - 0.1
    np.testing.assert_allclose(found[:, 0, 0], [0, 0, far, 0, 0], atol=1e-6)
    np.testing.assert_allclose(found[:, 1, 1], 0.0, atol=1e-6)
    np.testing.assert_allclose(found[2:, 1, 0], far, atol=1e-6)  # back to the one that is elsewhere
    np.testing.assert_allclose(found[:2, 1, 0], 0.0, atol=1e-6)


@pytest.mark.parametrize(("lost", "is_taken"), [(0.1, True), (1.5, False)])
def test_a_pass_without_the_jump_is_taken_unless_it_loses_more_than_that_is_worth(walking_dog, lost, is_taken):
    """To the end of the clip, behind which there is nothing to which it would have to go back."""
    tracker, _, right = walking_dog
    poses = right.poses.copy()
    passed, _ = with_lost_limb(walking_dog)
    poses[5:] = passed.poses[5]
    good = np.repeat(right.poses[4][None], len(poses), axis=0)
    poses[:5] = good[:5]
    rows = [*range(5, len(poses))]
    means = means_of(tracker.body, np.stack([poses[4], poses[5]]))
    far = np.linalg.norm(np.diff(means, axis=0)[0], axis=-1)
    worth = COSTS.leap * sum(float(far[blobs].mean()) for blobs in limb_blobs(tracker.body) if blobs.any())
    gained = [float(-lost * worth / len(rows) + COSTS.bias)] * len(rows)
    parts = np.zeros((len(rows), 1))
    found = Compared(rows, [], [*good[5:]], [*parts], [*parts], gained)
    chosen = chosen_rows(tracker.body, passed_of(poses, walking_dog), found)
    assert chosen.taken.all() == is_taken
    assert chosen.taken.any() == is_taken
    assert chosen.value == pytest.approx(max(1.0 - lost, 0.0) * worth, abs=1e-4)
    assert {*chosen.poses} == ({*rows} if is_taken else set())


@pytest.mark.slow
def test_a_limb_that_jumps_away_and_back_stays_though_nothing_doubts_it(walking_dog):
    tracker, cells, right = walking_dog
    passed, limb = with_lost_limb(walking_dog, doubt=0.0)
    assert not merge_passes(tracker, passed, reader(cells)).frames
    found = merge_passes(tracker, passed, reader(cells), jump=0.05)
    assert limb_names(tracker.body)[limb] in found.parts
    poses = passed.poses.copy()
    for row, revised in found.frames.items():
        poses[row] = revised.pose
    off = np.linalg.norm(means_of(tracker.body, poses) - means_of(tracker.body, right.poses), axis=-1).max()
    assert off < 0.02
    assert limb_jumps(means_of(tracker.body, poses), limb_blobs(tracker.body)[[limb]]).max() < 0.05
