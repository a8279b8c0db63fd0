"""Somebody who stands still is told from the room by being seen in one colour from all sides."""

import cv2
import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.recording import open_recording
from sogjax.io.video import read_frames
from sogjax.model.camera import distort, project_points
from sogjax.model.rotation import axis_vector
from sogjax.scene.background import BackgroundImage
from sogjax.scene.clip_background import SampledCamera
from sogjax.scene.still_body import Standing, still_bodies, with_room_behind
from sogjax.synth.render import render_recording
from sogjax.synth.settings import SynthSettings

FRAMES = 10


@pytest.fixture(scope="module")
def waving(tmp_path_factory):
    """Somebody who only lifts his arms, before eight cameras; what they show, and where the knees are."""
    folder = tmp_path_factory.mktemp("still") / "waving"
    small = {"width": 216, "height": 162, "cameras": 8, "frames": FRAMES, "fps": 6.0}
    render_recording(SynthSettings(motion="arms", example_poses=False, background=False, **small), folder)
    recording, truth = open_recording(folder), load_ground_truth(folder / "ground_truth.npz")
    shown = list(read_frames(recording, 0, FRAMES))
    sampled = [
        SampledCamera.from_images({k: images[camera] for k, images in enumerate(shown)})
        for camera in range(len(recording.rig.names))
    ]
    knees = [truth.joints[FRAMES // 2, truth.joint_names.index(f"{side}_knee")] for side in ("left", "right")]
    return recording, dict(enumerate(sampled)), np.array(knees, np.float32)


def found_in(waving, cameras, turn=None):
    """What is found, in the recording's world or in one that is turned."""
    recording, sampled, _ = waving
    turn = np.eye(3) if turn is None else np.array(turn, float)
    there = np.eye(4, dtype=np.float32)
    there[:3, :3] = turn.T
    rig = {k: recording.rig.camera(recording.rig.names[k]) for k in cameras}
    rig = {k: eqx.tree_at(lambda c: c.camera_from_world, one, one.camera_from_world @ there) for k, one in rig.items()}
    movements = {k: np.any(sampled[k].movements, axis=0) for k in cameras}
    pictures = {k: sampled[k].even.reference for k in cameras}
    return still_bodies(movements, pictures, rig, turn @ axis_vector(recording.up)), movements


def shown_at(waving, masks, points):
    """Whether each camera's mask holds points of the world."""
    recording = waving[0]
    hits = []
    for k, mask in masks.items():
        camera = recording.rig.camera(recording.rig.names[k])
        pixels = np.asarray(distort(camera, project_points(camera, jnp.asarray(points))[0]))
        columns, rows = np.rint(pixels).astype(int).T
        hits.append(mask[rows, columns])
    return np.array(hits)


def test_legs_that_never_move_are_found_in_nearly_all_cameras(waving):
    masks, movements = found_in(waving, range(8))
    knees = waving[2]
    surely, perhaps = ({k: mask[part] for k, mask in masks.items()} for part in (0, 1))
    assert shown_at(waving, surely, knees).mean() > 0.8
    assert np.mean([mask.mean() for mask in perhaps.values()]) < 0.05  # legs, trunk, and a rim
    assert all((surely[k] <= perhaps[k]).all() for k in masks)
    assert not any((perhaps[k] & movements[k]).any() for k in masks)


@pytest.mark.parametrize("turn", [((1, 0, 0), (0, 0, 1), (0, -1, 0)), ((1, 0, 0), (0, -1, 0), (0, 0, -1))])
def test_whichever_axis_points_upwards_the_same_is_found(waving, turn):
    masks, others = found_in(waving, range(8))[0], found_in(waving, range(8), turn)[0]
    both = sum((masks[k].perhaps & others[k].perhaps).sum() for k in masks)
    either = sum((masks[k].perhaps | others[k].perhaps).sum() for k in masks)
    assert both > 0.85 * either


def test_four_cameras_do_not_tell(waving):
    assert not any(mask.perhaps.any() for mask in found_in(waving, range(4))[0].values())


def test_the_room_goes_on_behind_somebody():
    room = np.full((60, 80, 3), (60, 120, 180), np.uint8)
    shown = room.copy()
    shown[20:50, 30:36] = (20, 20, 20)
    surely = np.zeros((60, 80), bool)
    surely[20:50, 30:40] = True  # the right half looks like the room
    perhaps = cv2.dilate(surely.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    nothing = np.zeros_like(surely)
    background = BackgroundImage(shown, np.full((60, 80), 2.0, np.float32), ~surely, "clip")
    found = with_room_behind(background, Standing(surely, perhaps), nothing, shown)
    assert np.abs(found.picture[22:48, 31:35].astype(int) - room[22:48, 31:35]).max() <= 3
    assert (found.spread[22:48, 31:35] > 5.0).all()
    assert found.known[22:48, :36].all()
    assert not found.known[22:48, 37:39].any()
    assert found.known[22:48, 40:].all()
    np.testing.assert_array_equal(found.picture[~surely], shown[~surely])
    assert with_room_behind(background, Standing(nothing, nothing), nothing, shown) is background
