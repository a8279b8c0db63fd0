"""Limbs that are elsewhere in the next frame: that is said, and passes are taken in which they are not."""

from dataclasses import replace

import numpy as np
import pytest
from body_cases import shipped
from test_both_ways import LOST, reader, with_lost_limb

from sogjax.io.motion import motion_from_poses
from sogjax.model.limbs import limb_blobs, limb_names, limbs
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.jumps import FAR, FPS, IN_PACE, jumps, largest_step, limb_jumps, peaks, steps
from sogjax.quality.verdict import verdicts
from sogjax.search.jump_passes import chosen_rows, largest_jump, leaps_between
from sogjax.search.merge_passes import merge_passes
from sogjax.search.other_pass import Compared
from sogjax.search.placed_body import means_of

COSTS = fitted_numbers().merge_passes
BODY = shipped("human")
ARM = limb_names(BODY).index("left arm")


def standing_still(num_frames=24, fps=50.0, raised=()):
    """Who stands, with an arm that is raised in some frames; how far its end is then elsewhere is some 50 cm."""
    poses = np.tile(np.asarray(BODY.poses["tpose"]), (num_frames, 1))
    poses[np.ix_(raised, limbs(BODY.skeleton)[ARM])] = np.asarray(BODY.poses["rest"])[limbs(BODY.skeleton)[ARM]]
    return motion_from_poses(BODY, poses, fps)


def test_a_step_is_seen_where_it_is_and_half_of_it_beside():
    path = np.where(np.arange(10)[:, None] > 4, [0.3, 0.0, 0.0], 0.0)
    np.testing.assert_allclose(steps(path), [0, 0, 0, 0.15, 0.3, 0.15, 0, 0, 0, 0], atol=1e-12)
    assert np.flatnonzero(peaks(steps(path))).tolist() == [4]


@pytest.mark.parametrize("behind", [0, 8])
def test_a_step_at_an_end_of_the_clip_is_seen_as_large(behind):
    path = np.where(np.arange(10)[:, None] > behind, [0.3, 0.0, 0.0], 0.0)
    assert np.flatnonzero(peaks(steps(path)) > 0.25).tolist() == [behind]
    assert steps(path)[behind] == pytest.approx(0.3)


def test_what_moves_steadily_or_is_only_begun_does_not_jump():
    t = np.arange(12)[:, None]
    np.testing.assert_allclose(steps(0.1 * t * [1.0, 0.0, 0.0]), 0.0, atol=1e-12)
    speeding = steps(0.1 * t * [1.0, 0.0, 0.0] + 0.02 * t**2 * [0.0, 1.0, 0.0])
    np.testing.assert_allclose(speeding[1:-2], 0.0, atol=1e-12)
    assert speeding.max() <= 0.04 + 1e-9  # it is taken to move steadily beyond the ends
    assert steps(np.ones((3, 5, 3))).shape == (3, 5)


def test_who_throws_keeps_the_pace_and_who_jumps_does_not():
    """A hand that is thrown forward goes on, fast; one that was lost, and is found, stands before or after."""
    pace = np.array([0.03, 0.02, 0.03, 0.02, 0.16, 0.44, 0.40, 0.27, 0.11, 0.08, 0.06, 0.02])
    path = lambda moved: np.cumsum(np.append(0.0, moved))[:, None, None] * [1.0, 0.0, 0.0]
    furthest = lambda moved, allowed: limb_jumps(path(moved), np.ones((1, 1), bool), in_pace=allowed).max()
    assert furthest(pace, IN_PACE) < 0.7 * furthest(pace, 0.0)
    at_once, in_two = np.where(pace > 0.43, 0.44, 0.0), np.where(pace > 0.39, 0.44, 0.0)
    back = np.where(pace > 0.43, 0.25, np.where(pace > 0.39, -0.25, 0.0))
    for moved in (at_once, in_two, back):
        assert furthest(moved, IN_PACE) == pytest.approx(furthest(moved, 0.0))


def test_jumps_are_named_with_their_frames():
    assert jumps(BODY, standing_still()) == []
    wrong = standing_still(raised=range(10, 24))
    assert jumps(BODY, wrong) == ["look at frames 9-10, left arm jumps"]
    assert jumps(BODY, standing_still(raised=[0])) == ["look at frames 0-1, left arm jumps"]
    assert "left arm jumps" in verdicts({"anna": wrong}, {}, limbs={"anna": jumps(BODY, wrong)})["anna"].sentence


def test_a_jump_that_a_filter_hides_is_named():
    wrong, right = standing_still(raised=range(10, 24)), standing_still()
    assert jumps(BODY, replace(right, unfiltered_pose=wrong.pose)) == jumps(BODY, wrong)


def test_a_body_without_limbs_does_not_jump():
    means = standing_still(raised=[5]).blob_means
    assert limb_jumps(means, np.zeros((0, BODY.num_blobs), bool)).shape == (24, 0)
    assert not limb_jumps(means, np.zeros((2, BODY.num_blobs), bool)).any()


def test_where_frames_lie_apart_limbs_may_go_farther():
    assert largest_step(2.0 * FPS) == FAR
    assert largest_step(0.5 * FPS) == pytest.approx(8.0 * FAR)
    wrong = standing_still(raised=range(10, 24), fps=0.5 * FPS)
    assert jumps(BODY, wrong) == []
    assert jumps(BODY, replace(wrong, fps=FPS, frame=2 * wrong.frame)) == []  # every second frame


def passed_of(poses, walking_dog):
    _, _, right = walking_dog
    return replace(right, poses=poses, energies=np.ones(len(poses)))


@pytest.mark.slow
def test_the_largest_jump_is_found_and_none_twice(walking_dog):
    tracker, _, right = walking_dog
    passed, limb = with_lost_limb(walking_dog)
    jump = largest_jump(tracker.body, passed, 0.05, set())
    assert jump is not None
    assert jump.row in (LOST.start - 1, LOST.stop - 1)
    assert jump.limbs == (limb,)
    assert jump.spared[jump.row] > 0.0
    other = largest_jump(tracker.body, passed, 0.05, {jump.row})
    assert other is not None
    assert {jump.row, other.row} == {LOST.start - 1, LOST.stop - 1}
    assert largest_jump(tracker.body, passed, 0.05, set(), at_once=2) is None
    assert largest_jump(tracker.body, right, 0.05, set()) is None


def test_leaps_count_beyond_how_limbs_move_and_not_what_moves_less():
    steady = np.zeros((9, BODY.num_blobs, 3)) + 0.1 * np.arange(9)[:, None, None] * [1.0, 0.0, 0.0]
    leaping, members = steady.copy(), limb_blobs(BODY)[[ARM]]
    leaping[np.ix_(range(5, 9), np.flatnonzero(members[0]))] += [0.0, 0.0, 0.3]
    found = leaps_between(leaping, steady, members)
    assert found.shape == (6, 2, 2)
    np.testing.assert_allclose(found[:, 0, 0], [0, 0, 0, 0.3 - COSTS.apart, 0, 0], atol=1e-6)
    np.testing.assert_allclose(found[:, 1, 1], 0.0, atol=1e-6)
    assert found[4:, 1, 0].min() > 0.2  # back to the one that is elsewhere
    np.testing.assert_allclose(found[:2, 1, 0], 0.0, atol=1e-6)
    still = leaps_between(steady, np.zeros_like(steady), members)
    np.testing.assert_allclose(still[:, 0, 0], still[:, 1, 1], atol=1e-6)


@pytest.mark.slow
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
    leaps = [float(far[blobs].mean()) - COSTS.apart for blobs in limb_blobs(tracker.body) if blobs.any()]
    worth = COSTS.leap * sum(max(leap, 0.0) for leap in leaps)
    gained = [float(-lost * worth / len(rows))] * len(rows)
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
    assert {*found.parts} == {limb_names(tracker.body)[limb]}
    poses = passed.poses.copy()
    for row, revised in found.frames.items():
        poses[row] = revised.pose
    off = np.linalg.norm(means_of(tracker.body, poses) - means_of(tracker.body, right.poses), axis=-1).max()
    assert off < 0.02
    assert limb_jumps(means_of(tracker.body, poses), limb_blobs(tracker.body)[[limb]]).max() < 0.05
