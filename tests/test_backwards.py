"""A track that begins in the middle of a clip and goes both ways."""

import numpy as np
import pytest
from command_line import actor_file, done, trackable
from test_resume import LIGHT, SMALL, assert_same, stop_after

from sogjax.cli.main import main
from sogjax.io.motion import load_motion
from sogjax.io.recording import open_recording
from sogjax.run import clip, passes
from sogjax.run.clip import Clip
from sogjax.run.initial_pose import InitialPose

FRAMES, BEGIN = 20, 11


@pytest.fixture
def recording(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return trackable(tmp_path / "walk", frames=FRAMES)


def test_frames_come_backwards(recording, tmp_path, monkeypatch):
    """Block by block from the videos, or from kept cells; the same as forwards, turned round."""
    monkeypatch.setattr(clip, "BLOCK", 3)
    opened = open_recording(recording)
    plain = Clip(opened, opened.frames, 4)
    forwards = [frame.cells for frame in plain.frames(2, 10)]
    for each in (plain, plain.kept_in(tmp_path, None)):
        for _ in range(2):
            np.testing.assert_array_equal([frame.cells for frame in each.frames(9, 1, -1)], forwards[::-1])
        each.close()
    every_second = [frame.cells for frame in plain.frames(8, 1, -2)]
    np.testing.assert_array_equal(every_second, forwards[6::-2])


@pytest.mark.slow
def test_a_track_goes_both_ways_and_is_resumed(capsys, tmp_path, monkeypatch, recording):
    """From a known pose in the middle to both ends, wherever it is stopped meanwhile."""
    words = ["track", f"recording={recording}", f"actor={actor_file(tmp_path / 'a.yaml')}", *SMALL, *LIGHT]
    done(capsys, *words, "out=forwards")
    forwards = load_motion(tmp_path / "forwards" / "motion.npz")
    known = InitialPose(BEGIN, np.asarray(forwards.pose[BEGIN], np.float32), "middle")
    monkeypatch.setattr(passes, "find_initial_pose", lambda *_: known)
    done(capsys, *words, "out=whole")
    both = load_motion(tmp_path / "whole" / "motion.npz")
    np.testing.assert_array_equal(both.frame, np.arange(FRAMES))
    # The solver stops near the same optima, whichever way it comes.
    apart = np.linalg.norm(both.blob_means - forwards.blob_means, axis=-1)
    assert np.median(apart) < 0.02
    for frames in (5, BEGIN + 6):
        with monkeypatch.context() as context:
            stop_after(context, frames)
            main([*words, f"out=run{frames}"])
        done(capsys, *words, f"out=run{frames}", "resume=true")
        assert_same(tmp_path / f"run{frames}", tmp_path / "whole")
