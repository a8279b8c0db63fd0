"""Actors without a T-pose, and who is who of several, from keypoints beside a recording."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped

from sogjax.actor.colors import measured_colors
from sogjax.errors import InputError
from sogjax.io.example_poses import ExamplePose
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.recording import open_recording
from sogjax.run.actors import ActorRequest, new_actors
from sogjax.run.background import Background
from sogjax.run.clip import Clip
from sogjax.run.keypoint_actor import keypoint_actor, with_rough_poses
from sogjax.run.keypoint_initial_pose import keypoint_poses
from sogjax.run.recordings import upright
from sogjax.settings.compose import track_config
from sogjax.synth.detector import DetectorSettings
from sogjax.synth.render import render_recording
from sogjax.synth.settings import SynthSettings

HUMAN = shipped("human")
SPACE = "hsv_cylinder"
BONES = [("knee", "ankle"), ("hip", "knee"), ("shoulder", "elbow"), ("elbow", "wrist")]


def rendered(path, motion, actors, frames, **values):
    """A recording without example poses, pictures of the empty scene and rough poses, but with keypoints."""
    settings = SynthSettings(
        motion, actors=actors, cameras=4, frames=frames, width=320, height=240, example_poses=False, background=False,
        shadows=False,
    )  # fmt: skip
    render_recording(settings, path, workers=1, detector=DetectorSettings(keypoints="pose2sim", **values))
    (path / "initial_pose.yaml").unlink(missing_ok=True)
    return open_recording(path)


def clip_of(recording):
    return Clip(recording, recording.frames, 8)


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    return rendered(tmp_path_factory.mktemp("rendered") / "walk", "walk", 1, 4)


@pytest.mark.slow
def test_an_actor_has_the_lengths_of_the_person_and_the_colours_of_the_pictures(walk):
    actor = keypoint_actor(walk, HUMAN, SPACE)
    truth = load_ground_truth(walk.ground_truth)
    names, points = actor.landmarks.names, np.asarray(actor.posed_landmarks(actor.poses["rest"]))
    own = lambda a, b: np.linalg.norm(points[names.index(f"left_{a}")] - points[names.index(f"left_{b}")])
    true = lambda a, b: np.linalg.norm(
        truth.joints[0, truth.joint_names.index(f"left_{a}")] - truth.joints[0, truth.joint_names.index(f"left_{b}")]
    )
    ratios = np.array([own(*bone) / true(*bone) for bone in BONES])
    assert np.abs(np.log(ratios)).mean() < 0.04
    thigh, hand = (actor.blobs.names.index(name) for name in ("left_thigh3", "left_hand1"))
    apart = np.abs(np.asarray(actor.blob_colors[thigh]) - np.asarray(actor.blob_colors[hand])).max()
    assert apart > 0.1  # trousers and skin
    assert float(jnp.abs(actor.blob_colors - HUMAN.blob_colors).max()) > 0.1


@pytest.mark.slow
def test_example_frames_get_rough_poses(walk):
    hinted = with_rough_poses(replace(walk, example_poses=(ExamplePose("frame_2", None, {}, {}, None, 2),)), HUMAN)
    truth = load_ground_truth(walk.ground_truth)
    landmarks = hinted.example_poses[0].initial_pose.landmarks
    off = [
        np.linalg.norm(np.array(landmarks[n]) - truth.joints[2, k])
        for k, n in enumerate(truth.joint_names)
        if n in landmarks
    ]
    assert np.mean(off) < 0.08


def test_without_keypoints_the_reason_stands(walk, tmp_path):
    def made(recording, number=None):
        nothing = Background(None, "nobody moves")
        return new_actors(ActorRequest(clip_of(recording), lambda: nothing, number=number))

    with pytest.raises(InputError, match="none can be taken from the videos: nobody moves"):
        made(replace(walk, path=tmp_path))
    with pytest.raises(InputError, match="none can be taken from the videos: nobody moves"):
        made(walk, 2)


@pytest.mark.slow
def test_who_is_who_is_told_by_colours(tmp_path, monkeypatch):
    """Two bodies of one shape: each in the colours of one of two people."""
    recording = rendered(tmp_path / "two", "pass", 2, 1)
    truth = load_ground_truth(recording.ground_truth)
    config = track_config(recording=recording.path, images={"background": "none"})
    body, nothing = upright(HUMAN, recording), Background(None)
    monkeypatch.setattr("sogjax.run.keypoint_initial_pose.CLEARLY", 0.0)  # nobody has colours yet
    poses = keypoint_poses(clip_of(recording), nothing, [body, replace(body, name="other")], config, 0)
    people = [measured_colors(recording, body, [0], np.asarray(pose)[None], SPACE) for pose in poses]
    monkeypatch.undo()
    named = [replace(person, name=name) for person, name in zip(people, ("a", "b"), strict=True)]
    places = lambda bodies: [np.asarray(p)[:3] for p in keypoint_poses(clip_of(recording), nothing, bodies, config, 0)]
    one, two = places(named), places(named[::-1])
    np.testing.assert_allclose(one, two[::-1], atol=1e-3)
    assert len(truth.subjects) == 2
    assert np.linalg.norm(one[0] - one[1]) > 0.3
