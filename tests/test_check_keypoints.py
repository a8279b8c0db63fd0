"""Checking keypoint files: a camera whose files are all wrong is named."""

from dataclasses import replace

import numpy as np
import pytest
from command_line import done
from project_cases import pose2sim
from rig_cases import opencv_pixels, recording_of, ring_rig

from sogjax.check.keypoints import agreement, suspects, unseen_people_findings
from sogjax.check.pictures import read_clip, read_plates
from sogjax.io.keypoints.load import Keypoints, load_keypoints
from sogjax.io.keypoints.scheme import named_scheme
from sogjax.io.recording import open_recording
from sogjax.search.keypoint_people import triangulated_people
from sogjax.synth.detector import DetectorSettings
from sogjax.synth.render import render_recording
from sogjax.synth.settings import SynthSettings

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


@pytest.mark.slow
def test_a_pose2sim_project_is_checked_as_it_is(capsys, tmp_path):
    folder, _ = pose2sim(tmp_path / "trial")
    out, _ = done(capsys, "check", f"recording={folder}", f"out={tmp_path / 'out'}")
    assert "keypoints" in out
    assert "HALPE_26 of cam01, cam02: somebody in 100 % of the pictures" in out
    (folder / "pose/cam01_json/cam01_000000.json").write_text("{")
    out, _ = done(capsys, "check", f"recording={folder}", f"out={tmp_path / 'out'}")
    assert "1 file of 4 left out" in out


@pytest.fixture(scope="module")
def two_people(tmp_path_factory):
    """Four cameras that see two people pass each other, with the keypoints of both."""
    settings = SynthSettings(
        motion="pass", actors=2, cameras=4, frames=10, width=160, height=120, example_poses=False, shadows=False
    )
    path = tmp_path_factory.mktemp("rendered") / "two"
    render_recording(settings, path, workers=1, detector=DetectorSettings(keypoints="pose2sim"))
    return path


@pytest.mark.slow
@pytest.mark.parametrize("plates", [True, False])
def test_a_person_of_the_keypoints_who_is_never_in_the_pictures_is_told(two_people, plates):
    recording = open_recording(two_people)
    clip = read_clip(recording, 0, 10, lambda items, total, label: iter(items))
    backgrounds = read_plates(clip).usable if plates else {}
    keypoints = load_keypoints(recording)
    assert keypoints is not None
    assert unseen_people_findings(keypoints, clip, backgrounds, range(10)) == []
    people = np.asarray(triangulated_people(keypoints, recording.rig, 2).points, float)
    beside = np.nan_to_num(people[:, 0] + np.array([0.3, 1.6, 0.0]))
    points = np.zeros((4, 10, 3, *people.shape[2:]), np.float32)
    points[:, :, :2] = keypoints.points[:, :, :2]
    for camera, name in enumerate(recording.rig.names):
        points[camera, :, 2, :, :2] = opencv_pixels(recording.rig, name, beside.reshape(-1, 3)).reshape(10, -1, 2)
        points[camera, :, 2, :, 2] = 0.8 * np.isfinite(people[:, 0]).all(-1)
    if not plates:  # who moves that little might have become background
        assert unseen_people_findings(replace(keypoints, points=points), clip, {}, range(10)) == []
        return
    (finding,) = unseen_people_findings(replace(keypoints, points=points), clip, backgrounds, range(10))
    assert "3 people" in finding.what
    assert "never in the pictures" in finding.what
