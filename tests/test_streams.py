"""Files that grow with a run: where it ends early they are readable or absent, and no thread stays."""

import threading
from dataclasses import fields

import numpy as np
import pytest
from command_line import actor_file, interrupt_at, trackable
from slow_values import fast_and_slow

from sogjax.cli.main import main
from sogjax.errors import InputError
from sogjax.io.frame_motions import load_one_motion
from sogjax.io.motion import Motion, load_motion
from sogjax.io.source import look_at_source
from sogjax.run import clip
from sogjax.view.overlay import OverlayVideo

FRAMES, LAST_GOOD = 14, 10


@pytest.fixture
def command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recording = trackable(tmp_path / "walk", frames=FRAMES)
    words = ["images.depth=4", "solver.max_iterations=2", "solver.min_iterations=1", "outputs.overlay_width=128"]
    words.append("tracking.both_ways=false")  # or files that show frames are written at the end
    return ["track", f"recording={recording}", f"actor={actor_file(tmp_path / 'a.yaml')}", *words]


def interrupt_the_step(monkeypatch):
    """Ctrl-C."""
    interrupt_at(monkeypatch, LAST_GOOD)
    return 130


def break_a_video(monkeypatch):
    """An error in a decoding thread."""
    whole, calls = clip.padded_cells, []

    def padded_cells(*arguments):
        calls.append(1)
        if len(calls) > 2 * LAST_GOOD:
            raise InputError("right.mp4: ends early")
        return whole(*arguments)

    monkeypatch.setattr(clip, "padded_cells", padded_cells)
    return 2


def fill_the_disk(monkeypatch):
    """An error in the writing thread, in its second block."""
    whole, calls = OverlayVideo.write, []

    def write(*arguments):
        calls.append(1)
        if len(calls) == 2:
            raise InputError("overlay.mp4: could not be written (No space left on device)")
        whole(*arguments)

    monkeypatch.setattr(OverlayVideo, "write", write)
    return 2


@pytest.mark.parametrize("trouble", fast_and_slow(break_a_video, interrupt_the_step, fill_the_disk))
def test_an_early_end_leaves_the_motion_so_far(capsys, tmp_path, monkeypatch, command, trouble):
    assert main([*command, "out=whole", "outputs.overlay=false", "outputs.rerun=false", "outputs.page=false"]) == 0
    capsys.readouterr()
    threads = set(threading.enumerate())
    status = trouble(monkeypatch)
    assert main([*command, "out=run"]) == status
    assert set(threading.enumerate()) == threads
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["run.partial"]
    so_far, complete = load_one_motion(tmp_path / "run" / "run.partial"), load_motion(tmp_path / "whole" / "motion.npz")
    assert so_far.num_frames >= 10
    np.testing.assert_array_equal(so_far.pose, complete.pose[: so_far.num_frames])
    err = capsys.readouterr().err
    assert f"stopped after {so_far.num_frames} frames; their motion is in run/run.partial" in err
    assert "Traceback" not in err

    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    assert main([*command, "out=run", "resume=true"]) == 0
    assert_resumed(tmp_path / "run", complete)


def assert_resumed(folder, whole):
    """The end of the run is that of one that was never stopped, and its video and Rerun file show every frame."""
    again = load_motion(folder / "motion.npz")
    for entry in fields(Motion):
        np.testing.assert_array_equal(getattr(again, entry.name), getattr(whole, entry.name), entry.name)
    names = ["config.yaml", "index.html", "metrics.json", "motion.bvh", "motion.npz", "motion.rrd", "overlay.mp4"]
    names += ["run.json", "worst.png"]
    assert sorted(path.name for path in folder.iterdir()) == names
    assert look_at_source(folder / "overlay.mp4").num_frames == FRAMES


def test_an_error_in_the_first_frame_leaves_nothing(capsys, tmp_path, monkeypatch, command):
    def padded_cells(*arguments):
        raise InputError("right.mp4: ends early")

    monkeypatch.setattr(clip, "padded_cells", padded_cells)
    assert main([*command, "out=run", "images.background=none"]) == 2
    assert capsys.readouterr().err == "sogjax: right.mp4: ends early\n"
    assert not (tmp_path / "run").exists()
