"""The yardstick of triangulation: errors of known size, gaps and filter, the script's rows."""

import numpy as np
import pytest
from rig_cases import opencv_pixels, recording_of, ring_rig
from triangulation import together

from sogjax.io.ground_truth import GroundTruth
from sogjax.io.keypoints.load import Keypoints
from sogjax.io.keypoints.scheme import named_scheme
from sogjax.study.triangulation_trials import filled, filtered, triangulation_errors

FRAMES = 30
NAMES = ("left_knee", "right_knee", "left_wrist", "right_wrist", "neck", "pelvis", "chest")


def still(rig, shift=0.0, seen=True):
    """Keypoints of a person who stands still, those of the scheme `shift` metres beside the truth."""
    scheme = named_scheme("BODY_25")
    rng = np.random.default_rng(0)
    true = rng.uniform(-0.4, 0.4, (25, 3)) + np.array([0.0, 0.0, 1.2])
    points = np.zeros((len(rig), FRAMES, 1, 25, 3), np.float32)
    for camera, name in enumerate(rig.names):
        points[camera, :, 0, :, :2] = opencv_pixels(rig, name, true + np.array([0.0, 0.0, shift]))
        points[camera, :, 0, :, 2] = 1.0
    points[:, ~np.broadcast_to(seen, FRAMES)] = 0.0
    joints = np.stack([true[scheme.landmarks.index(n)] if n in scheme.landmarks else np.zeros(3) for n in NAMES])
    truth = GroundTruth(fps=50.0, joints=np.tile(joints, (FRAMES, 1, 1)), joint_names=NAMES)
    return Keypoints(scheme, rig.names, points), truth


def test_the_error_is_the_distance_of_the_joints_that_the_scheme_has():
    rig = ring_rig(4)
    keypoints, truth = still(rig, 0.025)
    errors = triangulation_errors(recording_of(rig, FRAMES), keypoints, truth, rig.names)
    assert errors.found == pytest.approx(0.025, abs=1e-3)
    assert errors.filtered == pytest.approx(0.025, abs=1e-3)
    assert (errors.missing, errors.lost, errors.joints) == (0.0, 0, 6)  # chest is none of BODY_25's


def test_short_gaps_are_filled_and_what_is_never_seen_is_lost():
    rig = ring_rig(3)
    keypoints, truth = still(rig, seen=(np.arange(FRAMES) < 10) | (np.arange(FRAMES) >= 20))
    errors = triangulation_errors(recording_of(rig, FRAMES), keypoints, truth, rig.names)
    assert errors.missing == pytest.approx(1 / 3)
    assert errors.lost == 0
    points = np.array(keypoints.points)
    points[..., keypoints.scheme.keypoints.index("LKnee"), :] = 0.0
    without_knee = Keypoints(keypoints.scheme, keypoints.cameras, points)
    assert triangulation_errors(recording_of(rig, FRAMES), without_knee, truth, rig.names).lost == 1


def test_gaps_end_at_the_nearest_known_place():
    points = np.full((60, 1, 3), np.nan)
    points[3], points[50] = 3.0, 50.0
    whole = filled(points)[:, 0, 0]
    np.testing.assert_array_equal(whole, np.where(np.arange(60) < 50, 3.0, 50.0))


def test_the_filter_keeps_what_is_slow_and_stops_what_is_fast():
    time = np.arange(200) / 100.0
    waves = np.stack([np.sin(2 * np.pi * hertz * time) for hertz in (0.5, 30.0)], axis=-1)
    points = np.repeat(waves[:, :, None], 3, axis=2)
    result = filtered(points, 100.0)
    np.testing.assert_allclose(result[20:-20, 0], points[20:-20, 0], atol=0.01)
    assert np.abs(result[20:-20, 1]).max() < 0.01


def test_rows_are_put_together():
    rig = ring_rig(3)
    rows = [triangulation_errors(recording_of(rig, FRAMES), *still(rig, shift), rig.names) for shift in (0.0, 0.02)]
    assert together(rows).found == pytest.approx(0.01, abs=1e-3)
