"""`import sogjax`: what it offers does what the commands do, without files, and says what is wrong."""

import ast
import os
import subprocess
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
import yaml
from body_cases import posed
from command_line import actor_file
from rendered_person import rendered_person

import sogjax
from sogjax.api import tracking
from sogjax.cli.words import composed
from sogjax.run.recordings import upright
from sogjax.search.found_pose import FoundPose
from sogjax.tracking.culling import Capacities

ROOT = Path(__file__).parents[1]
HEAVY = ("jax", "numpy", "cv2", "rerun", "hydra", "omegaconf", "yaml")
SMALL = {"images": {"depth": 5}}
"""Settings that suit pictures of a few pixels."""


@pytest.fixture(scope="session")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("api") / "walk"
    return sogjax.open_recording(rendered_person(folder, cameras=3, frames=4, width=162, height=122))


@pytest.fixture(scope="session")
def actor(tmp_path_factory):
    return sogjax.load_actor(actor_file(tmp_path_factory.mktemp("api") / "puppet.yaml"))


@pytest.fixture(scope="session")
def motion(recording, actor):
    return sogjax.track(recording, actor, **SMALL)


@pytest.fixture(scope="session")
def tracker(recording, actor):
    return sogjax.make_tracker(recording, actor, **SMALL)


def in_a_process(code, folder, **environment):
    """What a program prints that runs in a folder of its own."""
    command, own = [sys.executable, "-c", code], {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    done = subprocess.run(command, cwd=folder, env=own, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_import_alone_loads_nothing(tmp_path):
    code = f"import sys, sogjax; print([name for name in {HEAVY!r} if name in sys.modules])"
    assert in_a_process(code, tmp_path).strip() == "[]"


def test_every_name_is_there_documented_and_shown_to_type_checkers():
    tree = ast.parse((ROOT / "sogjax" / "__init__.pyi").read_text(encoding="utf-8"))
    shown = {
        alias.name: getattr(import_module(f"sogjax.{entry.module}"), alias.name)
        for entry in tree.body
        if isinstance(entry, ast.ImportFrom)
        for alias in entry.names
    }
    assert sorted(shown) == sorted(sogjax.__all__)
    for name, value in shown.items():
        assert getattr(sogjax, name) is value
        assert len(value.__doc__) > 30
        assert name in dir(sogjax)
    with pytest.raises(AttributeError, match="attribute trakc"):
        _ = sogjax.trakc


def test_the_guide_has_every_name():
    page = (ROOT / "docs" / "guide" / "python.md").read_text(encoding="utf-8")
    assert [name for name in sogjax.__all__ if f"`{name}" not in page] == []


@pytest.mark.slow
def test_the_script_in_the_readme_runs_and_writes_only_what_it_says(tmp_path):
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    script = readme.split("## From Python")[1].split("```python\n")[1].split("```")[0]
    work, scratch = tmp_path / "work", tmp_path / "scratch"
    scratch.mkdir()
    rendered_person(work / "walk", cameras=2, frames=40, width=96, height=72)
    human = (work / "walk" / "initial_pose.yaml").read_text()
    assert "pelvis" in human
    sogjax.save_actor(work / "anna.yaml", sogjax.load_actor("human"))
    printed = in_a_process(f"{script}\nimport sys\nassert 'hydra' not in sys.modules", work, TMPDIR=str(scratch))
    assert "all markers" in printed.splitlines()[1]
    assert printed.splitlines()[-1].startswith("markers are attached") or printed.splitlines()[-1].startswith("lost")
    assert sorted(path.name for path in work.iterdir()) == ["anna.yaml", "walk", "walk.bvh"]
    assert list(scratch.iterdir()) == []


@pytest.mark.parametrize("preset", ["default", "paper"])
def test_settings_are_those_of_the_command(preset):
    assert sogjax.track_settings(preset=preset) == composed("track", ["recording=''", f"preset={preset}"])


def test_settings_come_as_keywords_groups_and_names():
    settings = sogjax.track_settings(stop=40, solver="lbfgs", energy={"limit_weight": 2.0})
    assert settings == composed("track", ["recording=''", "stop=40", "solver=lbfgs", "energy.limit_weight=2.0"])


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({"energy": {"limit_wieght": 1.0}}, "did you mean energy.limit_weight"),
        ({"energy": {"limit_weight": "much"}}, "energy.limit_weight=much: must be a number"),
        ({"energy": {"limit_weight": -1.0}}, "energy.limit_weight=-1.0: must be a number of at least 0"),
        ({"preset": "papre"}, "preset=papre: no such choice; use one of default, paper"),
        ({"solver": "newton"}, "solver=newton: no such choice"),
        ({"out": "results"}, r"out: no file is written; use motion.save"),
        ({"outputs": {"overlay": True}}, "outputs.overlay: no file is written"),
        ({"cameras": ["nowhere"]}, "has no camera nowhere"),
        ({"start": 3, "stop": 2}, "start=3 stop=2"),
    ],
)
def test_wrong_settings_are_refused(recording, actor, settings, sentence):
    for function in (sogjax.track, sogjax.make_tracker):
        with pytest.raises(sogjax.InputError, match=sentence):
            function(recording, actor, **settings)


def test_actors_are_refused_that_are_none_or_the_same(recording, actor):
    for actors, sentence in (([], "the list is empty"), ([actor, actor], "two actors are named 'puppet'")):
        with pytest.raises(sogjax.InputError, match=sentence):
            sogjax.track(recording, actors)


def test_a_first_pose_is_searched_for_in_the_first_frame_to_track(recording, actor, monkeypatch):
    asked = []

    def searched(request):
        bodies, clip = request.actors.bodies, request.clip
        asked.append((clip.recording.rig.names, [body.name for body in bodies], clip.numbers[0]))
        return [FoundPose(body.poses["rest"], 1.0, 0.1, True, 1.0) for body in bodies]

    monkeypatch.setattr(tracking, "searched_poses", searched)
    cameras = recording.rig.names[1:]
    assert sogjax.find_first_pose(recording, actor, start=2, cameras=list(cameras)).margin == 0.1
    two = sogjax.find_first_pose(recording, [actor, replace(actor, name="other")])
    assert len(two) == 2
    assert asked == [(cameras, ["puppet"], 2), (recording.rig.names, ["puppet", "other"], 0)]
    with pytest.raises(sogjax.InputError, match="start=4 stop=null"):
        sogjax.find_first_pose(recording, actor, start=4)


def test_the_points_of_a_motion_are_where_its_poses_put_them(recording, actor, motion):
    for frame, pose in enumerate(motion.pose):
        _, landmarks = posed(upright(actor, recording), jnp.asarray(pose))
        for name, place in zip(actor.landmarks.names, np.asarray(landmarks), strict=True):
            np.testing.assert_allclose(motion.joint(name)[frame], place, atol=1e-6)
    root = motion.pose[:, [motion.dof_names.tolist().index(f"root_{axis}") for axis in "xyz"]]
    np.testing.assert_allclose(motion.joint("root_yaw"), root, atol=1e-6)  # in a world with z up
    assert repr(motion) == "<Motion of puppet: 4 frames at 30 Hz, 6 joints>"


def test_an_unknown_point_is_refused_with_the_nearest(motion):
    with pytest.raises(sogjax.InputError, match=r"no joint or landmark 'left_elbwo'; did you mean left_elbow\?"):
        motion.joint("left_elbwo")
    with pytest.raises(sogjax.InputError, match="'xyz'; it has pelvis, chest"):
        motion.joint("xyz")


@pytest.mark.parametrize("ending", ["npz", "bvh", "trc", "glb", "csv", "c3d"])
def test_a_motion_is_saved_by_the_ending(tmp_path, motion, ending):
    if ending == "c3d":
        pytest.importorskip("ezc3d", reason="the extra `export` is not installed")
    motion.save(tmp_path / f"walk.{ending}")
    assert [path.name for path in tmp_path.iterdir()] == [f"walk.{ending}"]


def test_a_saved_motion_is_the_same_when_loaded(tmp_path, motion):
    motion.save(str(tmp_path / "walk.npz"))
    again = sogjax.load_motion(str(tmp_path / "walk.npz"))
    np.testing.assert_array_equal(again.pose, motion.pose)
    np.testing.assert_array_equal(again.joint("left_elbow"), motion.joint("left_elbow"))


def test_another_ending_is_refused(tmp_path, motion):
    with pytest.raises(sogjax.InputError, match=r"no writer for the extension '\.fbx'"):
        motion.save(tmp_path / "walk.fbx")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_several_motions_come_in_the_order_of_the_actors(tmp_path, recording, actor):
    rough = yaml.safe_load(recording.initial_poses.read_text())
    (tmp_path / "poses.yaml").write_text("".join(yaml.safe_dump({name: rough}) for name in ("zoe", "amy")))
    actors = [replace(actor, name=name) for name in ("zoe", "amy")]
    found = sogjax.track(recording, actors, initial_pose=str(tmp_path / "poses.yaml"), stop=1, **SMALL)
    assert [each.actor for each in found] == ["zoe", "amy"]
    assert [each.actor for each in sogjax.track(recording, [actor], stop=1, **SMALL)] == ["puppet"]


@pytest.mark.slow
def test_the_pure_step_finds_what_track_finds_and_is_compiled_once(recording, tracker, motion):
    traces = []

    def step(tracker, state, cells):
        traces.append(cells.shape)
        return tracker.step(state, cells)

    compiled, state = eqx.filter_jit(step), tracker.start()
    for pose, cells in zip(motion.pose, sogjax.read_cells(recording, tracker), strict=True):
        state, result = compiled(tracker, state, cells)
        np.testing.assert_allclose(result.pose, pose, atol=1e-4)
        assert isinstance(state, sogjax.TrackState)
    assert len(traces) == 1


@pytest.mark.slow
def test_a_pure_step_without_room_is_an_error(recording, tracker):
    cells = next(sogjax.read_cells(recording, tracker))
    with pytest.raises(ValueError, match="no capacities"):
        replace(tracker, capacities=None).step(tracker.start(), cells)
    cramped = replace(tracker, capacities=Capacities(4, 4, 1))
    with pytest.raises((RuntimeError, jax.errors.JaxRuntimeError), match="more image blobs than the tracker has room"):
        jax.block_until_ready(eqx.filter_jit(cramped.step)(tracker.start(), cells))


def test_a_tracker_starts_where_it_is_told(actor, tracker):
    rest = actor.poses["rest"]
    np.testing.assert_array_equal(tracker.start(rest).previous, rest)
    with pytest.raises(ValueError, match="no initial pose"):
        replace(tracker, initial_pose=None).start()


def test_cells_of_other_cameras_or_frames_are_refused(recording, tracker):
    with pytest.raises(sogjax.InputError, match="made for 3 cameras, this recording has 2"):
        sogjax.read_cells(sogjax.open_recording(recording.path, recording.rig.names[:2]), tracker)
    with pytest.raises(sogjax.InputError, match="has the frames 0 to 3"):
        sogjax.read_cells(recording, tracker, stop=5)


def test_evaluation_prints_itself(recording, motion):
    evaluation = sogjax.evaluate(motion, recording)
    truth = sogjax.load_truth(recording.path)
    assert str(evaluation) == evaluation.table(details=False) == str(sogjax.evaluate(motion, truth))
    assert evaluation.markers.errors.shape == (4, len(evaluation.markers.names))
    assert str(sogjax.evaluate([replace(motion, actor="anna")], truth)).startswith("anna")


def test_markers_are_attached_by_the_rule_that_is_named(recording, motion):
    rules = {rule: sogjax.evaluate(motion, recording, markers=rule) for rule in ("scaled", "closest")}
    for rule, evaluation in rules.items():
        assert evaluation.rule == rule
        assert f"by the rule {rule}" in str(evaluation)


def test_what_has_no_truth_is_refused(tmp_path, recording, motion):
    for source in (replace(recording, ground_truth=None), tmp_path, tmp_path / "none.npz"):
        with pytest.raises(sogjax.InputError, match="there is no ground truth"):
            sogjax.evaluate(motion, source)


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        ({}, "no example poses"),
        ({"out": "anna.yaml"}, "make_actor writes no file"),
        ({"symetric": False}, "did you mean symmetric"),
        ({"body": "cat"}, "cat: there is no such file, and no such body"),
    ],
)
def test_actors_that_cannot_be_made_are_refused(recording, settings, sentence):
    with pytest.raises(sogjax.InputError, match=sentence):
        sogjax.make_actor(recording, **settings)


def test_an_actor_is_saved_and_loaded(tmp_path, actor):
    sogjax.save_actor(str(tmp_path / "again.yaml"), actor)
    again = sogjax.load_actor(str(tmp_path / "again.yaml"))
    assert again.skeleton.dof_names == actor.skeleton.dof_names
    np.testing.assert_allclose(again.blobs.offsets, actor.blobs.offsets)


def test_rendered_recordings_are_kept(tmp_path, monkeypatch):
    monkeypatch.setenv("SOGJAX_CACHE", str(tmp_path))
    wanted = {"cameras": 2, "frames": 2, "width": 64, "height": 64, "example_poses": False}
    first = sogjax.render_recording(**wanted)
    again = sogjax.render_recording(**wanted)
    assert first.path == again.path
    assert sogjax.load_truth(first).num_frames == first.num_frames == 2
    with pytest.raises(sogjax.InputError, match="did you mean frames"):
        sogjax.render_recording(frame=2)


def test_a_rerun_file_shows_a_motion(tmp_path, recording, motion):
    sogjax.write_rerun(tmp_path / "walk.rrd", recording, motion)
    with_pictures = (tmp_path / "walk.rrd").stat().st_size
    sogjax.write_rerun(tmp_path / "bare.rrd", recording, [motion], images=False)
    assert with_pictures > (tmp_path / "bare.rrd").stat().st_size > 0


class Ceiling(sogjax.Penalty):
    """Squared heights, in square metres, of the blobs above a plane."""

    height: float = 0.0

    def value(self, posed, frame):
        """Summed over all blobs."""
        return jnp.sum(jnp.maximum(posed.blobs.means[:, 2] - self.height, 0.0) ** 2)


@pytest.mark.slow
def test_a_term_of_ones_own_moves_the_motion(recording, actor, motion):
    middle = float(np.median(motion.blob_means[..., 2]))
    held = sogjax.track(recording, actor, terms=[Ceiling(weight=100.0, height=middle)], **SMALL)
    above = lambda found: np.maximum(found.blob_means[..., 2] - middle, 0.0).sum()
    assert above(held) < 0.7 * above(motion)


def test_two_terms_of_one_name_are_refused(recording, actor):
    with pytest.raises(sogjax.InputError, match="two terms are named 'ceiling'"):
        sogjax.track(recording, actor, terms=[Ceiling(weight=1.0), Ceiling(weight=2.0)], **SMALL)
