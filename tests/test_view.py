"""`sogjax view` where its viewer cannot be opened: one sentence, which tells what to do instead."""

import sys

import pytest
from command_line import refused
from motion_cases import walking_motion
from small_recording import make_recording

from sogjax.app import view
from sogjax.app.cli import main
from sogjax.data.motion import save_motion


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
