"""`sogjax view` where its viewer cannot be opened: one sentence, which tells what to do instead."""

import sys

import cv2
import numpy as np
import pytest
from command_line import done, refused
from motion_cases import walking_motion
from small_recording import make_recording

from sogjax.cli import view
from sogjax.cli.main import main
from sogjax.io.motion_data import save_motion


@pytest.fixture
def words(tmp_path):
    save_motion(tmp_path / "motion.npz", walking_motion(4))
    return ["view", f"motion={tmp_path / 'motion.npz'}", f"recording={make_recording(tmp_path / 'two')}"]


def test_without_a_display_nothing_is_begun(capfd, monkeypatch, words):
    for name in view.DISPLAYS:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(view.sys, "platform", "linux")
    monkeypatch.setattr(view, "opened", lambda *_: pytest.fail("begun"))
    assert "out=FILE.rrd" in refused(capfd, *words)


@pytest.mark.parametrize("last", ["Error: no graphics", ""])
def test_a_viewer_that_fails_says_nothing_itself(capfd, monkeypatch, words, last):
    monkeypatch.setenv("DISPLAY", ":0")
    program = f"import sys; print('INFO listening\\n' if {last!r} else '', file=sys.stderr); sys.exit({last!r} or 1)"
    monkeypatch.setattr(view, "view_command", lambda path: [sys.executable, "-c", program])
    assert main(words) == 2
    out, err = capfd.readouterr()
    assert out.strip().endswith("motion.rrd")
    (sentence,) = err.splitlines()
    assert sentence.startswith(f"sogjax: the Rerun viewer could not be opened on {out.strip()}")
    assert (f"({last})" in sentence) == bool(last)
    assert "out=FILE.rrd" in sentence


def test_a_picture_where_rerun_cannot_draw(capsys, monkeypatch, tmp_path, words):
    monkeypatch.setattr(view, "rerun_screenshot", lambda path: None)
    out = tmp_path / "picture.png"
    _, said = done(capsys, *words, f"out={out}", "frame=2")
    assert "overlay" in said
    picture = cv2.imread(str(out))
    assert picture.shape[1] > picture.shape[0]
    _, said = done(capsys, *words, f"out={tmp_path / 'bare.png'}", "images=false")
    assert cv2.imread(str(tmp_path / "bare.png")) is not None


def test_a_picture_is_what_rerun_drew_of_that_frame(capsys, monkeypatch, tmp_path, words):
    drawn = np.random.default_rng(0).integers(0, 255, (40, 60, 3), np.uint8)
    seen = []
    monkeypatch.setattr(view, "rerun_screenshot", lambda path: drawn)
    monkeypatch.setattr(view, "write_rerun", lambda path, recording, motions, frames: seen.append((motions, frames)))
    done(capsys, *words, f"out={tmp_path / 'picture.png'}", "frame=2")
    ((motions, frames),) = seen
    assert [motion.frame.tolist() for motion in motions] == [[2]]
    assert len(frames) == 1
    np.testing.assert_array_equal(cv2.imread(str(tmp_path / "picture.png")), drawn)


def test_a_frame_that_is_not_there_and_one_of_a_whole_file_are_refused(capsys, tmp_path, words):
    assert "frames 0 to 3" in refused(capsys, *words, f"out={tmp_path / 'picture.png'}", "frame=9")
    assert "only a picture" in refused(capsys, *words, f"out={tmp_path / 'motion.rrd'}", "frame=2")
