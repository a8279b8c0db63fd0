"""The commands end to end on a tiny recording, their help, and their exit statuses."""

import gc
import json
import re
import subprocess
import sys
from keyword import iskeyword

import numpy as np
import pytest
import yaml
from command_line import actor_file, done, refused, trackable
from rendered_person import rendered_person
from small_recording import write_video

from sogjax.cli.main import RARELY, main, run_process
from sogjax.cli.schemas import SCHEMAS
from sogjax.cli.words import composed
from sogjax.io.motion import load_motion
from sogjax.settings.option import help_lines

FAST = ("solver.max_iterations=20", "images.depth=6")


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    """A rendered person, four cameras, four frames; its rough pose has the landmarks of the small actor."""
    folder = tmp_path_factory.mktemp("rendered") / "person"
    return rendered_person(folder, cameras=4, frames=4, width=160, height=120)


def test_from_a_recording_to_motion_and_pictures(capsys, tmp_path, monkeypatch, rendered, plain_logging):
    monkeypatch.chdir(tmp_path)
    actor = actor_file(tmp_path / "actor.yaml")
    track = ("track", f"recording={rendered}", f"actor={actor}", *FAST)

    out, _ = done(capsys, *track, "out=run", "start=1", "outputs.overlay_width=320", "outputs.formats=[trc,glb]")
    formats = ["motion.bvh", "motion.glb", "motion.npz", "motion.rrd", "motion.trc"]
    names = ["config.yaml", "index.html", "metrics.json", *formats, "overlay.mp4", "worst.png"]
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == sorted([*names, "run.json"])
    assert all((tmp_path / "run" / name).stat().st_size > 0 for name in names)
    for name in names:
        assert f"run/{name}" in out
    assert "all markers" in out
    assert re.search(r"^tracking step +[0-9.]+ frames/s$", out, re.MULTILINE)

    motion = load_motion(tmp_path / "run" / "motion.npz")
    np.testing.assert_array_equal(motion.frame, [1, 2, 3])
    metrics = json.loads((tmp_path / "run" / "metrics.json").read_text())
    printed = float(re.search(r"all markers +([0-9.]+)", out)[1])
    assert metrics["all"]["mean_mm"] == pytest.approx(printed, abs=0.06)
    assert 0.0 < metrics["verdicts"]["puppet"]["explained"] <= 1.0
    assert len(metrics["verdicts"]["puppet"]["worst"]) == 3

    again, _ = done(capsys, "evaluate", "motion=run/motion.npz", f"truth={rendered / 'ground_truth.npz'}", "out=e.json")
    assert f"all markers{printed:21.1f}" in again
    assert done(capsys, "evaluate", "motion=run/motion.npz", f"truth={rendered}")[0] == again.removesuffix("e.json\n")
    sentence = refused(capsys, "evaluate", "motion=run/motion.npz", "truth=run")
    assert "truth=run: this folder holds no ground_truth.npz" in sentence
    formats = ("outputs.overlay_width=320", "outputs.formats=[trc,glb]")
    ended, _ = done(capsys, *track, "out=run", "start=1", *formats, "resume=true")
    titles = [re.search(r"^(\w+) +mean ", text, re.MULTILINE) for text in (out, again, ended)]
    assert [title and title[1] for title in titles] == ["puppet"] * 3
    assert json.loads((tmp_path / "e.json").read_text())["all"] == metrics["all"]

    done(capsys, "export", "motion=run/motion.npz", "to=walk.bvh")
    assert (tmp_path / "walk.bvh").read_bytes() == (tmp_path / "run" / "motion.bvh").read_bytes()
    done(capsys, "view", "motion=run/motion.npz", f"recording={rendered}", "out=walk.rrd")
    assert (tmp_path / "walk.rrd").stat().st_size > 10_000

    kept = yaml.safe_load((tmp_path / "run" / "config.yaml").read_text())
    assert kept["solver"]["max_iterations"] == 20
    assert kept["start"] == 1

    light = ("outputs.overlay=false", "outputs.rerun=false", "outputs.page=false", "stop=3")
    table, _ = done(capsys, *track, "-m", "energy.limit_weight=0,1", *light)
    rows = [line for line in table.splitlines() if line.startswith("energy.limit_weight=")]
    assert [row.split()[0] for row in rows] == ["energy.limit_weight=0", "energy.limit_weight=1"]
    assert all(np.isfinite([float(value) for value in row.split()[-8:-5]]).all() for row in rows)
    assert len(list((tmp_path / "multirun").glob("*/*/motion.npz"))) == 2


@pytest.mark.slow
def test_one_member_of_a_sweep_fails_and_the_others_go_on(capsys, tmp_path, monkeypatch, rendered, plain_logging):
    monkeypatch.chdir(tmp_path)
    light = ("outputs.overlay=false", "outputs.rerun=false", "outputs.page=false", "outputs.bvh=false", "start=3")
    actor = f"actor={actor_file(tmp_path / 'actor.yaml')}"
    status = main(["track", "-m", f"recording={rendered}", actor, *FAST, *light, "stop=9,4"])
    out, err = capsys.readouterr()
    assert status == 2
    assert "settings" in out, err
    failed, worked = (line for line in out.splitlines() if line.startswith("stop="))
    assert "stop=9" in failed
    assert "failed" in failed
    assert "stop=4" in worked
    assert err.splitlines()[-1].startswith("sogjax: start=3 stop=9")


@pytest.mark.slow
def test_videos_of_different_length(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recording = trackable(tmp_path / "walk")
    write_video(recording / "videos" / "right.mp4", 1, frames=2)
    light = ("outputs.overlay=false", "outputs.rerun=false", "outputs.page=false")
    _, err = done(capsys, "track", f"recording={recording}", f"actor={actor_file(tmp_path / 'a.yaml')}", *FAST, *light)
    assert "left 4" in err
    assert "right 2" in err
    assert load_motion(tmp_path / "outputs" / "walk" / "motion.npz").num_frames == 2


@pytest.mark.parametrize("command", SCHEMAS)
def test_help_lists_every_option_with_its_default(capsys, command):
    usual, _ = done(capsys, command, "--help")
    out, err = done(capsys, command, "--help", "all")
    assert (out, err) == done(capsys, command, "--help=all")
    for key, default, text, expert in help_lines(SCHEMAS[command]):
        assert f"  {key}={default}\n" in out
        assert (f"  {key}={default}\n" in usual) != expert
        assert text
    assert all(len(line) < 120 for line in out.splitlines())
    hidden = sum(line.expert for line in help_lines(SCHEMAS[command]))
    assert (f"sogjax {command} --help all lists {hidden} more" in usual) == (hidden > 0)
    assert sum(re.match(r"  [\w.]+=", line) is not None for line in usual.splitlines()) <= 25 + 5  # and sets of options


def test_help_of_the_whole_names_every_command(capsys):
    out, _ = done(capsys, "--help")
    for command in SCHEMAS:
        assert re.search(rf"^  {command} +\w+", out, re.MULTILINE)
    assert main([]) == 2


@pytest.mark.parametrize("command", SCHEMAS)
def test_defaults_in_the_help_are_the_defaults_of_the_command(command):
    required = [f"{key}=x.bvh" for key, default, *_ in help_lines(SCHEMAS[command]) if default == "required"]
    config = composed(command, required)
    for key, default, *_ in help_lines(SCHEMAS[command]):
        value = config
        for part in key.split("."):
            value = getattr(value, f"{part}_" if iskeyword(part) else part)
        assert default in ("required", "null" if value is None else str(value))


def test_an_unknown_command(capsys):
    assert "track" in refused(capsys, "trak")


def test_exit_status_of_the_program(tmp_path):
    run = lambda *words: subprocess.run(
        [sys.executable, "-m", "sogjax", *words], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    wrong = run("track", "recording=nowhere")
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert wrong.stderr == "sogjax: nowhere: there is no such folder; give the folder of a recording\n"
    assert run("--version").returncode == 0


def test_a_process_looks_at_all_its_garbage_rarely_and_not_when_it_ends(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["sogjax", "trak"])
    before = gc.get_threshold()
    try:
        assert run_process() == 2
        if sys.version_info < (3, 14):  # later ones have no oldest generation of their own
            assert gc.get_threshold() == (*before[:2], RARELY)
        assert gc.get_freeze_count() > 0
    finally:
        gc.unfreeze()
        gc.set_threshold(*before)
    assert "trak" in capsys.readouterr().err
