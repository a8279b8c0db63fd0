"""Members of a sweep: what they share, how far they are apart, and what is said where there is no truth."""

import csv
import runpy
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import refused, trackable
from motion_cases import walking_motion

from sogjax.cli.sweep import run as sweep_run
from sogjax.cli.sweep.results import APART, Failure, Member, distances_to_first, keep_result, kept_results
from sogjax.cli.sweep.tables import finish_sweep
from sogjax.io.motion_data import save_motion
from sogjax.io.recording import open_recording
from sogjax.run.actors import Actors
from sogjax.run.background import Background, learn_background
from sogjax.run.clip import Clip
from sogjax.run.initial_pose import SOURCES, InitialPose, PoseRequest
from sogjax.run.result import COLUMNS, Numbers
from sogjax.run.shared import SHARED, SharedRecords
from sogjax.run.shared_pose import KNOWN, SWEEP_SOURCES, shared
from sogjax.settings.compose import track_config

UNKNOWN = float("nan")


def no_truth():
    return Numbers(dict.fromkeys(COLUMNS, UNKNOWN) | {"similarity": 0.05, "iterations": 3.0, "doubtful": 0})


class Searches(list):
    """The configs of the searches of a recording that were done."""

    def __init__(self, recording):
        self.clip = Clip(recording, recording.frames, 4)

    def initial_pose(self, *words):
        """What a member begins with."""
        config = track_config(words, recording="r")
        return self.source(PoseRequest(self.clip, Background(None), Actors(()), config))


@pytest.fixture
def searches(tmp_path):
    """The configs of the searches that are done, each for another pose."""
    seen = Searches(open_recording(trackable(tmp_path / "two")))

    def search(request):
        seen.append(request.config)
        return InitialPose(4, np.full(3, float(len(seen))), "search")

    seen.source = shared([lambda request: None, search])
    SHARED.forget()
    yield seen
    SHARED.forget()


def test_a_setting_of_energy_or_solver_leaves_the_first_pose(searches):
    words = ("energy.limit_weight=0", "energy.limit_weight=1", "solver=lbfgs", "outputs.bvh=false", "adjust=true")
    assert [searches.initial_pose(word).pose.tolist() for word in words] == [[1.0] * 3] * len(words)
    usual = track_config(recording="r").energy
    assert searches[0].energy == usual  # and not the first member's


@pytest.mark.parametrize(
    "word", ["start=4", "every=2", "cameras=[a,b]", "color.space=rgb", "images.background=none", "body=dog"]
)
def test_what_changes_what_is_seen_changes_the_first_pose(searches, word):
    assert searches.initial_pose().pose.tolist() != searches.initial_pose(word).pose.tolist()


def test_members_ask_every_source_in_its_order():
    alone = [source for source in SOURCES if source in KNOWN]
    assert [source for source in SWEEP_SOURCES if source in KNOWN] == alone
    assert SWEEP_SOURCES[0] is SOURCES[0]
    assert len(SWEEP_SOURCES) == len(alone) + 1  # the others follow each other


@pytest.mark.parametrize(
    ("word", "said"),
    [("energy.limit_weight=0,1", "one initial pose and one actor for all 2 members"), ("start=0,1", "start: changes")],
)
def test_it_is_said_whether_members_share(monkeypatch, capsys, word, said):
    monkeypatch.setattr(sweep_run, "run_hydra", lambda words: 0)
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
        ("start=0,1", ["outputs.overlay=false", "outputs.rerun=false", "outputs.page=false"]),
        ("outputs.overlay=true", []),
        ("outputs.motion_only=true", []),
    ],
)
def test_members_write_pictures_of_every_frame_only_where_these_are_named(monkeypatch, capsys, word, added):
    seen = []
    monkeypatch.setattr(sweep_run, "run_hydra", lambda words: seen.append(words) or 0)
    sweep_run.run_sweep("track", ["recording=r", word])
    assert seen[0][2:] == added
    assert ("no overlay" in capsys.readouterr().err) == bool(added)


def test_the_script_of_a_sweep_leaves_them_out_too(monkeypatch, capsys):
    script, seen = Path(__file__).parents[1] / "experiments" / "track.py", []
    monkeypatch.setattr(sweep_run, "run_hydra", lambda words: seen.append(words) or 0)
    monkeypatch.setattr(sys, "argv", [str(script), "-m", "recording=r", "start=0,1"])
    with pytest.raises(SystemExit) as end:
        runpy.run_path(str(script), run_name="__main__")
    assert end.value.code == 0
    assert "no overlay" in capsys.readouterr().err
    assert seen[0][2:] == ["outputs.overlay=false", "outputs.rerun=false", "outputs.page=false"]


def black_scene(folder):
    """A recording with photographs of the empty scene, all black."""
    recording = open_recording(trackable(folder / "two"))
    plates = {name: folder / f"{name}.png" for name in recording.rig.names}
    for path in plates.values():
        cv2.imwrite(str(path), np.zeros((48, 64, 3), np.uint8))
    return replace(recording, background=plates), plates


def test_photographs_of_the_empty_scene_are_read_once_until_they_change(tmp_path):
    recording, plates = black_scene(tmp_path)
    clip = Clip(recording, recording.frames, 4)
    first = learn_background(clip, "auto")
    assert learn_background(clip, "auto") is first
    cv2.imwrite(str(plates["left"]), np.full((48, 64, 3), 200, np.uint8))
    again = learn_background(clip, "auto")
    assert again is not first
    assert learn_background(clip, "auto") is again


def test_records_are_made_once_by_whatever_thread_and_few_are_held():
    shared, made = SharedRecords(most=2), []

    def make():
        made.append(threading.current_thread())
        time.sleep(0.01)
        return len(made)

    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(lambda _: shared.get("a", make), range(8))) == [1] * 8
    assert [shared.get(key, make) for key in ("b", "a", "c")] == [2, 1, 3]
    assert shared.get("a", make) == 1  # asked for more recently than b
    assert shared.get("b", make) == 4
