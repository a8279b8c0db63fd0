"""Adjusting cameras: the derivative by their moves, which of them are believed, files, and what is refused."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from command_line import actor_file, refused, trackable
from drawn_scene import cells_of, draw, in_colors, make_tracker, moved, standing
from rig_cases import recording_of, ring_rig
from scipy.spatial.transform import Rotation
from test_adjust import DEPTH, GRADIENT

from sogjax.energy.frame_energy import FrameEnergy, standard_terms
from sogjax.energy.posed import History
from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.motion import motion_from_poses
from sogjax.io.motion_data import save_motion
from sogjax.io.recording import open_recording
from sogjax.refine.adjustment import adjusted
from sogjax.refine.camera_moves import MOVE, TIME, Sights, moved_cameras, velocities_of
from sogjax.refine.camera_search import CamerasModel, Part, free_moves
from sogjax.refine.clip_shape import ClipShape
from sogjax.refine.frame_models import frame_model, shape_rates
from sogjax.refine.pictures import Reader
from sogjax.run.adjust_cameras import camera_lines, check_cameras, moved_rig, moves_of, write_cameras
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameInput, TrackState


@pytest.fixture(scope="module")
def scene():
    """A human before four cameras: the tracker, its pose and its cameras."""
    body, rig = in_colors(shipped("human")), ring_rig(4, (160, 120), distortion=np.zeros(5), distance=3.0)
    pose = moved(body, standing(body, 0.95), {"left_elbow": 0.4, "right_knee": 0.3, "left_shoulder_raise": 0.5})
    return make_tracker(body, rig, DEPTH), pose, rig


@pytest.mark.slow
def test_a_frame_has_the_gradient_of_its_energy_by_the_moves_of_the_cameras(scene):
    tracker, pose, rig = scene
    cells = cells_of(rig, draw(tracker.body, pose, rig), DEPTH)
    near = jnp.asarray(moved(tracker.body, pose, {"root_x": 0.02, "left_elbow": -0.1}))
    views, _, _ = tracker.views(FrameInput(jnp.asarray(cells)), TrackState.from_pose(near), Capacities(1024, 1024))
    shape = ClipShape.from_body(tracker.body, "z")
    none, terms = jnp.zeros(shape.num_params), standard_terms()
    rng = np.random.default_rng(0)
    moves = jnp.asarray(rng.normal(size=(4, MOVE)) * np.repeat([0.005, 0.01, 0.4], [3, 3, 1]), jnp.float32)
    velocity = jnp.asarray([0.03, -0.02, 0.01], jnp.float32)

    def energy(moves):
        """Whatever moves on in a straight line is seen as if the camera moved the other way."""
        cameras = moved_cameras(rig.cameras, moves)
        turned = jnp.einsum("cij,j->ci", cameras.camera_from_world[:, :3, :3], velocity)
        later = cameras.camera_from_world.at[:, :3, 3].add(moves[:, TIME] * turned)
        seen = replace(views, cameras=replace(cameras, camera_from_world=later))
        return FrameEnergy(tracker.body, seen, History.unknown(near), terms)(near)

    @jax.jit
    def found():
        sights = Sights(moves, jnp.broadcast_to(velocity, (tracker.body.num_blobs, 3)))
        return frame_model(tracker.body, shape_rates(shape, none), near, views, terms, sights)

    value, gradient = jax.jit(jax.value_and_grad(energy))(moves)
    model = found()
    assert float(model.value) == pytest.approx(float(value), rel=1e-5)
    by_moves = model.gradient[-4 * MOVE :].reshape(4, MOVE)
    np.testing.assert_allclose(by_moves, gradient, atol=GRADIENT * float(jnp.abs(gradient).max()))
    for unit in (slice(0, 3), slice(3, 6), TIME):
        part = gradient[:, unit]
        np.testing.assert_allclose(by_moves[:, unit], part, atol=5.0 * GRADIENT * float(jnp.abs(part).max()))
    assert np.linalg.eigvalsh(np.asarray(model.curvature, float)).min() > -1e-5 * np.abs(model.curvature).max()
    assert np.all(np.asarray(model.most) > 0.0)


def test_a_camera_turns_about_its_centre_which_then_moves_along_its_axes():
    cameras = ring_rig(3).cameras
    moves = np.zeros((3, MOVE), np.float32)
    moves[0, :3], moves[1, 3:6] = (0.02, -0.3, 0.1), (0.0, 0.0, 0.5)
    before, after = (np.asarray(c.camera_from_world, float) for c in (cameras, moved_cameras(cameras, moves)))
    centre = lambda pose: -pose[:3, :3].T @ pose[:3, 3]
    turned = Rotation.from_rotvec(moves[0, :3]).inv().as_matrix() @ before[0, :3, :3]
    np.testing.assert_allclose(after[0, :3, :3], turned, atol=1e-6)
    np.testing.assert_allclose(centre(after[0]), centre(before[0]), atol=1e-5)
    np.testing.assert_allclose(centre(after[1]), centre(before[1]) + 0.5 * before[1, 2, :3], atol=1e-5)
    np.testing.assert_allclose(after[2], before[2], atol=1e-6)


def test_velocities_are_those_of_frames_that_follow():
    means = np.array([0.0, 1.0, 4.0, 9.0, 0.0]).reshape(5, 1, 1) * np.ones((1, 2, 3))
    found = velocities_of(means, np.array([3, 4, 5, 6, 9]))
    np.testing.assert_allclose(found[:, 0, 0], [1.0, 2.0, 4.0, 5.0, 0.0])


def test_every_second_frame_has_the_velocities_of_all():
    frames = np.arange(3, 13)
    means = np.array([0.2, -0.1, 0.3]) * frames[:, None, None] + np.zeros((1, 2, 3))
    np.testing.assert_allclose(velocities_of(means[::2], frames[::2]), velocities_of(means, frames)[::2])


def cameras_model(moves, most=1.0, at=None):
    """Cameras of which each alone decides; the best moves are given, and those now, and what else there is to gain."""
    count = len(moves)
    curvature = np.kron(np.eye(count), np.diag([4e4, 4e4, 1e4, 4e3, 4e3, 4e3, 10.0]))
    now = np.zeros(count * MOVE) if at is None else np.reshape(at, -1)
    return CamerasModel(curvature @ (np.reshape(moves, -1) - now), curvature, now, np.full(count, most))


def test_only_what_gains_clearly_is_believed():
    moves = np.zeros((5, MOVE))
    moves[1, 0], moves[3, 6], moves[4, 1] = 0.008, 0.4, 0.001
    model = cameras_model(moves)
    questions = [Part(camera, name) for camera in range(5) for name in ("turn", "place", "time")]
    assert model.newly_told([], questions) == [Part(1, "turn"), Part(3, "time")]
    assert model.newly_told([], [part for part in questions if part.name == "time"]) == [Part(3, "time")]
    assert cameras_model(moves, most=100.0).newly_told([], questions) == []
    shares = cameras_model(moves, at=moves).shares([Part(1, "turn"), Part(4, "turn")])
    assert shares[Part(1, "turn")] > 0.5
    assert shares[Part(4, "turn")] < 0.05


def test_a_place_is_asked_for_once_its_camera_was_turned():
    moves = np.zeros((5, MOVE))
    moves[1, 3] = 0.05
    model, questions = cameras_model(moves), [Part(1, "place")]
    assert model.newly_told([], questions) == []
    assert model.newly_told([Part(1, "turn")], questions) == [Part(1, "place")]


def test_what_was_freed_is_kept_as_long_as_it_is_worth_it():
    moves = np.zeros((5, MOVE))
    moves[1, 0], moves[2, 0] = 0.006, 0.002
    free = [Part(1, "turn"), Part(2, "turn")]
    assert cameras_model(moves, at=moves).doubtful(free) == [Part(2, "turn")]


def test_a_fault_that_another_one_explains_is_none_of_its_own():
    moves = np.zeros((5, MOVE))
    moves[1, 0] = 0.008
    model = cameras_model(moves)
    coupled = model.curvature.copy()
    coupled[0, MOVE] = coupled[MOVE, 0] = 3e4
    model = replace(model, curvature=coupled, gradient=coupled @ moves.reshape(-1))
    questions = [Part(camera, "turn") for camera in range(5)]
    assert model.newly_told([], questions) == [Part(1, "turn")]
    assert model.newly_told([], questions[:1]) == [Part(0, "turn")]  # alone it would have been believed


def test_a_fault_that_two_cameras_explain_alike_is_left_alone():
    moves = np.zeros((5, MOVE))
    moves[1, 0] = 0.008
    model = cameras_model(moves)
    coupled = model.curvature.copy()
    coupled[0, MOVE] = coupled[MOVE, 0] = 3.9e4
    questions = [Part(camera, "turn") for camera in range(5)]
    model = replace(model, curvature=coupled, gradient=coupled @ moves.reshape(-1))
    assert model.newly_told([], questions) == []
    moves[0, 0] = 0.008  # both are wrong, each on its own
    assert set(cameras_model(moves).newly_told([], questions)) == {Part(0, "turn"), Part(1, "turn")}


def test_three_cameras_always_hold_the_world():
    moves = np.zeros((5, MOVE))
    moves[:, 0] = 0.01
    questions = [Part(camera, "turn") for camera in range(5)]
    assert len(cameras_model(moves).newly_told([], questions)) == 2
    assert free_moves([Part(1, "time")], 2).nonzero()[0].tolist() == [13]


@pytest.mark.slow
def test_a_turned_camera_and_a_late_one_are_found_in_a_drawn_clip(scene):
    tracker, pose, _ = scene
    rig = ring_rig(6, (160, 120), distortion=np.zeros(5), distance=3.0)
    tracker = make_tracker(tracker.body, rig, DEPTH)
    # To and fro: what moves evenly in a straight line looks the same late as it does to a camera that is turned.
    swings = {"root_x": (0.08, 12), "root_y": (0.16, 16), "left_elbow": (0.2, 9), "right_shoulder_raise": (0.24, 10)}
    swing = lambda t: {name: far * np.sin(2.0 * np.pi * t / period) for name, (far, period) in swings.items()}
    at = lambda t: moved(tracker.body, pose, swing(t))
    late = [draw(tracker.body, at(t + 0.4), rig) for t in range(24)]
    drawn = [draw(tracker.body, at(t), rig) for t in range(24)]
    cells = [cells_of(rig, [*one[:2], other[2], *one[3:]], DEPTH) for one, other in zip(drawn, late, strict=True)]
    wrong = np.zeros((6, MOVE), np.float32)
    wrong[0, :2] = np.deg2rad([0.4, -0.6])
    tracker = replace(tracker, cameras=moved_cameras(rig.cameras, jnp.asarray(wrong)))
    reader = Reader.from_tracker(tracker, cells[0].shape[1:3])
    pictures = lambda rows, near: reader.pictures([cells[row] for row in rows], near)
    start, frames = np.stack([at(t) for t in range(24)]), np.arange(24)
    names, unknown = ("turn", "place", "time"), np.full(24, np.nan)
    found = adjusted(tracker, pictures, start, frames, unknown, 30.0, "z", 60, with_shape=False, in_question=names)
    assert {(part.camera, part.name) for part in found.told} == {(0, "turn"), (2, "time")}
    np.testing.assert_allclose(np.rad2deg(found.moves[0, :2]), [-0.4, 0.6], atol=0.15)  # a pixel is 0.4 degrees
    assert found.moves[2, 6] == pytest.approx(0.4, abs=0.1)
    assert not found.moves[[1, 3, 4, 5]].any()


@pytest.fixture
def recording(tmp_path):
    """A recording of four cameras around somebody."""
    folder = trackable(tmp_path / "walk", frames=8)
    return open_recording(folder)


def test_adjusted_cameras_are_used_again(recording, tmp_path):
    rig = recording.rig
    moves = np.zeros((len(rig), MOVE))
    moves[0, 1], moves[1, 6] = 0.01, 0.4
    written = write_cameras(recording, recording, moves, tmp_path)
    for path in written:
        path.rename(recording.path / path.name)
    again = open_recording(recording.path)
    expected = moved_rig(rig, moves)
    np.testing.assert_allclose(again.rig.cameras.camera_from_world, expected.cameras.camera_from_world, atol=1e-6)
    np.testing.assert_array_equal(expected.cameras.camera_from_world[1:], rig.cameras.camera_from_world[1:])
    assert again.frame_offset[rig.names[1]] == 0
    np.testing.assert_allclose(moves_of(again)[1, 6], 0.4, atol=1e-6)
    assert again.up == recording.up


def test_what_was_found_is_said():
    numbers = {
        "b": {"turned_deg": 0.3, "moved_cm": 0.0, "late_frames": 0.0, "explained": {"turn": 0.5}},
        "c": {"turned_deg": 0.0, "moved_cm": 0.0, "late_frames": -0.4, "explained": {"time": 0.2}},
    }
    lines = camera_lines(numbers, ("a", "b", "c")).splitlines()
    assert lines == ["b: turned by 0.30 degrees (50% explained)", "c: 0.40 frames early (20% explained)", lines[-1]]
    assert lines[-1] == "the other 1 camera stays as it is"
    assert camera_lines({}, ("a", "b")) == "no camera is clearly off: all stay as they are"


def still_motion(frames, speed=0.0):
    body = in_colors(shipped("human"))
    poses = np.zeros((frames, body.skeleton.num_dofs), np.float32)
    poses[:, 0] = speed * np.arange(frames)
    return motion_from_poses(body, poses, 50.0)


def test_cameras_that_cannot_be_told_are_refused():
    ring, walking = recording_of(ring_rig(5), 30), still_motion(30, 0.02)
    check_cameras(ring, walking, True, True)
    with pytest.raises(InputError, match=r"cameras=true: walk has 3 cameras; .* at least 4"):
        check_cameras(recording_of(ring_rig(3), 30), walking, True, False)
    with pytest.raises(InputError, match="offsets=true: walk has 2 cameras"):
        check_cameras(recording_of(ring_rig(2), 30), walking, False, True)
    cameras = ring.rig.cameras
    poses = np.array(cameras.camera_from_world)
    centres = np.array([1.0, 2.0, 1.5]) + np.arange(5)[:, None] * np.array([0.5, 0.1, 0.0])
    poses[:, :3, 3] = -np.einsum("cij,cj->ci", poses[:, :3, :3], centres)
    line = CameraRig(ring.rig.names, eqx.tree_at(lambda c: c.camera_from_world, cameras, jnp.asarray(poses)))
    with pytest.raises(InputError, match="stand in a line"):
        check_cameras(replace(ring, rig=line), walking, True, False)
    check_cameras(replace(ring, rig=line), walking, False, True)
    with pytest.raises(InputError, match="hardly anybody moves"):
        check_cameras(ring, still_motion(30), False, True)
    check_cameras(ring, still_motion(30), True, False)
    with pytest.raises(InputError, match="has 12 frames, too few to tell anything of cameras"):
        check_cameras(ring, still_motion(12, 0.02), True, False)


def test_the_command_refuses_before_anything_is_written(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recording, actor = trackable(tmp_path / "walk", frames=8), actor_file(tmp_path / "actor.yaml")
    body = load_body(actor)
    save_motion(tmp_path / "motion.npz", motion_from_poses(body, np.zeros((6, body.skeleton.num_dofs)), 25.0))
    words = [f"recording={recording}", f"motion={tmp_path / 'motion.npz'}", f"out={tmp_path / 'out'}"]
    assert "cameras=true" in refused(capsys, "adjust", *words, "cameras=true")
    assert "offsets=true" in refused(capsys, "adjust", *words, "offsets=true")
    assert not (tmp_path / "out").exists()


def test_offsets_may_be_parts_of_a_frame(recording):
    settings = recording.path / "recording.yaml"
    name = recording.rig.names[0]
    for given, whole, part in ((0.4, 0, 0.4), (-1.6, -2, 0.4), (2, 2, 0.0)):
        settings.write_text(f"up: z\nframe_offset: {{{name}: {given}}}\n")
        found = open_recording(recording.path)
        assert found.frame_offset[name] == whole
        assert found.frame_part.get(name, 0.0) == pytest.approx(part)
    settings.write_text(f"up: z\nframe_offset: {{{name}: soon}}\n")
    with pytest.raises(InputError, match="expected a number of frames"):
        open_recording(recording.path)
