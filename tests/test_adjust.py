"""Adjusting clips: gradients of frames by pose and shape, drawn scenes, and what the command refuses."""

import json
import os
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from command_line import actor_file, refused, trackable
from drawn_scene import cells_of, draw, in_colors, make_tracker, moved, standing
from rig_cases import ring_rig

from sogjax.cli.main import main
from sogjax.energy.frame_energy import FrameEnergy, standard_terms
from sogjax.energy.posed import History
from sogjax.energy.priors import RestPenalty, pose_spread
from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.io.motion import load_motion, motion_from_poses
from sogjax.io.motion_data import save_motion
from sogjax.refine.adjustment import adjusted
from sogjax.refine.clip_energy import MANY_CAMERAS, Weights
from sogjax.refine.clip_shape import ClipShape
from sogjax.refine.frame_models import frame_model, shape_rates
from sogjax.refine.pictures import Reader, bytes_of_frame
from sogjax.run import adjust_checks
from sogjax.run.memory import available_memory
from sogjax.synth.render import render_recording
from sogjax.synth.settings import SynthSettings
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameInput, TrackState

DEPTH = 6
GRADIENT = 2e-3
"""Of the largest part of a gradient, in single precision."""


@pytest.fixture(scope="module")
def scene():
    """A human before four cameras: the tracker, its pose and its cells."""
    body, rig = in_colors(shipped("human")), ring_rig(4, (160, 120), distance=3.0)
    pose = moved(body, standing(body, 0.95), {"left_elbow": 0.4, "right_knee": 0.3, "left_shoulder_raise": 0.5})
    return make_tracker(body, rig, DEPTH), pose, rig


@pytest.mark.slow
def test_a_frame_has_the_gradient_of_its_energy_by_pose_and_shape(scene):
    tracker, pose, rig = scene
    cells = cells_of(rig, draw(tracker.body, pose, rig), DEPTH)
    near = jnp.asarray(moved(tracker.body, pose, {"root_x": 0.02, "left_elbow": -0.1, "left_clavicle_raise": 0.2}))
    views, _, _ = tracker.views(FrameInput(jnp.asarray(cells)), TrackState.from_pose(near), Capacities(1024, 1024))
    shape = ClipShape.from_body(tracker.body, "z")
    params = jnp.asarray(0.01 * np.random.default_rng(0).normal(size=shape.num_params), jnp.float32)
    terms = (*standard_terms(), RestPenalty(1e-3, pose_spread(tracker.body)))

    def energy(both):
        body = shape.shaped(both[near.shape[0] :])
        return FrameEnergy(body, views, History.unknown(near), terms)(both[: near.shape[0]])

    @jax.jit
    def found():
        return frame_model(shape.shaped(params), shape_rates(shape, params), near, views, terms)

    value, gradient = jax.jit(jax.value_and_grad(energy))(jnp.concatenate([near, params]))
    model = found()
    assert float(model.value) == pytest.approx(float(value), rel=1e-5)
    np.testing.assert_allclose(model.gradient, gradient, atol=GRADIENT * float(jnp.abs(gradient).max()))
    assert np.linalg.eigvalsh(np.asarray(model.curvature, float)).min() > -1e-5 * np.abs(model.curvature).max()


@pytest.mark.slow
def test_a_forearm_that_is_too_long_is_found_from_a_clip(scene):
    tracker, pose, rig = scene
    true_body = tracker.body
    poses = [
        moved(true_body, pose, {"left_elbow": 0.06 * k, "right_elbow": 0.09 * k, "root_x": 0.01 * k}) for k in range(16)
    ]
    cells = [cells_of(rig, draw(true_body, each, rig), DEPTH) for each in poses]
    shape = ClipShape.from_body(true_body, "z")
    wrong = np.zeros(shape.num_params, np.float32)
    wrong[shape.names.index("forearm_length")] = 0.12
    tracker = eqx.tree_at(lambda t: t.body, tracker, shape.shaped(jnp.asarray(wrong)))
    reader = Reader.from_tracker(tracker, cells[0].shape[1:3])
    pictures = lambda rows, near: reader.pictures([cells[row] for row in rows], near)
    unknown = np.full(len(poses), np.nan)
    start = np.stack(poses)
    as_of_many = Weights(shape=Weights().shape * len(tracker.normalizers) / MANY_CAMERAS)  # drawn, they err in nothing
    found = adjusted(tracker, pictures, start, np.arange(16), unknown, 30.0, "z", 60, as_of_many)
    assert found.after > found.before
    assert found.params[shape.names.index("forearm_length")] < -0.03
    in_windows = adjusted(tracker, pictures, start, np.arange(16), unknown, 30.0, "z", 13)
    assert in_windows.poses.shape == start.shape
    assert in_windows.after > in_windows.before
    fixed = adjusted(tracker, pictures, start, np.arange(16), unknown, 30.0, "z", 60, with_shape=False)
    assert not fixed.params.any()
    assert found.after > fixed.after > fixed.before


@pytest.mark.slow
def test_a_track_is_adjusted_and_its_actor_learnt(tmp_path):
    settings = SynthSettings("walk", cameras=6, frames=12, width=240, height=180)
    recording = render_recording(settings, tmp_path / "walk")
    out = tmp_path / "run"
    assert main(["track", f"recording={recording}", f"out={out}", "adjust=true", "outputs.rerun=false"]) == 0
    numbers = json.loads((out / "adjustment.json").read_text())
    assert isinstance(numbers["new_colors"], bool)
    assert numbers["energy_after"] > numbers["energy_before"]
    assert numbers["joints_after_mm"] < 1.05 * numbers["joints_before_mm"]
    written = set(json.loads((out / "run.json").read_text())["files"])
    assert {"index.html", "motion.npz", "unadjusted.npz", "actor.yaml", "overlay.mp4", "metrics.json"} <= written
    assert "(adjustment.json)" in (out / "index.html").read_text()
    motion, before = load_motion(out / "motion.npz"), load_motion(out / "unadjusted.npz")
    assert np.abs(motion.pose - before.pose).max() > 1e-3
    assert motion.explained is not None
    assert before.explained is not None
    assert np.median(motion.explained) > np.median(before.explained) - 0.05
    assert json.loads((out / "metrics.json").read_text())["verdicts"]["anna"]["looks_right"]
    actor = load_body(out / "actor.yaml")
    posed = motion_from_poses(actor, motion.pose[:1], motion.fps)
    np.testing.assert_allclose(posed.blob_means[0], motion.blob_means[0], atol=2e-3)
    again = tmp_path / "again"
    assert main(["adjust", f"motion={out}", f"recording={recording}", f"out={again}", "outputs.rerun=false"]) == 0
    assert (again / "motion.npz").is_file()


@pytest.fixture
def tracked(tmp_path, monkeypatch):
    """A recording, a motion that could be of it, and its actor."""
    monkeypatch.chdir(tmp_path)
    recording, actor = trackable(tmp_path / "walk", frames=8), actor_file(tmp_path / "actor.yaml")
    body = load_body(actor)
    motion = motion_from_poses(body, np.zeros((6, body.skeleton.num_dofs), np.float32), 25.0)
    save_motion(tmp_path / "motion.npz", motion)
    return recording, motion, tmp_path


def sentence(capsys, tracked, *words):
    """With which an adjustment is refused; there is no folder of results then."""
    recording, _, folder = tracked
    arguments = [f"recording={recording}", f"out={folder / 'out'}", *words]
    if not any(word.startswith("motion=") for word in words):
        arguments.append(f"motion={folder / 'motion.npz'}")
    found = refused(capsys, "adjust", *arguments)
    assert not (folder / "out").exists()
    return found


def test_a_motion_of_another_recording_is_refused(capsys, tracked):
    _, motion, folder = tracked
    for wrong, words in (
        ({"frame": motion.frame + 5}, ("5 to 10", "0 to 7")),
        ({"fps": 50.0}, ("50 frames per second", "25")),
        ({"up": "y"}, ("vertical is y",)),
    ):
        save_motion(folder / "motion.npz", replace(motion, **wrong))
        found = sentence(capsys, tracked)
        assert all(word in found for word in (*words, "motion.npz", "in which it was tracked"))


def test_a_motion_of_another_body_is_refused(capsys, tracked):
    _, motion, folder = tracked
    found = sentence(capsys, tracked, f"actor={folder / 'nobody.yaml'}")
    assert "nobody.yaml" in found
    save_motion(folder / "motion.npz", replace(motion, blob_means=motion.blob_means + 0.1))
    found = sentence(capsys, tracked)
    assert "is not a motion of" in found
    (folder / "actor.yaml").unlink()
    assert "give actor=FILE" in sentence(capsys, tracked)


def test_a_clip_that_is_too_short_is_left_as_it_was(capsys, tracked):
    _, motion, folder = tracked
    body = load_body(folder / "actor.yaml")
    save_motion(folder / "motion.npz", motion_from_poses(body, motion.pose[:3], 25.0))
    found = sentence(capsys, tracked)
    assert "3 frames" in found
    assert "stays as it is" in found


def test_several_actors_and_empty_folders_are_refused(capsys, tracked):
    _, motion, folder = tracked
    (folder / "run").mkdir()
    assert "holds no motion.npz" in sentence(capsys, tracked, f"motion={folder / 'run'}")
    save_motion(folder / "run" / "motion_anna.npz", motion)
    assert "several actors" in sentence(capsys, tracked, f"motion={folder / 'run'}")


def test_a_window_larger_than_memory_is_refused(capsys, tracked, monkeypatch):
    motion = tracked[1]
    each = bytes_of_frame(2, motion.blob_means.shape[1])
    monkeypatch.setattr(adjust_checks, "available_memory", lambda: 30 * each)
    monkeypatch.setattr(adjust_checks, "bytes_of_frame", lambda *_: 5 * each)
    found = sentence(capsys, tracked, "window=24")
    assert "window=24" in found
    assert "fewer cameras" in found


@pytest.mark.parametrize(("window", "remedy"), [(80, "choose window=40"), (None, "sogjax adjust ... window=40")])
def test_what_fits_into_memory_is_said_with_a_setting_that_the_command_has(monkeypatch, window, remedy):
    monkeypatch.setattr(adjust_checks, "available_memory", lambda: 50 * bytes_of_frame(4, 60))
    adjust_checks.check_window(4, 60, 40, window)
    with pytest.raises(InputError, match=remedy) as found:
        adjust_checks.check_window(4, 60, 400, window)
    assert str(found.value).startswith("adjust=true: " if window is None else "window=80: ")


def test_memory_that_holds_files_counts_as_available(tmp_path):
    (tmp_path / "meminfo").write_text("MemTotal:  24000 kB\nMemFree:    100 kB\nMemAvailable:   7000 kB\n")
    assert available_memory(tmp_path / "meminfo") == 7000 * 1024
    told = available_memory(tmp_path / "none")  # by the C library, which does not count what holds files
    assert told is not None
    assert 0 < told < os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def test_tracking_does_not_begin_where_adjusting_would_not_fit(capsys, tracked, monkeypatch):
    recording, _, folder = tracked
    monkeypatch.setattr(adjust_checks, "available_memory", lambda: 1000)
    words = ["track", f"recording={recording}", f"actor={folder / 'actor.yaml'}", f"out={folder / 'out'}"]
    assert "adjust=true: " in refused(capsys, *words, "adjust=true")
    assert not (folder / "out").exists()


@pytest.mark.parametrize("window", [0, -3])
def test_a_window_without_frames_is_refused(capsys, tracked, window):
    assert f"window={window}" in sentence(capsys, tracked, f"window={window}")
