"""Numbers of an evaluation, against numpy on the values that are there and against hand cases."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_cases import points_on, walking_motion

from sogjax.errors import InputError
from sogjax.io.ground_truth import GroundTruth
from sogjax.quality.evaluation import evaluate_motion, evaluate_motions
from sogjax.quality.metrics import lost_points, mean_per_frame, mean_per_point, std_per_point, summarize


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**31))
def test_the_summary_is_that_of_the_values_that_are_there(seed):
    random = np.random.default_rng(seed)
    errors = random.exponential(0.06, (9, 5))
    errors[random.random((9, 5)) < 0.3] = np.nan
    values = [value for value in errors.ravel() if value == value]
    summary = summarize(errors)
    assert summary.mean == pytest.approx(sum(values) / len(values))
    squares = sum((value - summary.mean) ** 2 for value in values) / len(values)
    assert summary.std == pytest.approx(squares**0.5)
    assert summary.under_50mm == sum(value < 0.05 for value in values) / len(values)
    assert summary.under_100mm == sum(value < 0.1 for value in values) / len(values)
    assert (summary.num_values, summary.num_frames) == (len(values), 9)


def test_means_by_frame_and_by_point_leave_out_what_is_missing():
    errors = np.array([[1.0, np.nan, 3.0], [5.0, np.nan, np.nan], [np.nan] * 3])
    np.testing.assert_array_equal(mean_per_frame(errors), [2.0, 5.0, np.nan])
    np.testing.assert_array_equal(mean_per_point(errors), [3.0, np.nan, 3.0])
    np.testing.assert_array_equal(std_per_point(errors), [2.0, np.nan, 0.0])


def test_nothing_to_compare_is_nan_and_not_a_good_result():
    summary = summarize(np.full((4, 2), np.nan))
    assert np.isnan(summary.mean)
    assert summary.num_values == 0


def test_a_point_is_lost_from_five_far_frames_on():
    errors = np.zeros((20, 3))
    errors[3:7, 0] = 0.5
    errors[3:8, 1] = 0.5
    errors[10:17, 2] = 0.3
    errors[12, 2] = np.nan
    lost = lost_points(errors, ("four", "five", "six"), np.arange(100, 120))
    assert [(p.name, p.first_frame, p.last_frame) for p in lost] == [("five", 103, 107), ("six", 110, 116)]
    assert lost[1].mean == pytest.approx(0.3)


def test_only_labelled_frames_are_compared_and_their_number_is_said():
    motion = walking_motion(num_frames=6)
    joints = np.full((6, 1, 3), np.nan)
    joints[[1, 4], 0] = motion.world_from_joint[[1, 4], 6, :3, 3] + [0.0, 0.03, 0.04]
    truth = GroundTruth(motion.fps, joints=joints, joint_names=("left_elbow",))
    found = evaluate_motions({"ann": motion}, truth).evaluations["ann"]
    assert found.summary.mean == pytest.approx(0.05)
    assert (found.num_labelled, found.as_dict()["num_labelled_frames"]) == (2, 2)
    assert "6 frames, 0 to 5, of which 2 are labelled" in found.table()
    truth.joints = np.full((6, 1, 3), np.nan)
    with pytest.raises(InputError, match="knows no point in the motion's frames 0 to 5"):
        evaluate_motions({"ann": motion}, truth)


def test_json_and_table_tell_millimetres(tmp_path):
    motion = walking_motion()
    markers = points_on(motion, (3, 6), np.zeros((2, 3)))
    markers[1:, 0] += [0.0, 0.0, 0.3]
    markers[:, 1] = np.nan
    result = evaluate_motion(motion, GroundTruth(motion.fps, markers, ("STRN", "LWRA")), "ann")
    result.to_json(tmp_path / "metrics.json")
    content = json.loads((tmp_path / "metrics.json").read_text())
    assert content["markers"]["mean_mm"] == pytest.approx(300.0 * 11 / 12)
    assert content["markers"]["per_point"]["STRN"]["joint"] == "root_rz"
    assert content["markers"]["per_point"]["LWRA"]["mean_mm"] is None
    assert content["markers"]["mean_per_frame_mm"] == pytest.approx([0.0] + [300.0] * 11, abs=1e-9)
    assert content["joints"] is None
    assert content["lost"] == [{"name": "STRN", "first_frame": 1, "last_frame": 11, "mean_mm": pytest.approx(300.0)}]
    assert "275.0" in result.table()
    assert "lost: STRN in frames 1 to 11, 300 mm" in result.table()
