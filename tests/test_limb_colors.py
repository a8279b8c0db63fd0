"""Whose colours a limb takes that was not found in every example pose."""

import numpy as np
import pytest
from body_cases import shipped

from sogjax.actor.colors import joined_samples
from sogjax.actor.limb_colors import agreed_samples, limb_pairs_alike
from sogjax.model.limbs import limb_names

HUMAN = shipped("human")
SKIN, RED = np.array([0.8, 0.6, 0.5]), np.array([0.8, 0.1, 0.1])
ELSEWHERE = [np.array(rgb) for rgb in ((0.1, 0.1, 0.1), (0.2, 0.8, 0.3), (0.3, 0.3, 0.9), (0.9, 0.9, 0.2))]
"""What limbs show where they are not."""
ARMS = next(pair for pair in limb_pairs_alike(HUMAN) if "arm" in limb_names(HUMAN)[pair.limbs[0]])


def samples_of(left, right):
    """Of one pose: the arms in two colours, all else as skin."""
    rng = np.random.default_rng(0)
    colors = np.tile(SKIN, (HUMAN.num_blobs, 1))
    for blobs, color in zip(ARMS.blobs, (left, right), strict=True):
        colors[blobs] = color
    return [color + rng.normal(0.0, 0.01, (20, 3)) for color in colors]


def agreed(by_pose):
    """The colours that are taken, those of all samples, and whether too few poses agree of the arms."""
    joined = joined_samples(by_pose)
    colors = np.stack([np.median(samples, axis=0) for samples in joined])
    found = agreed_samples(HUMAN, by_pose, colors)
    return np.stack([np.median(samples, axis=0) for samples in found.samples]), colors, bool(found.unlike)


@pytest.mark.parametrize(
    "poses",
    [
        [(SKIN, SKIN), (SKIN, ELSEWHERE[0]), (SKIN, ELSEWHERE[1])],
        [(SKIN, SKIN), (ELSEWHERE[0], SKIN), (ELSEWHERE[1], SKIN)],
        [(SKIN, SKIN), (SKIN, ELSEWHERE[0]), (ELSEWHERE[1], SKIN), (ELSEWHERE[2], ELSEWHERE[3])],
    ],
)
def test_an_arm_that_was_not_found_takes_the_colours_of_the_poses_that_agree(poses):
    found, _, unlike = agreed([samples_of(*pose) for pose in poses])
    assert not unlike
    np.testing.assert_allclose(found, np.tile(SKIN, (HUMAN.num_blobs, 1)), atol=0.02)


def test_sleeves_of_different_colours_stay():
    found, joined, unlike = agreed([samples_of(SKIN, RED)] * 3)
    assert unlike  # one may be elsewhere in all poses
    np.testing.assert_array_equal(found, joined)


def test_a_sleeve_that_was_found_keeps_its_colour_where_the_other_was_not():
    found, *_ = agreed([samples_of(RED, other) for other in (RED, ELSEWHERE[0], ELSEWHERE[1])])
    for blobs in ARMS.blobs:
        np.testing.assert_allclose(found[blobs], np.tile(RED, (len(blobs), 1)), atol=0.02)


def test_what_too_few_pictures_show_is_not_compared():
    hidden = samples_of(SKIN, ELSEWHERE[0])
    for blob in ARMS.blobs[1]:
        hidden[blob] = hidden[blob][:2]
    found, *_ = agreed([samples_of(SKIN, ELSEWHERE[1]), hidden, samples_of(SKIN, SKIN)])
    np.testing.assert_allclose(found, np.tile(SKIN, (HUMAN.num_blobs, 1)), atol=0.02)


def without(samples, blobs):
    """Of one pose, some blobs of which are hidden."""
    return [each[:2] if blob in blobs else each for blob, each in enumerate(samples)]


@pytest.mark.parametrize("hidden", [[ARMS.blobs[1]], ARMS.blobs])
def test_sleeves_of_different_colours_stay_where_a_pose_hides_one(hidden):
    poses = [samples_of(SKIN, RED)] * 3 + [without(samples_of(SKIN, RED), blobs) for blobs in hidden]
    found, joined, unlike = agreed(poses)
    assert unlike
    np.testing.assert_allclose(found, joined, atol=0.01)


def test_of_an_arm_that_most_poses_show_alike_the_others_do_not_count():
    """The left arm lies on the same wall in all poses: who is wrong is not known."""
    poses = [samples_of(ELSEWHERE[0], right) for right in (SKIN, SKIN, ELSEWHERE[1])]
    found, _, unlike = agreed(poses)
    assert unlike
    for blobs, color in zip(ARMS.blobs, (ELSEWHERE[0], SKIN), strict=True):
        np.testing.assert_allclose(found[blobs], np.tile(color, (len(blobs), 1)), atol=0.02)


def test_arms_that_no_pose_shows_keep_what_there_is():
    hidden = [without(samples_of(SKIN, RED), np.concatenate(ARMS.blobs))] * 2
    found, joined, unlike = agreed(hidden)
    assert unlike
    np.testing.assert_array_equal(found, joined)


def test_a_single_pose_has_nothing_to_agree_with():
    found, joined, unlike = agreed([samples_of(SKIN, RED)])
    assert unlike
    np.testing.assert_array_equal(found, joined)


def test_arms_that_are_elsewhere_in_most_poses_are_doubted():
    _, _, unlike = agreed([samples_of(SKIN, ELSEWHERE[0]), samples_of(ELSEWHERE[1], ELSEWHERE[2])])
    assert unlike


def test_arms_that_are_alike_are_left_alone():
    found, joined, unlike = agreed([samples_of(SKIN, SKIN), samples_of(SKIN, SKIN)])
    assert not unlike
    np.testing.assert_array_equal(found, joined)
