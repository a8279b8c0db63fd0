"""The first pose from keypoints beside a recording, without a search."""

from dataclasses import replace

import numpy as np
import pytest
from body_cases import shipped
from keypoint_cases import write_keypoints

from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.keypoints.load import load_keypoints
from sogjax.io.recording import open_recording
from sogjax.run import first_pose
from sogjax.run.keypoint_start import keypoint_start
from sogjax.run.recordings import upright
from sogjax.settings.compose import track_config
from sogjax.synth.detector import DetectorSettings
from sogjax.synth.render import render_recording
from sogjax.synth.settings import SynthSettings

FRAMES = 3
HUMAN = shipped("human")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Four cameras that see a person walk, with keypoints and without a rough pose."""
    settings = SynthSettings(
        cameras=4, frames=FRAMES, width=160, height=120, example_poses=False, background=False, shadows=False
    )
    path = tmp_path_factory.mktemp("rendered") / "walk"
    render_recording(settings, path, workers=1, detector=DetectorSettings(keypoints="pose2sim"))
    (path / "initial_pose.yaml").unlink()
    return path


def error(recording, pose, frame):
    """Mean distance of the landmarks from the truth, metres."""
    truth = load_ground_truth(recording.ground_truth)
    points = np.asarray(upright(HUMAN, recording).posed_landmarks(pose))
    pairs = [(k, truth.joint_names.index(n)) for k, n in enumerate(HUMAN.landmarks.names) if n in truth.joint_names]
    return np.mean([np.linalg.norm(points[k] - truth.joints[frame, j]) for k, j in pairs])


@pytest.mark.parametrize("frame", [0, 2])
def test_the_pose_is_that_of_the_frame(folder, frame):
    recording = open_recording(folder)
    pose = keypoint_start(recording, upright(HUMAN, recording), frame)
    assert error(recording, pose, frame) < 0.08  # a body of another size


def test_it_is_used_where_nothing_else_is_given(folder, monkeypatch):
    def forbidden(*_):
        raise AssertionError("searched")

    monkeypatch.setattr(first_pose, "ClipSearch", forbidden)
    recording = open_recording(folder)
    body, config = upright(HUMAN, recording), track_config(recording=folder)
    (pose,) = first_pose.first_poses(recording, [body], config, 1)
    assert error(recording, pose, 1) < 0.08
    for searched in ({"initial_pose": "auto"}, {}):
        bodies = [body] if searched else [body, replace(body, name="other")]
        with pytest.raises(AssertionError, match="searched"):
            first_pose.first_poses(recording, bodies, replace(config, **searched), 1)


def test_without_keypoints_or_with_wrong_ones_there_is_no_pose(folder, tmp_path, capsys):
    recording = open_recording(folder)
    body = upright(HUMAN, recording)
    assert keypoint_start(replace(recording, path=tmp_path), body, 0) is None
    assert keypoint_start(replace(recording, rig=recording.rig.select(recording.rig.names[:1])), body, 0) is None
    write_keypoints(tmp_path / "keypoints", cameras=recording.rig.names, frames=FRAMES)
    assert keypoint_start(replace(recording, path=tmp_path), body, 0) is None
    found = load_keypoints(replace(recording, path=tmp_path))
    assert found is not None
