"""Checking keypoint files: a camera whose files are all wrong is named."""

import numpy as np
import pytest
from command_line import done
from project_cases import pose2sim
from rig_cases import opencv_pixels, recording_of, ring_rig

from sogjax.check.keypoints import agreement, suspects
from sogjax.io.keypoints.load import Keypoints
from sogjax.io.keypoints.scheme import named_scheme

FRAMES = 6


def seen(rig, wrong=(), mistake=None):
    """A moving person and, of some cameras, what `mistake` makes of their pixels."""
    scheme = named_scheme("HALPE_26")
    body = np.random.default_rng(0).uniform((-0.3, -0.3, 0.3), (0.3, 0.3, 1.9), (26, 3))
    true = body + np.linspace(0.0, 0.5, FRAMES)[:, None, None]
    points = np.zeros((len(rig), FRAMES, 2, 26, 3), np.float32)
    for camera, name in enumerate(rig.names):
        pixels = opencv_pixels(rig, name, true)
        points[camera, :, 0, :, :2] = mistake(pixels) if name in wrong else pixels
        points[camera, :, 0, :, 2] = 0.8
    return Keypoints(scheme, rig.names, points)


MISTAKES = {
    "half size": lambda pixels: 0.5 * pixels,
    "mirrored": lambda pixels: np.array([319.0, 0.0]) + pixels * np.array([-1.0, 1.0]),
    "another person": lambda pixels: pixels + np.array([80.0, 0.0]),
}


@pytest.mark.parametrize("cameras", [3, 4, 8])
@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_camera_whose_files_are_all_wrong_is_named(cameras, mistake):
    rig = ring_rig(cameras)
    keypoints = seen(rig, ("cam1",), MISTAKES[mistake])
    assert suspects(rig.names, agreement(keypoints, recording_of(rig, FRAMES), range(FRAMES))) == ["cam1"]


def test_right_files_are_not_suspected():
    rig = ring_rig(4)
    shares = agreement(seen(rig), recording_of(rig, FRAMES), range(FRAMES))
    np.testing.assert_allclose(shares, 1.0)
    assert suspects(rig.names, shares) == []


def test_nobody_is_suspected_where_nobody_can_tell():
    assert suspects(("a", "b"), np.array([1.0, 0.1])) == []
    assert suspects(("a", "b", "c"), np.array([np.nan, 1.0, 0.1])) == []
    assert suspects(("a", "b", "c"), np.array([0.2, 0.5, 0.1])) == []


def test_a_pose2sim_project_is_checked_as_it_is(capsys, tmp_path):
    folder, _ = pose2sim(tmp_path / "trial")
    out, _ = done(capsys, "check", f"recording={folder}", f"out={tmp_path / 'out'}")
    assert "keypoints" in out
    assert "HALPE_26 of cam01, cam02: somebody in 100 % of the pictures" in out
    (folder / "pose/cam01_json/cam01_000000.json").write_text("{")
    out, _ = done(capsys, "check", f"recording={folder}", f"out={tmp_path / 'out'}")
    assert "1 file of 4 left out" in out
