"""Runs whose frames are revised once all are tracked: what is written is what holds then."""

import jax.numpy as jnp
import numpy as np
import pytest
from command_line import actor_file, done, trackable

from sogjax.app.cli import main
from sogjax.data.motion import load_motion
from sogjax.engine import revision, run_job
from sogjax.errors import InputError
from sogjax.tracking.both_ways import Revised, Revision
from sogjax.tracking.limb_doubt import Judgement

FRAMES, ROW, FARTHER = 12, 5, 0.25
SMALL = ("images.depth=4", "solver.max_iterations=3", "solver.min_iterations=1", "outputs.bvh=false")
SHOWN = {"nothing shown": (False, False), "overlay": (True, False), "Rerun file": (False, True)}


@pytest.fixture
def command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recording = trackable(tmp_path / "walk", frames=FRAMES)
    return ["track", f"recording={recording}", f"actor={actor_file(tmp_path / 'a.yaml')}", *SMALL]


@pytest.fixture
def farther(monkeypatch):
    """One frame is found to be farther along the first axis."""

    def told_both_ways(tracker, passed, frames):
        assert len(list(frames(2, 6))) == 4
        pose, cameras = passed.poses[ROW].copy(), len(tracker.normalizers)
        pose[0] += FARTHER
        rows = passed.doubts[ROW], passed.usual[ROW], np.array([0.5]), np.full((1, cameras), 0.25)
        judged = Judgement(*(jnp.asarray(row) for row in rows))
        return Revision({ROW: Revised(pose, 7.0, {"similarity": 8.0}, judged)}, {"left arm": {ROW}})

    monkeypatch.setattr(revision, "told_both_ways", told_both_ways)


@pytest.mark.parametrize(("overlay", "rerun"), SHOWN.values(), ids=SHOWN)
def test_the_motion_that_is_written_is_the_revised_one(capsys, tmp_path, request, command, overlay, rerun):
    outputs = [f"outputs.overlay={overlay}", f"outputs.rerun={rerun}"]
    done(capsys, *command, *outputs, "tracking.both_ways=false", "out=before")
    request.getfixturevalue("farther")
    _, err = done(capsys, *command, *outputs, "out=after")
    assert "taken from the backward pass in 1 frame: left arm (1)" in err
    before, after = (load_motion(tmp_path / name / "motion.npz") for name in ("before", "after"))
    moved = after.pose[:, 0] - before.pose[:, 0]
    np.testing.assert_allclose(moved, FARTHER * (np.arange(FRAMES) == ROW), atol=1e-5)
    np.testing.assert_allclose(
        (after.blob_means - before.blob_means)[ROW],
        np.tile([FARTHER, 0.0, 0.0], (after.blob_means.shape[1], 1)),
        atol=1e-4,
    )
    assert (after.energy[ROW], after.similarity[ROW]) == (7.0, 8.0)
    assert after.explained is not None
    assert after.overlap is not None
    assert after.explained[ROW] == 0.5
    assert (after.overlap[ROW] == 0.25).all()
    files = {path.name for path in (tmp_path / "after").iterdir()}
    assert ("overlay.mp4" in files, "motion.rrd" in files) == (overlay, rerun)
    assert not any(name.endswith(".partial") for name in files)


def test_a_run_that_is_stopped_while_it_is_written_again_goes_on_to_the_same_end(
    capsys, tmp_path, monkeypatch, command, farther
):
    shown = ["outputs.overlay=true", "outputs.rerun=false"]
    done(capsys, *command, *shown, "out=whole")
    whole, seen = run_job.tracked_frames, []

    def tracked_frames(*arguments):
        for found in whole(*arguments):
            if len(seen) == FRAMES + 3:
                raise KeyboardInterrupt
            seen.append(found)
            yield found

    with monkeypatch.context() as context:
        context.setattr(run_job, "tracked_frames", tracked_frames)
        main([*command, *shown, "out=run", "resume=true"])
    assert not (tmp_path / "run" / "motion.npz").exists()
    done(capsys, *command, *shown, "out=run", "resume=true")
    one, two = (load_motion(tmp_path / name / "motion.npz") for name in ("whole", "run"))
    np.testing.assert_array_equal(one.pose, two.pose)
    np.testing.assert_array_equal(one.energy, two.energy)


def test_a_pass_backwards_that_fails_is_said_and_the_motion_stays(capsys, tmp_path, monkeypatch, command):
    def told_both_ways(tracker, passed, frames):
        raise InputError("a frame has too many image blobs")

    monkeypatch.setattr(revision, "told_both_ways", told_both_ways)
    shown = ["outputs.overlay=false", "outputs.rerun=false"]
    _, err = done(capsys, *command, *shown, "out=run")
    assert "warning: not told both ways, the first pass stays as it is: a frame has too many image blobs" in err
    assert load_motion(tmp_path / "run" / "motion.npz").num_frames == FRAMES
