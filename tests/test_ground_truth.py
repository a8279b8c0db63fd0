"""Ground truth survives its file, is selected by subject, and is refused where it is wrong."""

import numpy as np
import pytest
from small_recording import shared_recording

from sogjax.errors import InputError
from sogjax.io.ground_truth import GroundTruth, load_ground_truth, save_ground_truth

POINTS = np.arange(24.0).reshape(2, 4, 3)
NAMES = ("Ann/nose", "Ann/toe", "Bob/nose", "Bob/toe")


def test_missing_markers_and_names_survive_the_file(tmp_path):
    markers = POINTS.copy()
    markers[1, 2] = np.nan
    truth = GroundTruth(50.0, markers, NAMES)
    save_ground_truth(tmp_path / "truth.npz", truth)
    again = load_ground_truth(tmp_path / "truth.npz")
    np.testing.assert_array_equal(again.markers, markers)
    assert (again.fps, again.marker_names, again.joints, again.joint_names) == (50.0, NAMES, None, ())
    assert again.num_frames == 2


def test_joints_of_a_few_labelled_frames_are_a_truth(tmp_path):
    joints = POINTS.copy()
    joints[0] = np.nan
    save_ground_truth(tmp_path / "truth.npz", GroundTruth(25.0, joints=joints, joint_names=NAMES))
    np.testing.assert_array_equal(load_ground_truth(tmp_path / "truth.npz").joints, joints)


def test_a_subject_has_its_own_points_without_the_prefix():
    truth = GroundTruth(50.0, POINTS, NAMES, POINTS[:, :2], NAMES[2:])
    assert truth.subjects == ("Ann", "Bob")
    bob = truth.subject("Bob")
    np.testing.assert_array_equal(bob.markers, POINTS[:, 2:])
    assert bob.marker_names == bob.joint_names == ("nose", "toe")
    assert truth.subject("Ann").joints is None
    with pytest.raises(InputError, match=r"'Carl'.*Ann, Bob"):
        truth.subject("Carl")


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"fps": None}, "'fps'"),
        ({"fps": np.nan}, "nan"),
        ({"fps": 0.0}, "0.0"),
        ({"markers": POINTS[..., :2]}, r"'markers'.*\(2, 4, 2\)"),
        ({"markers": POINTS.astype(object)}, "pickle"),
        ({"markers": POINTS.astype(str)}, "'markers'.*numbers"),
        ({"markers": POINTS + np.inf}, "'markers'"),
        ({"marker_names": None}, "'marker_names'"),
        ({"marker_names": ["a", "b"]}, r"'marker_names'.*\(2,\)"),
        ({"marker_names": ["a", "b", "c", "a"]}, "'a' twice"),
        ({"joints": POINTS[:1], "joint_names": NAMES}, "2 frames.*1"),
        ({"joints": POINTS * np.nan, "joint_names": NAMES}, "'joints' holds NaN only"),
        ({"markers": None, "marker_names": None}, "neither"),
    ],
)
def test_a_wrong_array_is_named(tmp_path, arrays, message):
    path = tmp_path / "truth.npz"
    changed = {"fps": 50.0, "markers": POINTS, "marker_names": NAMES} | arrays
    with np.errstate(invalid="ignore"):
        np.savez(path, **{key: value for key, value in changed.items() if value is not None})
    with pytest.raises(InputError, match=message) as error:
        load_ground_truth(path)
    assert str(path) in str(error.value)


def test_the_truth_of_the_recording_to_develop_with():
    folder = shared_recording("rendered_walk")
    if folder is None:
        pytest.skip("there is no recording rendered_walk beside the project")
    truth = load_ground_truth(folder / "ground_truth.npz")
    assert truth.markers is not None
    assert truth.joints is not None
    assert (truth.markers.shape, truth.joints.shape) == ((40, 39, 3), (40, 21, 3))
    assert truth.subjects == ()
