"""Members of a sweep: what they share, how far they are apart, and what is said where there is no truth."""

import csv
import runpy
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import jax.numpy as jnp
import numpy as np
import pytest
from command_line import refused, trackable
from motion_cases import walking_motion

from sogjax.cli.sweep import run as sweep_run
from sogjax.cli.sweep.results import APART, Failure, Member, distances_to_first, finish_sweep, keep_result, kept_results
from sogjax.io.motion import save_motion
from sogjax.io.recording import open_recording
from sogjax.run import background, build, shared_start
from sogjax.run.run_numbers import COLUMNS, Numbers
from sogjax.run.shared_start import forget_shared_openings, shared_opening
from sogjax.settings.compose import track_config
from sogjax.settings.method import ImagesConfig

UNKNOWN = float("nan")


def no_truth():
    return Numbers(dict.fromkeys(COLUMNS, UNKNOWN) | {"similarity": 0.05, "iterations": 3.0, "doubtful": 0})


class Searches(list):
    """The configs of the searches of a recording that were done."""

    def __init__(self, recording):
        self.recording = recording

    def opening(self, *words):
        """What a member begins with."""
        return shared_opening(self.recording, [], track_config(words, recording="r"))


@pytest.fixture
def searches(monkeypatch, tmp_path):
    """The configs of the searches that are done, each for another pose."""
    seen = Searches(open_recording(trackable(tmp_path / "two")))

    def search(recording, bodies, config, frame):
        seen.append(config)
        return [jnp.full(3, float(len(seen)))]

    monkeypatch.setattr(shared_start, "first_poses", search)
    monkeypatch.setattr(shared_start, "initial_pose_file", lambda *_: None)
    monkeypatch.setattr(shared_start, "frame_range", lambda *_: (4, 9))
    forget_shared_openings()
    yield seen
    forget_shared_openings()


def test_a_setting_of_energy_or_solver_leaves_the_first_pose(searches):
    found = [searches.opening(word) for word in ("energy.limit_weight=0", "energy.limit_weight=1", "solver=lbfgs")]
    assert [pose.tolist() for pose, _ in found] == [[1.0] * 3] * 3
    assert found[0][1] == 4
    usual = track_config(recording="r").energy
    assert searches[0].energy == usual  # and not the first member's


@pytest.mark.parametrize("word", ["start=4", "cameras=[a,b]", "color.space=rgb", "images.background=none", "body=dog"])
def test_what_changes_what_is_seen_changes_the_first_pose(searches, word):
    assert searches.opening()[0].tolist() != searches.opening(word)[0].tolist()


@pytest.mark.parametrize(
    ("word", "said"),
    [("energy.limit_weight=0,1", "one first pose and one actor for all 2 members"), ("start=0,1", "start: changes")],
)
def test_it_is_said_whether_members_share(monkeypatch, capsys, word, said):
    monkeypatch.setattr(sweep_run, "run_hydra", lambda task: 0)
    sweep_run.run_sweep("track", ["recording=r", word])
    assert said in capsys.readouterr().err


def test_the_distance_to_the_first_member(tmp_path):
    motion = walking_motion(num_frames=6)
    moved = replace(motion, world_from_joint=motion.world_from_joint.copy())
    moved.world_from_joint[..., 0, 3] += 0.02
    later = walking_motion(num_frames=3, first_frame=50)
    folders = []
    for number, each in enumerate((motion, moved, later)):
        folders.append(tmp_path / str(number))
        save_motion(folders[-1] / "motion.npz", each)
    distances = distances_to_first([None, *folders])
    np.testing.assert_allclose(distances, [UNKNOWN, 0.0, 20.0, UNKNOWN], atol=1e-3)


def test_without_truth_there_are_table_csv_and_picture_of_what_is_known(tmp_path, capsys):
    motion = walking_motion(num_frames=4)
    for number in range(2):
        keep_result(tmp_path / str(number), Member([f"stop={number}"], no_truth()))
        save_motion(tmp_path / str(number) / "motion.npz", motion)
    finish_sweep(tmp_path, kept_results(tmp_path))
    out = capsys.readouterr().out
    assert "nan" not in out
    assert "similarity" in out
    assert "mean mm" not in out
    assert (tmp_path / "sweep.png").is_file()
    rows = list(csv.DictReader((tmp_path / "sweep.csv").read_text().splitlines()))
    assert [float(row[APART]) for row in rows] == [0.0, 0.0]


@pytest.mark.parametrize(("result", "why"), [(Failure("full"), "no member worked"), (no_truth(), "no truth")])
def test_where_there_is_no_picture_the_reason_is_said(tmp_path, capsys, result, why):
    finish_sweep(tmp_path, [Member(["a=1"], result), Member(["a=2"], result)])
    assert f"no sweep.png: {why}" in capsys.readouterr().err.replace("there is ", "")
    assert not (tmp_path / "sweep.png").exists()


def test_a_report_looks_for_the_truth_before_anything_else(capsys, tmp_path):
    recording = trackable(tmp_path / "two")
    assert "ground_truth.npz" in refused(
        capsys, "report", f"recordings=[{recording}]", f"out={tmp_path / 'report'}", "only=[limit_weight]"
    )
    assert not (tmp_path / "report").exists()


@pytest.mark.parametrize(
    ("word", "added"),
    [
        ("start=0,1", ["outputs.overlay=false", "outputs.rerun=false"]),
        ("outputs.overlay=true", []),
        ("outputs.motion_only=true", []),
    ],
)
def test_members_write_pictures_of_every_frame_only_where_these_are_named(monkeypatch, capsys, word, added):
    seen = []
    monkeypatch.setattr(sweep_run, "run_hydra", lambda task: seen.append(sweep_run.sys.argv) or 0)
    sweep_run.run_sweep("track", ["recording=r", word])
    assert seen[0][4:] == added
    assert ("no overlay" in capsys.readouterr().err) == bool(added)


def test_the_script_of_a_sweep_leaves_them_out_too(monkeypatch, capsys):
    script, seen = Path(__file__).parents[1] / "experiments" / "track.py", []
    monkeypatch.setattr(sweep_run, "run_hydra", lambda task: seen.append(sweep_run.sys.argv) or 0)
    monkeypatch.setattr(sys, "argv", [str(script), "-m", "recording=r", "start=0,1"])
    with pytest.raises(SystemExit) as end:
        runpy.run_path(str(script), run_name="__main__")
    assert end.value.code == 0
    assert "no overlay" in capsys.readouterr().err
    assert seen[0][4:] == ["outputs.overlay=false", "outputs.rerun=false"]


def black_scene(folder):
    """A recording with photographs of the empty scene, all black."""
    recording = open_recording(trackable(folder / "two"))
    plates = {name: folder / f"{name}.png" for name in recording.rig.names}
    for path in plates.values():
        cv2.imwrite(str(path), np.zeros((48, 64, 3), np.uint8))
    return replace(recording, background=plates), plates


def test_the_background_is_cut_into_cells_once_until_its_files_change(tmp_path):
    (recording, plates), images = black_scene(tmp_path), ImagesConfig()
    grids = build.cell_grids(recording, images.depth)
    first = background.background_cells(recording, grids, images)
    assert background.background_cells(recording, grids, images) is first
    assert background.background_cells(recording, build.cell_grids(recording, 4), images).colors.shape != (
        first.colors.shape
    )
    cv2.imwrite(str(plates["left"]), np.full((48, 64, 3), 200, np.uint8))
    changed = background.background_cells(recording, grids, images)
    assert int(changed.colors[0].max()) == 200
    assert int(changed.colors[1].max()) == 0


class Shared(dict):
    """What other threads throw out as soon as it is there: they are named still, and gone already."""

    def __setitem__(self, key, value):
        pass

    def __iter__(self):
        return iter(["first", "second", "third"])


def test_members_that_share_a_background_do_not_throw_out_what_another_uses(monkeypatch, tmp_path):
    monkeypatch.setattr(background, "_cut", Shared())
    (recording, _), images = black_scene(tmp_path), ImagesConfig()
    found = background.background_cells(recording, build.cell_grids(recording, images.depth), images)
    assert int(found.colors.max()) == 0
