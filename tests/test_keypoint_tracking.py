"""Tracking with keypoints: limbs are led to where they are, wrong keypoints do little, resumed runs see the same."""

import json
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from command_line import actor_file, done, refused, trackable
from drawn_scene import cells_of, draw, in_colors, make_tracker, standing
from keypoint_cases import write_keypoints
from rig_cases import ring_rig

from sogjax.cli.main import main
from sogjax.energy.keypoint_views import SeenKeypoints
from sogjax.io.keypoints.scheme import named_scheme
from sogjax.model.camera import project_points
from sogjax.run import forward
from sogjax.run.clip_keypoints import keypoint_pull
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.tracking.frame import FrameInput
from sogjax.tracking.frame_by_frame import track

SCHEME = named_scheme("HALPE_26")
LIGHT = ("outputs.overlay=false", "outputs.rerun=false", "outputs.page=false", "outputs.bvh=false", "images.depth=4")
ARM = ("left_elbow", "left_wrist")


@pytest.fixture(scope="module")
def scene():
    """A person drawn in four cameras, with the tracker, the true pose, and one with the left arm elsewhere."""
    body, rig = in_colors(shipped("human")), ring_rig(4, distortion=(0.0,) * 5)
    true = standing(body, 1.0)
    lost = true.copy()
    names = list(body.skeleton.dof_names)
    lost[names.index("left_shoulder_raise")] += 1.2
    tracker = make_tracker(body, rig, solver=GaussNewton())
    tracker = replace(tracker, terms=(*tracker.terms, keypoint_pull(SCHEME, body, 1.0)))
    return tracker, rig, true, lost


def keypoints(tracker, pose, people=1):
    """What a detector without mistakes would find."""
    points = tracker.body.posed_landmarks(jnp.asarray(pose))
    pixels = np.asarray(jax.vmap(project_points, in_axes=(0, None))(tracker.cameras, points)[0])
    on = SCHEME.on(tracker.body.landmarks.names)
    chosen = np.repeat(pixels[:, None, np.maximum(on, 0)], people, axis=1).astype(np.float32)
    sure = np.repeat((np.ones(chosen.shape[:1])[:, None] * (on >= 0))[:, None], people, axis=1).astype(np.float32)
    return SeenKeypoints(chosen, sure)


def arm_error(tracker, pose, true):
    """Metres."""
    names = tracker.body.landmarks.names
    rows = [names.index(name) for name in ARM]
    points = [np.asarray(tracker.body.posed_landmarks(jnp.asarray(each)))[rows] for each in (pose, true)]
    return float(np.linalg.norm(points[0] - points[1], axis=1).mean())


def tracked(tracker, rig, start, true, seen):
    cells = cells_of(rig, draw(tracker.body, true, rig), 6)
    frames = [FrameInput(cells, keypoints=seen)] * 2
    return np.asarray([*track(tracker, jnp.asarray(start), frames)][-1].result.pose)


@pytest.mark.slow
def test_a_limb_that_was_lost_is_led_back(scene):
    tracker, rig, true, lost = scene
    assert arm_error(tracker, lost, true) > 0.3
    pose = tracked(tracker, rig, lost, true, keypoints(tracker, true))
    assert arm_error(tracker, pose, true) < 0.04


@pytest.mark.slow
def test_a_wrong_camera_and_a_stranger_do_little(scene):
    """One camera's keypoints are of another pose, and a second person is in every picture."""
    tracker, rig, true, lost = scene
    seen, wrong = keypoints(tracker, true, people=2), keypoints(tracker, lost, people=2)
    pixels = np.array(seen.pixels)
    pixels[0] = wrong.pixels[0]
    pixels[:, 1] += 90.0
    pose = tracked(tracker, rig, true, true, SeenKeypoints(pixels, seen.confidence))
    assert arm_error(tracker, pose, true) < 0.04


@pytest.mark.slow
def test_without_keypoints_the_term_does_nothing(scene):
    tracker, rig, true, _ = scene
    alone = replace(tracker, terms=tracker.terms[:-1])
    one, other = (tracked(each, rig, true, true, None) for each in (tracker, alone))
    np.testing.assert_array_equal(one, other)


@pytest.mark.slow
def test_a_run_is_resumed_only_with_the_keypoints_that_began_it(capsys, tmp_path, monkeypatch):
    folder = trackable(tmp_path / "walk", frames=20)
    write_keypoints(folder / "keypoints", frames=20)
    command = ["track", f"recording={folder}", f"actor={actor_file(tmp_path / 'a.yaml')}", *LIGHT]
    done(capsys, *command, f"out={tmp_path / 'whole'}")
    out, whole = f"out={tmp_path / 'run'}", forward.frames_done

    def stopped(*arguments, **named):
        for count, frame in enumerate(whole(*arguments, **named)):
            if count == 17:
                raise KeyboardInterrupt
            yield frame

    with monkeypatch.context() as context:
        context.setattr(forward, "frames_done", stopped)
        main([*command, out])
    done(capsys, *command, out, "resume=true")
    one, two = (np.load(tmp_path / name / "motion.npz")["pose"] for name in ("whole", "run"))
    np.testing.assert_array_equal(one, two)
    with monkeypatch.context() as context:
        context.setattr(forward, "frames_done", stopped)
        main([*command, out, "overwrite=true"])
    file = sorted((folder / "keypoints" / "left").glob("*.json"))[0]
    content = json.loads(file.read_text())
    content["people"][0]["pose_keypoints_2d"][0] += 1.0
    file.write_text(json.dumps(content))
    capsys.readouterr()
    assert "the keypoints changed" in refused(capsys, *command, out, "resume=true")
