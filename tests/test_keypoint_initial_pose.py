"""The initial pose from keypoints beside a recording, without a search."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from keypoint_cases import write_keypoints
from rig_cases import opencv_pixels

from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.keypoints.load import load_keypoints
from sogjax.io.recording import open_recording
from sogjax.run.actors import Actors
from sogjax.run.background import Background, learn_background
from sogjax.run.clip import Clip
from sogjax.run.clip_keypoints import clip_keypoints
from sogjax.run.initial_pose import PoseRequest, find_initial_pose, from_example_frames, from_file, from_keypoints
from sogjax.run.keypoint_initial_pose import keypoint_poses
from sogjax.run.recordings import upright
from sogjax.search.keypoint_people import triangulated_people
from sogjax.settings.compose import track_config
from sogjax.synth.detector import DetectorSettings
from sogjax.synth.render import render_recording
from sogjax.synth.settings import SynthSettings

pytestmark = pytest.mark.slow

FRAMES = 3
HUMAN = shipped("human")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Four cameras that see a person walk, with keypoints and without a rough pose."""
    settings = SynthSettings(cameras=4, frames=FRAMES, width=160, height=120, example_poses=False, shadows=False)
    path = tmp_path_factory.mktemp("rendered") / "walk"
    render_recording(settings, path, workers=1, detector=DetectorSettings(keypoints="pose2sim"))
    (path / "initial_pose.yaml").unlink()
    return path


def starts(recording, bodies, frame=0):
    config = track_config(recording=recording.path)
    return keypoint_poses(Clip(recording, recording.frames, 8), Background(None), bodies, config, frame)


def error(recording, pose, frame):
    """Mean distance of the landmarks from the truth, metres."""
    truth = load_ground_truth(recording.ground_truth)
    points = np.asarray(upright(HUMAN, recording).posed_landmarks(jnp.asarray(pose)))
    pairs = [(k, truth.joint_names.index(n)) for k, n in enumerate(HUMAN.landmarks.names) if n in truth.joint_names]
    return np.mean([np.linalg.norm(points[k] - truth.joints[frame, j]) for k, j in pairs])


@pytest.mark.parametrize("frame", [0, 2])
def test_the_pose_is_that_of_the_frame(folder, frame):
    recording = open_recording(folder)
    (pose,) = starts(recording, [upright(HUMAN, recording)], frame)
    assert error(recording, pose, frame) < 0.08  # a body of another size


class SearchedError(Exception):
    """Raised where a pose is searched for."""


def search(request):
    raise SearchedError


def test_it_is_used_where_nothing_else_is_given(folder):
    recording = open_recording(folder)
    sources = (from_file, from_example_frames, from_keypoints, search)
    clip, config = Clip(recording, recording.frames[1:], 8), track_config(recording=folder)
    request = PoseRequest(clip, Background(None), Actors((HUMAN,)), config)
    found = find_initial_pose(request, sources)
    assert (found.frame, found.source) == (1, "keypoints")
    assert error(recording, found.pose, 1) < 0.08
    asked = replace(request, config=replace(config, initial_pose="auto"))
    several = replace(request, actors=Actors((HUMAN, replace(HUMAN, name="other"))))
    for searched in (asked, several):
        with pytest.raises(SearchedError):
            find_initial_pose(searched, sources)


def test_without_keypoints_or_with_wrong_ones_there_is_no_pose(folder, tmp_path, capsys):
    recording = open_recording(folder)
    body = upright(HUMAN, recording)
    assert starts(replace(recording, path=tmp_path), [body]) is None
    assert starts(replace(recording, rig=recording.rig.select(recording.rig.names[:1])), [body]) is None
    write_keypoints(tmp_path / "keypoints", cameras=recording.rig.names, frames=FRAMES)
    assert starts(replace(recording, path=tmp_path), [body]) is None
    found = load_keypoints(replace(recording, path=tmp_path))
    assert found is not None


def test_a_person_of_the_keypoints_where_nobody_is_seen_is_no_actor(folder, capsys):
    """A phantom on whom all cameras agree, 1.5 m beside the only person."""
    recording = open_recording(folder)
    body, config = upright(HUMAN, recording), track_config(recording=folder)
    clip = Clip(recording, recording.frames, 8, clip_keypoints(recording, config))
    plates = learn_background(clip, "pictures")
    assert clip.keypoints is not None
    kept = clip.keypoints.found
    true = np.asarray(triangulated_people(kept, recording.rig).points[:, 0])
    phantom = np.zeros((len(recording.rig), FRAMES, 1, *true.shape[1:]), np.float32)
    for camera, name in enumerate(recording.rig.names):
        pixels = opencv_pixels(recording.rig, name, np.nan_to_num(true + np.array([1.0, 1.1, 0.0])).reshape(-1, 3))
        phantom[camera, ..., :2] = pixels.reshape(FRAMES, 1, -1, 2)
        phantom[camera, ..., 2] = np.isfinite(true).all(-1)[:, None]

    def found(points, background):
        keypoints = replace(clip.keypoints, found=replace(kept, points=points))
        return keypoint_poses(Clip(recording, recording.frames, 8, keypoints), background, [body], config, 0)

    only, first = phantom, np.concatenate([phantom, kept.points], axis=2)
    assert found(only, Background(None)) is not None, "which keypoints alone cannot tell"
    capsys.readouterr()
    assert found(only, plates) is None
    assert "is left out" in capsys.readouterr().err
    (pose,) = found(first, plates)
    assert error(recording, pose, 0) < 0.08
