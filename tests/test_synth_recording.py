"""Rendered recordings: whole, reproducible, and true to their calibration."""

import dataclasses
from pathlib import Path

import cv2
import jax.numpy as jnp
import numpy as np
import pytest

from sogjax.errors import InputError
from sogjax.io.cache_folder import default_cache_dir
from sogjax.io.calibration.rig import CameraEntry, rig_from_entries
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.image_file import read_image, read_mask
from sogjax.io.pose_description import load_initial_poses
from sogjax.io.recording import open_recording
from sogjax.io.recording_files import RECORDING_FILES
from sogjax.io.video import read_frames
from sogjax.model.camera import distort, project_points
from sogjax.synth import render as render_module
from sogjax.synth.cache import cache_name, cached_recording
from sogjax.synth.figure import Mesh
from sogjax.synth.light import ShadowMap
from sogjax.synth.picture import plate_of
from sogjax.synth.render import render_recording
from sogjax.synth.scene import Scene, Texture
from sogjax.synth.settings import SynthSettings
from sogjax.synth.stage import stage_of
from sogjax.synth.views import ring_of_views

SMALL = SynthSettings(cameras=3, width=160, height=120, frames=3, seed=2)


@pytest.fixture(scope="module")
def stage():
    return stage_of(SMALL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return render_recording(SMALL, tmp_path_factory.mktemp("synth") / "walk", workers=1)


@pytest.mark.slow
def test_a_rendered_recording_is_of_the_registered_files(folder):
    rendered = {part.name for part in RECORDING_FILES if part.rendered}
    assert {path.name for path in folder.iterdir()} == rendered - {"keypoints", "pose"}


def camera_of(settings, index=0):
    """The calibrated camera as the rest of the package sees it."""
    view = ring_of_views(settings, np.random.default_rng(0))[index]
    entry = CameraEntry(
        name=view.name,
        intrinsics=view.matrix,
        rotation=view.camera_from_world[:3, :3],
        translation=view.camera_from_world[:3, 3],
        distortion=view.distortion,
        size=(view.width, view.height),
    )
    return view, rig_from_entries(Path("memory"), [entry]).camera(view.name)


def patch_scene(point, towards):
    """A bright square of 12 cm around a point, facing the camera, its edges aslant, and nothing else."""
    forward = (towards - point) / np.linalg.norm(towards - point)
    u = np.cross([0.0, 0.0, 1.0], forward)
    u *= 0.06 / np.linalg.norm(u)
    v = np.cross(forward, u)
    u, v = 0.9 * u + 0.436 * v, 0.9 * v - 0.436 * u
    corners = point + np.array([-u - v, u - v, u + v, v - u])
    mesh = Mesh(corners, np.tile(forward, (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]))
    away = Mesh(corners + 50.0, mesh.normals, mesh.faces)
    white = Texture("plain", ((0.8, 0.8, 0.8),))
    return Scene(mesh, np.zeros((4, 2)), np.zeros(2, int), (white,), ShadowMap.of([away]))


@pytest.mark.parametrize("distortion", [0.0, -0.2])
@pytest.mark.parametrize("point", [(0.0, 0.0, 1.0), (0.9, -0.7, 0.3), (-1.0, 0.8, 1.7)])
def test_a_point_is_drawn_where_the_calibration_projects_it(point, distortion):
    view, camera = camera_of(SynthSettings(cameras=4, distortion=distortion), index=1)
    pixels, _ = project_points(camera, jnp.array([point]))
    expected = np.asarray(distort(camera, pixels))[0]
    light = plate_of(patch_scene(np.array(point), np.linalg.inv(view.camera_from_world)[:3, 3]), view).total.sum(-1)
    rows, columns = np.indices(light.shape)
    seen = np.array([(columns * light).sum(), (rows * light).sum()]) / light.sum()
    np.testing.assert_allclose(seen, expected, atol=0.1)


def test_the_recording_opens_without_a_warning(folder):
    recording = open_recording(folder)
    assert recording.warnings == ()
    assert recording.rig.names == ("cam00", "cam01", "cam02")
    assert recording.num_frames == 3
    assert recording.fps == 30.0
    assert [pose.name for pose in recording.example_poses] == ["tpose", "arms_up", "elbows", "squat"]
    assert all(pose.actor == "anna" for pose in recording.example_poses)
    assert set(recording.background) == set(recording.rig.names)


@pytest.mark.slow
def test_the_video_shows_the_person_in_front_of_the_plate_where_the_markers_are(folder):
    recording = open_recording(folder)
    truth = load_ground_truth(folder / "ground_truth.npz")
    images = next(iter(read_frames(recording)))
    for name, image in zip(recording.rig.names, images, strict=True):
        plate = read_image(recording.background[name]).astype(float)
        changed = np.abs(image - plate).max(-1) > 25.0
        near = cv2.dilate(changed.astype(np.uint8), np.ones((7, 7))) > 0
        pixels, _ = project_points(recording.rig.camera(name), jnp.asarray(truth.markers[0]))
        columns, rows = np.round(np.asarray(pixels)).astype(int).T
        assert near[rows, columns].mean() > 0.9


@pytest.mark.slow
def test_masks_have_the_outline_of_the_figure(folder, stage):
    recording = open_recording(folder)
    for pose in recording.example_poses:
        vertices = stage.people[0].posed(stage.example_pose(0, pose.name)).vertices
        for name in recording.rig.names:
            mask = read_mask(pose.masks[name])
            pixels, _ = project_points(recording.rig.camera(name), jnp.asarray(vertices))
            rows, columns = np.nonzero(mask)
            drawn = np.array([[columns.min(), rows.min()], [columns.max(), rows.max()]])
            bounds = np.array([np.asarray(pixels).min(0), np.asarray(pixels).max(0)])
            np.testing.assert_allclose(drawn, bounds, atol=1.6)


def test_masks_agree_with_the_difference_to_the_plates(folder):
    recording = open_recording(folder)
    overlap = []
    for pose in recording.example_poses:
        for name in recording.rig.names:
            image, plate = read_image(pose.images[name]), read_image(recording.background[name])
            mask = read_mask(pose.masks[name])
            changed = np.abs(image.astype(float) - plate).max(-1) > 25.0
            overlap.append((changed & mask).sum() / mask.sum())
            far = cv2.dilate(mask.astype(np.uint8), np.ones((3, 3))) == 0
            assert (changed & far).sum() < 1.5 * mask.sum()  # shadows
    assert np.mean(overlap) > 0.75


def test_the_ground_truth_names_markers_and_landmarks(folder):
    truth = load_ground_truth(folder / "ground_truth.npz")
    assert truth.markers.shape == (3, 38, 3)
    assert truth.joints.shape == (3, 20, 3)
    start = load_initial_poses(folder / "initial_pose.yaml", ["anna"])["anna"]
    assert set(start.landmarks) == set(truth.joint_names)
    errors = np.array([np.array(start.landmarks[n]) - truth.joints[0, k] for k, n in enumerate(truth.joint_names)])
    assert 0.015 < errors.std() < 0.035


def test_true_angles_are_those_of_the_true_joints(folder):
    """The knee's angle is that between thigh and shank, told by the places of hip, knee and ankle alone."""
    truth = load_ground_truth(folder / "ground_truth.npz")
    for side in ("left", "right"):
        hip, knee, ankle = (
            truth.joints[:, truth.joint_names.index(f"{side}_{name}")] for name in ("hip", "knee", "ankle")
        )
        thigh, shank = knee - hip, ankle - knee
        cosine = (thigh * shank).sum(-1) / np.linalg.norm(thigh, axis=-1) / np.linalg.norm(shank, axis=-1)
        bent = truth.angles[:, truth.angle_names.index(f"knee_angle_{side[0]}")]
        np.testing.assert_allclose(np.abs(bent), np.degrees(np.arccos(cosine)), atol=1.5)


@pytest.mark.slow
def test_the_same_settings_make_the_same_files_with_any_number_of_processes(folder, tmp_path):
    again = render_recording(SMALL, tmp_path / "again", workers=2)
    files = sorted(path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    assert files == sorted(path.relative_to(again) for path in again.rglob("*") if path.is_file())
    for file in files:
        if file.suffix in (".jpg", ".png", ".yaml", ".toml"):
            assert (folder / file).read_bytes() == (again / file).read_bytes(), file
    for one, other in zip(read_frames(open_recording(folder)), read_frames(open_recording(again)), strict=True):
        np.testing.assert_array_equal(one, other)


def test_another_seed_makes_other_people_and_cameras(stage):
    other = stage_of(dataclasses.replace(SMALL, seed=3))
    assert stage.people[0].anatomy.stature != other.people[0].anatomy.stature
    assert not np.array_equal(stage.views[0].matrix, other.views[0].matrix)


@pytest.mark.slow
def test_several_people_are_named_and_photographed_alone(tmp_path):
    settings = SynthSettings(motion="pass", actors=2, cameras=1, width=64, height=64, frames=2, shadows=False)
    recording = open_recording(render_recording(settings, tmp_path / "pass", workers=1))
    truth = load_ground_truth(recording.path / "ground_truth.npz")
    assert truth.subjects == ("anna", "ben")
    assert truth.subject("ben").markers.shape == (2, 38, 3)
    assert {pose.name: pose.actor for pose in recording.example_poses}["ben_squat"] == "ben"
    poses = load_initial_poses(recording.path / "initial_pose.yaml", ["anna", "ben"])
    assert len(poses["ben"].landmarks) == 20


def test_nothing_is_left_behind_when_rendering_fails(stage, tmp_path, monkeypatch):
    def broken(*_):
        yield
        raise RuntimeError("no more light")

    monkeypatch.setattr(render_module, "stage_of", lambda _: stage)
    monkeypatch.setattr(render_module, "film_all", broken)
    with pytest.raises(RuntimeError, match="light"):
        render_recording(SMALL, tmp_path / "walk")
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_holds_something_is_not_touched(tmp_path):
    (tmp_path / "mine.txt").write_text("keep")
    with pytest.raises(InputError, match="exists and is not empty"):
        render_recording(SMALL, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"motion": "swim"}, "motion='swim' is not known; choose one of walk"),
        ({"motion": "pass"}, "set actors=2"),
        ({"actors": 9}, "actors=9 is out of range"),
        ({"frames": 0}, "frames=0 is out of range"),
        ({"width": 161}, "width=161 is odd"),
        ({"noise": float("nan")}, "noise=nan is out of range"),
    ],
)
def test_settings_that_cannot_be_rendered_are_refused(tmp_path, change, message):
    with pytest.raises(InputError, match=message):
        render_recording(dataclasses.replace(SMALL, **change), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_recording_is_rendered_once(tmp_path, monkeypatch):
    calls = []

    def counted(settings, out, progress):
        calls.append(settings)
        out.mkdir(parents=True)
        (out / "recording.yaml").write_text("fps: 30\n")
        return out

    monkeypatch.setattr("sogjax.synth.cache.render_recording", counted)
    first = cached_recording(SMALL, tmp_path)
    assert cached_recording(dataclasses.replace(SMALL), tmp_path) == first
    assert cached_recording(dataclasses.replace(SMALL, noise=0.02), tmp_path) != first
    assert len(calls) == 2
    assert cache_name(SMALL) != cache_name(dataclasses.replace(SMALL, seed=3))


def test_the_cache_is_where_the_environment_says(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    monkeypatch.delenv("SOGJAX_CACHE", raising=False)
    assert default_cache_dir() == tmp_path / "xdg" / "sogjax"
    monkeypatch.setenv("SOGJAX_CACHE", str(tmp_path / "own"))
    assert default_cache_dir() == tmp_path / "own"
