"""A clip of which every second frame is tracked: times are the recording's, and files play as fast as it does."""

import cv2
import numpy as np
import pytest
from command_line import actor_file, done, refused, trackable
from small_recording import FPS

from sogjax.io.motion import load_motion

SMALL = ("images.depth=4", "solver.max_iterations=3", "solver.min_iterations=1")


@pytest.fixture
def command(tmp_path):
    recording = trackable(tmp_path / "walk", frames=9)
    actor = actor_file(tmp_path / "a.yaml")
    return ["track", f"recording={recording}", f"actor={actor}", f"out={tmp_path / 'run'}", *SMALL]


@pytest.mark.slow
def test_every_second_frame_is_at_its_time_in_all_files(capsys, tmp_path, command):
    files = ("outputs.rerun=false", "outputs.overlay_width=128", "outputs.formats=[trc,csv]")
    done(capsys, *command, *files, "start=1", "every=2")
    motion = load_motion(tmp_path / "run" / "motion.npz")
    assert motion.frame.tolist() == [1, 3, 5, 7]
    np.testing.assert_allclose(motion.time, np.array([1, 3, 5, 7]) / FPS)
    assert f"Frame Time: {2.0 / FPS:.6f}" in (tmp_path / "run" / "motion.bvh").read_text()
    rate, _, count = (tmp_path / "run" / "motion.trc").read_text().splitlines()[2].split("\t")[:3]
    assert (float(rate), int(count)) == (FPS / 2.0, 4)
    video = cv2.VideoCapture(str(tmp_path / "run" / "overlay.mp4"))
    assert video.get(cv2.CAP_PROP_FPS) == pytest.approx(FPS / 2.0)
    assert video.get(cv2.CAP_PROP_FRAME_COUNT) == 4


def test_no_number_of_frames_is_refused(capsys, command):
    assert "every=0: must be a number of at least 1" in refused(capsys, *command, "every=0")
