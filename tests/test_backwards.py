"""A track that begins in the middle of a clip and goes both ways."""

import jax.numpy as jnp
import numpy as np
import pytest
from command_line import actor_file, done, trackable
from test_resume import LIGHT, SMALL, assert_same, stop_after

from sogjax.cli.main import main
from sogjax.io.motion import load_motion
from sogjax.io.recording import open_recording
from sogjax.run import track as track_command
from sogjax.run.backwards import frames_backwards
from sogjax.run.build import cell_grids
from sogjax.run.cells import cells_of_clip
from sogjax.settings.method import ColorConfig, ImagesConfig

FRAMES, BEGIN = 20, 11


@pytest.fixture
def recording(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return trackable(tmp_path / "walk", frames=FRAMES)


def test_frames_come_backwards(recording, tmp_path, monkeypatch):
    """Block by block from the videos, or from kept cells; the same as forwards, turned round."""
    monkeypatch.setattr("sogjax.run.backwards.BLOCK", 3)
    opened, images = open_recording(recording), ImagesConfig(depth=4, cache=str(tmp_path / "cells"))
    grids = cell_grids(opened, images.depth)
    decoded = list(frames_backwards(opened, grids, images, 2, 10))
    forwards = cells_of_clip(opened, grids, images, (2, 10))
    np.testing.assert_array_equal(decoded, forwards[::-1])
    np.testing.assert_array_equal(list(frames_backwards(opened, grids, images, 2, 10)), forwards[::-1])


@pytest.mark.slow
def test_a_track_goes_both_ways_and_is_resumed(capsys, tmp_path, monkeypatch, recording):
    """From a known pose in the middle to both ends, wherever it is stopped meanwhile."""
    actor = track_command.actors_of(
        track_command.opened(str(recording)), actor_file(tmp_path / "a.yaml"), "", ColorConfig()
    )
    words = ["track", f"recording={recording}", *SMALL, *LIGHT]
    monkeypatch.setattr(track_command, "actors_of", lambda *_: (actor[0], []))
    done(capsys, *words, "out=forwards")
    forwards = load_motion(tmp_path / "forwards" / "motion.npz")
    monkeypatch.setattr(track_command, "known_opening", lambda *_: (jnp.asarray(forwards.pose[BEGIN]), BEGIN))
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
