"""Virtual markers (Section 6) and joint errors, against motions made by hand."""

import numpy as np
import pytest
from motion_cases import JOINTS, points_on, walking_motion

from sogjax.errors import InputError
from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion_data import per_frame_fields
from sogjax.quality.evaluation import evaluate_motion, evaluate_motions
from sogjax.quality.markers import attach_markers, common_frames, joint_errors, marker_errors
from sogjax.quality.swaps import identity_swaps

ON = (3, 6, 8)
OFFSETS = ((0.1, 0.0, 0.05), (0.03, 0.2, 0.0), (0.0, -0.25, 0.04))
NAMES = ("STRN", "LWRA", "RWRA")
SHIFT = np.array([0.03, -0.04, 0.12])


def truth_of(motion, prefix=""):
    markers = points_on(motion, ON, OFFSETS)
    return GroundTruth(motion.fps, markers, tuple(prefix + name for name in NAMES))


def together(*truths):
    names = tuple(name for truth in truths for name in truth.marker_names)
    return GroundTruth(truths[0].fps, np.concatenate([truth.markers for truth in truths], 1), names)


def test_markers_fixed_to_the_body_have_no_error():
    motion = walking_motion()
    found = marker_errors(motion, truth_of(motion))
    assert found.errors.shape == (12, 3)
    np.testing.assert_allclose(found.errors, 0.0, atol=1e-12)
    assert found.compared_with == tuple(JOINTS[joint][0] for joint in ON)


def test_a_marker_belongs_to_the_joint_of_the_closest_blob():
    motion = walking_motion()
    markers = motion.blob_means[:, [2, 5]] + [0.01, 0.0, 0.0]
    np.testing.assert_array_equal(attach_markers(motion, markers).joints, [5, 8])


THIGH, HAND = 2, 5


def hand_before_thigh():
    """A motion, and a marker on its thigh that is nearer to the hand's centre in frame 0."""
    motion = walking_motion()
    motion.blob_sigma[:] = 0.01
    motion.blob_sigma[THIGH] = 0.08
    motion.blob_sigma[HAND] = 0.03
    on_the_thigh = motion.blob_means[:, THIGH] + [0.1, 0.0, 0.0]
    motion.blob_means[0, HAND] = on_the_thigh[0] + [0.07, 0.0, 0.0]
    return motion, on_the_thigh[:, None]


def test_a_marker_on_a_thigh_does_not_go_with_the_hand_before_it_but_to_the_letter():
    motion, markers = hand_before_thigh()
    attached = {rule: attach_markers(motion, markers, rule).joints for rule in ("scaled", "closest")}
    np.testing.assert_array_equal(attached["scaled"], [motion.blob_joint[THIGH]])
    np.testing.assert_array_equal(attached["closest"], [motion.blob_joint[HAND]])  # Section 6 to the letter


@pytest.mark.parametrize("rule", ["scaled", "closest"])
def test_both_means_are_told_whichever_rule_is_chosen(rule):
    motion, markers = hand_before_thigh()
    truth = GroundTruth(motion.fps, markers, NAMES[:1])
    alone = {one: marker_errors(motion, truth, one).errors for one in ("scaled", "closest")}
    assert alone["scaled"].mean() != pytest.approx(alone["closest"].mean())
    group = evaluate_motions({"ann": motion}, truth, rule=rule)
    numbers = group.as_dict()
    assert numbers["marker_rule"] == numbers["subjects"]["ann"]["marker_rule"] == rule
    assert numbers["all"]["mean_mm"] == pytest.approx(1000.0 * alone[rule].mean())
    for one, errors in alone.items():
        expected = {"mean_mm": pytest.approx(1000.0 * errors.mean()), "std_mm": pytest.approx(1000.0 * errors.std())}
        assert numbers["markers_by_rule"][one] == numbers["subjects"]["ann"]["markers_by_rule"][one] == expected
    assert f"markers by the rule {rule}" in group.table()


def test_a_translation_of_the_truth_after_the_first_frame_is_the_error():
    motion = walking_motion()
    truth = truth_of(motion)
    truth.markers[1:] += SHIFT
    errors = marker_errors(motion, truth).errors
    np.testing.assert_allclose(errors[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(errors[1:], np.linalg.norm(SHIFT), rtol=1e-9)


def test_missing_markers_are_left_out_and_attached_where_they_first_appear():
    motion = walking_motion()
    truth = truth_of(motion)
    truth.markers[:4, 1] = np.nan
    truth.markers[7, 0] = np.nan
    truth.markers[:, 2] = np.nan
    found = marker_errors(motion, truth)
    missing = np.zeros((12, 3), bool)
    missing[:4, 1] = missing[7, 0] = missing[:, 2] = True
    np.testing.assert_array_equal(np.isnan(found.errors), missing)
    np.testing.assert_allclose(found.errors[~missing], 0.0, atol=1e-12)
    assert found.compared_with == ("root_rz", "left_elbow", "")
    assert evaluate_motion(motion, truth).summary.num_values == (~missing).sum()


def test_motion_and_truth_meet_at_the_recordings_frames():
    whole = walking_motion(20)
    late = walking_motion(12, start=(0.0, 0.0, 1.0), first_frame=5)
    truth = truth_of(whole)
    for name in ("world_from_joint", "blob_means"):
        setattr(late, name, getattr(whole, name)[5:17])
    result = evaluate_motion(late, truth)
    np.testing.assert_array_equal(result.frames, np.arange(5, 17))
    np.testing.assert_allclose(result.markers.errors, 0.0, atol=1e-12)


def test_a_motion_of_every_second_frame_is_held_against_these():
    motion = walking_motion(num_frames=12)
    half = motion.of_rows(slice(0, 12, 2))
    rows, frames = common_frames(half, truth_of(motion))
    assert (rows.tolist(), frames.tolist()) == ([*range(6)], [*range(0, 12, 2)])
    for name in per_frame_fields():
        assert (values := getattr(half, name)) is None or len(values) == 6, name


def test_joints_are_found_by_name_and_by_prefix_of_one_axis_joints():
    motion = walking_motion()
    names = ("l_elbow", "left_shoulder", "root", "r_elbow", "left_ear")
    joints = points_on(motion, (6, 4, 3, 8, 0), np.zeros((5, 3))) + SHIFT
    found = joint_errors(motion, GroundTruth(motion.fps, joints=joints, joint_names=names))
    # "root" is no one place: its translations are joints with places of their own
    assert found.names == ("l_elbow", "left_shoulder", "r_elbow")
    assert found.compared_with == ("left_elbow", "left_shoulder_flexion", "right_elbow")
    np.testing.assert_allclose(found.errors, np.linalg.norm(SHIFT), rtol=1e-9)


def test_a_truth_of_other_names_cannot_be_compared():
    motion = walking_motion()
    truth = GroundTruth(motion.fps, joints=points_on(motion, (3,), [SHIFT]), joint_names=("pelvis",))
    assert joint_errors(motion, truth) is None
    with pytest.raises(InputError, match="name the truth's after these"):
        evaluate_motion(motion, truth)


@pytest.mark.parametrize(
    ("change", "message"),
    [({"fps": 25.0}, "25 frames per second"), ({"first_frame": 90}, "none of the truth's 12")],
)
def test_what_cannot_be_matched_is_an_input_error(change, message):
    truth = truth_of(walking_motion())
    with pytest.raises(InputError, match=message):
        evaluate_motion(walking_motion(**change), truth)


def test_a_motion_with_nan_is_refused():
    motion = walking_motion()
    motion.world_from_joint[3, 2, 0, 3] = np.nan
    with pytest.raises(InputError, match="not finite"):
        evaluate_motion(motion, truth_of(walking_motion()))


def exchange(a, b, rows):
    """The two motions with each other's geometry in `rows`."""
    for name in ("world_from_joint", "blob_means"):
        mine, theirs = getattr(a, name), getattr(b, name)
        mine[rows], theirs[rows] = theirs[rows].copy(), mine[rows].copy()


@pytest.mark.parametrize(("first", "stop"), [(0, 20), (6, 15), (11, 20)])
def test_exchanged_motions_are_reported_with_their_frames(first, stop):
    motions = {"ann": walking_motion(20), "bob": walking_motion(20, start=(0.2, 0.7, 1.0))}
    truth = together(*(truth_of(motion, f"{name}/") for name, motion in motions.items()))
    assert identity_swaps(motions, truth) == ()
    exchange(motions["ann"], motions["bob"], slice(first, stop))
    swaps = evaluate_motions(motions, truth).swaps
    assert [(s.motion, s.follows, s.first_frame, s.last_frame) for s in swaps] == [
        ("ann", "bob", first, stop - 1),
        ("bob", "ann", first, stop - 1),
    ]


def test_subjects_are_held_against_their_own_truth():
    motions = {"ann": walking_motion(), "bob": walking_motion(start=(0.0, 2.0, 1.0))}
    truth = together(*(truth_of(motion, f"{name}/") for name, motion in motions.items()))
    truth.markers[1:, 3:] += SHIFT
    group = evaluate_motions(motions, truth)
    assert group.evaluations["ann"].summary.maximum < 1e-12
    assert group.evaluations["bob"].summary.mean == pytest.approx(np.linalg.norm(SHIFT) * 11 / 12)
    assert group.summary.mean == pytest.approx(np.linalg.norm(SHIFT) * 11 / 24)
    assert group.summary.num_frames == 12
