"""Nothing is overwritten unasked, no two runs share a folder, nothing of an older run is left."""

import json
import subprocess
import sys

import numpy as np
import pytest
from body_cases import shipped
from command_line import actor_file, done, refused, trackable
from motion_cases import walking_motion
from small_recording import snapshot

from sogjax.errors import InputError
from sogjax.io.motion import load_motion
from sogjax.io.motion_data import save_motion
from sogjax.run.actors import Actors
from sogjax.run.background import Background
from sogjax.run.initial_pose import InitialPose
from sogjax.run.relearn_background import RelearntBackground
from sogjax.run.remake_actors import RemadeActors
from sogjax.run.run_files import NOTE
from sogjax.run.run_folder import LOCK, run_folder

SMALL = (
    *("images.depth=4", "solver.max_iterations=2", "solver.min_iterations=1"),
    *("outputs.overlay=false", "outputs.rerun=false", "outputs.page=false"),
)


@pytest.fixture
def command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recording = trackable(tmp_path / "walk")
    return ["track", f"recording={recording}", f"actor={actor_file(tmp_path / 'a.yaml')}", *SMALL, "out=run"]


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_results_stay_unless_they_are_to_be_overwritten(capsys, tmp_path, command):
    done(capsys, *command)
    before = contents(tmp_path / "run")
    sentence = refused(capsys, *command, "stop=2")
    for word in ("run", "metrics.json", "out=DIR", "overwrite=true"):
        assert word in sentence
    assert contents(tmp_path / "run") == before
    done(capsys, *command, "stop=2", "overwrite=true")
    assert load_motion(tmp_path / "run" / "motion.npz").num_frames == 2


def test_a_recording_is_no_place_for_results(capsys, tmp_path, command):
    before = snapshot(tmp_path / "walk")
    sentence = refused(capsys, *command[:-1], f"out={tmp_path / 'walk'}", "overwrite=true")
    assert f"out={tmp_path / 'walk' / 'results'}" in sentence
    assert snapshot(tmp_path / "walk") == before


def test_nothing_of_an_older_run_is_left_but_what_is_not_its_own(capsys, tmp_path, command):
    done(capsys, *command)
    run = tmp_path / "run"
    of_adjusting = ("unadjusted.npz", "unadjusted_actor.yaml", "adjustment.json", "calibration_adjusted.toml")
    half_written = (".motion.0123abcd.tmp.npz", ".unadjusted_actor.0123abcd.tmp.yaml", ".adjustment.89abcdef.tmp.json")
    older = ("notes.txt", "overlay.mp4", "metrics.json", "motion_anna.npz", *of_adjusting, *half_written)
    for name in older:
        (run / name).write_text("older")
    note = json.loads((run / "run.json").read_text())
    (run / "run.json").write_text(json.dumps(note | {"files": [*note["files"], "motion_anna.npz"]}))
    for name in ("motion_notes.csv", "motion_before.c3d"):
        (run / name).write_text("the user's own")
    (run / "motion_anna.partial").mkdir()
    done(capsys, *command, "outputs.bvh=false", "overwrite=true")
    assert sorted(contents(run)) == [
        *("config.yaml", "metrics.json", "motion.npz", "motion_before.c3d", "motion_notes.csv", "notes.txt"),
        *("run.json", "worst.png"),
    ]


def test_an_actor_that_an_older_run_made_and_this_one_reads(capsys, tmp_path, command):
    """Its folder may be the one that is overwritten."""
    done(capsys, *command)
    run = tmp_path / "run"
    note = run / "run.json"
    note.write_text(note.read_text().replace('"files": [', '"files": [\n"actor.yaml",'))
    actor_file(run / "actor.yaml")
    done(capsys, *(word for word in command if not word.startswith("actor=")), "actor=run/actor.yaml", "overwrite=true")
    assert (run / "actor.yaml").is_file()
    note.write_text(note.read_text().replace('"files": [', '"files": [\n"actor.yaml",'))
    done(capsys, *command, "overwrite=true")
    assert not (run / "actor.yaml").exists()


def test_names_in_a_note_lead_nowhere_else(capsys, tmp_path, command):
    done(capsys, *command)
    (tmp_path / "mine.txt").write_text("mine")
    note = tmp_path / "run" / "run.json"
    note.write_text(note.read_text().replace('"files": [', '"files": [\n"../mine.txt", 3,'))
    done(capsys, *command, "overwrite=true")
    assert (tmp_path / "mine.txt").read_text() == "mine"


def test_two_runs_in_one_folder(capsys, tmp_path, command):
    with run_folder(tmp_path / "run"):
        sentence = refused(capsys, *command)
        assert "another run (process " in sentence
    done(capsys, *command)


@pytest.mark.slow
def test_the_lock_of_a_killed_process_blocks_nobody(capsys, tmp_path, command):
    """Another process holds it first, then is killed; the file stays."""
    hold = f"""
import time
from pathlib import Path
from sogjax.run.run_folder import run_folder
with run_folder(Path({str(tmp_path / "run")!r})):
    print("held", flush=True)
    time.sleep(600)
"""
    process = subprocess.Popen([sys.executable, "-c", hold], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "held\n"
    assert f"process {process.pid}" in refused(capsys, *command)
    process.kill()
    process.communicate()
    assert (tmp_path / "run" / LOCK).exists()
    done(capsys, *command)
    assert not (tmp_path / "run" / LOCK).exists()


def test_resume_and_overwrite_exclude_each_other(capsys, tmp_path, command):
    assert "exclude each other" in refused(capsys, *command, "resume=true", "overwrite=true")


def test_results_without_what_a_run_needs_to_go_on(capsys, tmp_path, command):
    done(capsys, *command)
    (tmp_path / "run" / "run.json").unlink()
    assert "overwrite=true instead of resume=true" in refused(capsys, *command, "resume=true")


def test_a_command_replaces_its_own_results_only(tmp_path):
    with run_folder(tmp_path / "run") as folder:
        folder.begin("demo", {})
        folder.finish("demo", {}, [])
    with run_folder(tmp_path / "run", command="demo") as folder:
        folder.begin("demo", {})
    with pytest.raises(InputError, match="resume=true to resume it"), run_folder(tmp_path / "run", command="track"):
        pass
    with run_folder(tmp_path / "run", command="demo"):
        pass


def test_files_of_the_other_commands(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save_motion(tmp_path / "motion.npz", walking_motion(4))
    for name in ("walk.bvh", "walk.rrd"):
        (tmp_path / name).write_text("mine")
    for command in (
        ("export", "motion=motion.npz", "to=walk.bvh"),
        ("body", "from=other.bvh", "out=walk.bvh"),
        ("evaluate", "motion=motion.npz", "truth=t.npz", "out=walk.bvh"),
        ("view", "motion=motion.npz", "recording=walk", "out=walk.rrd"),
    ):
        sentence = refused(capsys, *command)
        assert f"{command[-1].partition('=')[2]}: already exists" in sentence
        assert "overwrite=true" in sentence
    assert (tmp_path / "walk.bvh").read_text() == "mine"
    done(capsys, "export", "motion=motion.npz", "to=walk.bvh", "overwrite=true")
    assert (tmp_path / "walk.bvh").read_text().startswith("HIERARCHY")


def test_an_actor_file_that_is_there(capsys, tmp_path):
    recording = trackable(tmp_path / "walk")
    (tmp_path / "a.yaml").write_text("mine")
    assert "already exists" in refused(capsys, "actor", f"recording={recording}", f"out={tmp_path / 'a.yaml'}")
    assert (tmp_path / "a.yaml").read_text() == "mine"


@pytest.mark.slow
def test_a_rendered_recording_is_replaced_as_a_whole(capsys, tmp_path):
    words = ("synth", f"out={tmp_path / 'r'}", "cameras=1", "frames=1", "width=64", "height=64", "noise=0")
    done(capsys, *words)
    assert "overwrite=true" in refused(capsys, *words)
    done(capsys, *words, "frames=2", "overwrite=true")
    assert [path.name for path in tmp_path.iterdir()] == ["r"]
    (tmp_path / "r" / "actor.yaml").write_text("mine")
    assert "actor.yaml" in refused(capsys, *words, "overwrite=true")
    assert (tmp_path / "r" / "actor.yaml").read_text() == "mine"


@pytest.mark.parametrize("name", ["..", ".", "../precious.txt", "clips", "/etc/hostname"])
def test_a_note_that_names_what_is_no_result_removes_nothing(tmp_path, name):
    out = tmp_path / "work" / "out"
    (out / "clips").mkdir(parents=True)
    (out / "clips" / "left.mp4").write_text("a video")
    (tmp_path / "work" / "precious.txt").write_text("keep")
    NOTE.of(out).write_text(json.dumps({"command": "track", "files": [name]}))
    with run_folder(out, overwrite=True) as folder:
        folder.begin("track", {})
    assert (tmp_path / "work" / "precious.txt").read_text() == "keep"
    assert (out / "clips" / "left.mp4").is_file()


@pytest.mark.parametrize(
    "record",
    [
        Actors((shipped("dog"),)),
        InitialPose(0, np.zeros(3, np.float32), "given"),
        Background(None),
        RelearntBackground(None),
        RemadeActors(),
    ],
)
def test_a_run_that_begins_anew_finds_no_record_of_an_earlier_one(tmp_path, record):
    with run_folder(tmp_path / "run") as folder:
        folder.begin("track", {"of": "one"})
        record.save(folder.kept)
        assert type(record).load(folder.kept) is not None
    with run_folder(tmp_path / "run", overwrite=True) as folder:
        folder.begin("track", {"of": "another"})
        assert type(record).load(folder.kept) is None


def test_folders_of_the_user_inside_of_an_unfinished_run_stay(tmp_path):
    mine = [tmp_path / name / "mine" / "notes.txt" for name in ("run.partial", "motion.partial")]
    for notes in mine:
        notes.parent.mkdir(parents=True)
        notes.write_text("keep")
    with run_folder(tmp_path, overwrite=True) as folder:
        folder.begin("track", {})
        folder.clear()
        assert all(notes.is_file() for notes in mine)


def test_one_person_under_two_names_is_refused(capsys, tmp_path, command):
    text = (tmp_path / "a.yaml").read_text()
    assert "name: puppet\n" in text
    (tmp_path / "b.yaml").write_text(text.replace("name: puppet\n", "name: ben\n"))
    words = [word for word in command if not word.startswith("actor=")]
    assert "same actor" in refused(capsys, *words, f"actor=[{tmp_path / 'a.yaml'},{tmp_path / 'b.yaml'}]")
    assert not (tmp_path / "run").exists()
