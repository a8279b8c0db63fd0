"""Actors from example pictures: colours projected back, sizes fitted to silhouettes."""

import threading
from dataclasses import replace

import cv2
import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import posed, shipped
from drawn_scene import draw, in_colors, moved, standing
from rig_cases import opencv_pixels, recording_of, ring_rig
from tiny_body import make_body

from sogjax.actor import posed_examples, silhouette_fit
from sogjax.actor.colors import ColoredView, back_projected_colors, colored
from sogjax.actor.example_pose import forward
from sogjax.actor.make import make_actor, subjects_of
from sogjax.energy.frame_energy import standard_terms
from sogjax.errors import InputError
from sogjax.io.example_poses import ExamplePose
from sogjax.io.pose_description import PoseDescription
from sogjax.model.body import Attachments
from sogjax.model.shape import ShapeModel

COLOR = 0.02
"""A byte is 0.004; discs have edges."""
TRUE_SCALE = 1.08
TRACED_IN = []
"""The threads in which the climb of the shape was traced."""
FLESH = 1.5
"""Radius of the flesh around a blob of sigma 1 in the example pictures, where blobs overlap."""
COLORS = np.array([[0.9, 0.2, 0.1], [0.1, 0.7, 0.3], [0.2, 0.3, 0.9]])


def three_blobs(rig, apart=False):
    """Two blobs in a line with the first camera, the nearer one hiding the other, and one beside them."""
    body = make_body()
    world = np.asarray(rig.camera("cam0").camera_from_world, float)
    eye = -world[:3, :3].T @ world[:3, 3]
    far = np.array([0.0, 0.0, 1.2])
    near = far + 0.25 * (eye - far) if not apart else far + np.array([0.0, 0.0, 0.5])
    points = np.stack([far, near, far - np.array([0.0, 0.0, 0.6])])
    blobs = Attachments(("far", "near", "beside"), (5, 5, 5), jnp.asarray(points, jnp.float32))
    body = eqx.tree_at(lambda b: b.blobs, body, blobs)
    body = eqx.tree_at(lambda b: b.blob_sigmas, body, jnp.array([0.1, 0.12, 0.1]))
    return colored(body, COLORS)


def views_of(body, rig, cameras=None, masks=True):
    pose = body.poses["rest"]
    images, silhouettes = draw(body, pose, rig), draw(body, pose, rig, masks=True)
    return [
        ColoredView(rig.camera(name), images[k], silhouettes[k] if masks else None, pose)
        for k, name in enumerate(rig.names)
        if cameras is None or k in cameras
    ]


@pytest.mark.parametrize("space", ["rgb", "hsv", "hsv_cylinder", "lab"])
def test_the_colours_of_a_drawn_body_come_back(space):
    """Through distorting lenses, with and without masks."""
    rig = ring_rig(3)
    body = three_blobs(rig, apart=True)
    grey = colored(body, np.full((3, 3), 0.5))
    for masks in (True, False):
        found = back_projected_colors(grey, views_of(body, rig, masks=masks), space).colors
        np.testing.assert_allclose(found, COLORS, atol=COLOR)


def test_views_in_which_a_blob_is_hidden_are_left_out():
    rig = ring_rig(3)
    body = three_blobs(rig)
    found = back_projected_colors(body, views_of(body, rig), "rgb").colors
    np.testing.assert_allclose(found, COLORS, atol=COLOR)


def test_a_blob_that_no_picture_shows_takes_the_colour_of_the_nearest():
    """The first camera sees the far blob only behind the near one."""
    rig = ring_rig(3)
    body = three_blobs(rig)
    found = back_projected_colors(body, views_of(body, rig, cameras=[0]), "rgb").colors
    nearest = 2 if np.linalg.norm(_offset(body, 0, 2)) < np.linalg.norm(_offset(body, 0, 1)) else 1
    np.testing.assert_allclose(found[0], COLORS[nearest], atol=COLOR)
    np.testing.assert_allclose(found[1:], COLORS[1:], atol=COLOR)


def _offset(body, a, b):
    return np.asarray(body.blobs.offsets[a] - body.blobs.offsets[b])


def test_where_nothing_is_seen_a_body_keeps_its_colours():
    rig = ring_rig(3)
    body = three_blobs(rig)
    views = [replace(view, mask=np.zeros_like(view.mask)) for view in views_of(body, rig)]
    np.testing.assert_allclose(back_projected_colors(body, views, "rgb").colors, COLORS, atol=1e-6)


def test_what_the_mask_leaves_out_is_not_looked_at():
    """A rod in front of every blob, in a colour of its own, that the masks do not cover."""
    rig = ring_rig(3)
    body = three_blobs(rig, apart=True)
    views = []
    for view, name in zip(views_of(body, rig), rig.names, strict=True):
        image, mask = view.image.copy(), view.mask.copy()
        for x, y in opencv_pixels(rig, name, posed(body, body.poses["rest"])[0].means):
            rod = (slice(None), slice(round(x) - 1, round(x) + 30))
            image[rod], mask[rod] = (255, 0, 255), False
            del y
        views.append(replace(view, image=image, mask=mask))
    np.testing.assert_allclose(back_projected_colors(body, views, "rgb").colors, COLORS, atol=COLOR)


def write_example(folder, name, body, pose, rig, initial_pose=None, actor=None, with_masks=True):
    """Write the drawn pictures of an example pose."""
    folder = folder / name
    folder.mkdir(parents=True)
    images, masks = {}, {}
    pictures = (draw(body, pose, rig, masks, disc=FLESH) for masks in (False, True))
    drawn = zip(rig.names, *pictures, strict=True)
    for camera, image, mask in drawn:
        images[camera], masks[camera] = folder / f"{camera}.png", folder / f"{camera}.mask.png"
        assert cv2.imwrite(str(images[camera]), image)
        assert cv2.imwrite(str(masks[camera]), mask.astype(np.uint8) * 255)
    return ExamplePose(name, actor, images, masks if with_masks else {}, initial_pose)


def size_of(body):
    """Mean distance of all pairs of landmarks in the rest pose (metres)."""
    points = np.asarray(posed(body, body.poses["rest"])[1], float)
    return np.linalg.norm(points[:, None] - points[None], axis=-1).mean()


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A dog that is 8 % larger than the shipped one, in two poses.

    One has a hint that is 30 degrees and 10 cm off, the other has to be found.
    """
    folder = tmp_path_factory.mktemp("example_poses")
    dog = shipped("dog")
    model = ShapeModel.from_body(dog)
    scale = jnp.zeros(model.num_shape_params).at[0].set(np.log(TRUE_SCALE))
    truth = in_colors(model.shaped(scale))
    rig = ring_rig(4, (160, 120), distance=1.5)
    stand = moved(truth, standing(truth, 1.1), {"root_yaw": 0.6})
    trot = np.array(truth.poses["trot_left"])
    trot = moved(truth, trot, {"root_x": 0.1, "root_z": 1.1 - float(trot[2]), "root_yaw": -1.0})
    hint = PoseDescription(pose="rest", position=(0.08, -0.06, 1.1), heading=np.degrees(0.6) - 30.0, landmarks={})
    examples = (
        write_example(folder, "stand", truth, stand, rig, hint),
        write_example(folder, "trot", truth, trot, rig),
    )
    recording = replace(recording_of(rig, 1), example_poses=examples)
    energy = silhouette_fit.still_energy
    with pytest.MonkeyPatch.context() as patch:
        traced = lambda *given: TRACED_IN.append(threading.current_thread()) or energy(*given)
        patch.setattr(silhouette_fit, "still_energy", traced)
        actor = make_actor(recording, dog, None, "hsv_cylinder", standard_terms())
    return actor, truth, {"stand": stand, "trot": trot}


@pytest.mark.slow
@pytest.mark.usefixtures("made")
def test_the_shape_is_compiled_beside_the_search_for_poses():
    assert TRACED_IN
    assert threading.main_thread() not in TRACED_IN


@pytest.mark.slow
def test_the_size_of_the_subject_is_found(made):
    actor, truth, _ = made
    base = size_of(shipped("dog"))
    assert abs(size_of(actor.body) - size_of(truth)) < 0.03 * size_of(truth)
    assert abs(size_of(actor.body) / base - TRUE_SCALE) < (TRUE_SCALE - 1.0) / 2.0


@pytest.mark.slow
def test_the_poses_of_the_examples_are_found(made):
    actor, truth, poses = made
    assert set(actor.example_poses) == set(poses)
    for name, pose in poses.items():
        found = np.asarray(posed(actor.body, actor.example_poses[name])[1], float)
        expected = np.asarray(posed(truth, jnp.asarray(pose))[1], float)
        assert np.linalg.norm(found - expected, axis=1).mean() < 0.05


@pytest.mark.slow
def test_frames_that_nobody_chose_are_fitted_both_ways_round(made, tmp_path, monkeypatch):
    """Whichever way colours seem to show it: the fitted body agrees better with the masks the right way round."""
    _, truth, poses = made
    rig = ring_rig(4, (160, 120), distance=1.5)
    examples = tuple(write_example(tmp_path, name, truth, pose, rig) for name, pose in poses.items())
    recording = replace(recording_of(rig, 1), example_poses=examples)
    for turned in (False, True):
        way = lambda fits, _, turned=turned: tuple(len(of_one) - 1 if turned else 0 for of_one in fits)
        monkeypatch.setattr(posed_examples, "consistent_ways", way)
        actor = make_actor(recording, shipped("dog"), None, "hsv_cylinder", standard_terms(), best=2)
        for name, pose in poses.items():
            ways = forward(actor.upright_body, [actor.example_poses[name], pose], "z")
            assert np.dot(*ways) > 0.8, (name, turned)


@pytest.mark.slow
def test_the_colours_of_the_subject_are_found(made):
    """For most blobs: small ones lie beside each other."""
    actor, truth, _ = made
    error = np.linalg.norm(np.asarray(actor.body.blob_colors - truth.blob_colors), axis=1)
    assert np.median(error) < 0.1


@pytest.mark.slow
def test_the_actor_keeps_its_names_and_stands_in_its_own_frame(made):
    actor, _, _ = made
    dog = shipped("dog")
    assert actor.body.name == "dog"
    assert actor.body.skeleton.dof_names == dog.skeleton.dof_names
    np.testing.assert_allclose(actor.body.skeleton.axes, dog.skeleton.axes, atol=1e-6)
    assert set(actor.body.poses) == set(dog.poses)


RIG = ring_rig(2, (64, 48), distance=1.5)


def drawn_recording(folder, *actors, with_masks=True):
    body = shipped("dog")
    poses = [
        write_example(folder, f"pose{k}", body, standing(body, 1.1), RIG, None, actor, with_masks)
        for k, actor in enumerate(actors)
    ]
    return replace(recording_of(RIG, 1), example_poses=tuple(poses))


def refused(recording, message, subject=None):
    with pytest.raises(InputError, match=message):
        make_actor(recording, shipped("dog"), subject, "rgb", standard_terms())


def test_recordings_without_what_is_needed_are_refused(tmp_path):
    refused(recording_of(RIG, 1), "no example poses to make an actor from.*example_poses/POSE")
    refused(drawn_recording(tmp_path / "a", None, with_masks=False), "'pose0' has 0 pictures with a mask.*mask.png")
    two = drawn_recording(tmp_path / "b", "rex", "fido")
    assert subjects_of(two) == ("rex", "fido")
    refused(two, "show rex, fido; choose one with subject=NAME")
    refused(two, "no example poses of subject=lassie; they show rex, fido", "lassie")


@pytest.mark.parametrize(("value", "word"), [(0, "empty"), (255, "full")])
def test_masks_that_say_nothing_are_refused(tmp_path, value, word):
    recording = drawn_recording(tmp_path, None)
    path = recording.example_poses[0].masks["cam1"]
    assert cv2.imwrite(str(path), np.full((48, 64), value, np.uint8))
    refused(recording, f"cam1.mask.png: the mask is {word}; white must mark the subject")


def test_pictures_of_another_size_are_refused(tmp_path):
    recording = drawn_recording(tmp_path, None)
    path = recording.example_poses[0].images["cam0"]
    assert cv2.imwrite(str(path), np.zeros((24, 32, 3), np.uint8))
    refused(recording, "cam0.png: is 32x24 pixels, the calibration is for 64x48")
