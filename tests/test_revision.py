"""Runs whose frames are revised once all are tracked: what is written is what holds then."""

import jax.numpy as jnp
import numpy as np
import pytest
from command_line import actor_file, done, trackable
from frame_table_cases import frame_table

from sogjax.errors import InputError
from sogjax.io.motion import load_motion
from sogjax.io.recording import open_recording
from sogjax.quality.limb_confidence import LimbConfidence
from sogjax.run import merge, passes
from sogjax.run.clip import Clip
from sogjax.run.frames import with_rivals
from sogjax.run.initial_pose import InitialPose
from sogjax.search.revision import Revised, Revision

FRAMES, ROW, FARTHER = 12, 5, 0.25
SMALL = ("images.depth=4", "solver.max_iterations=3", "solver.min_iterations=1", "outputs.bvh=false")
SHOWN = {"nothing shown": (False, False), "overlay": (True, False), "Rerun file": (False, True)}


@pytest.fixture
def command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recording = trackable(tmp_path / "walk", frames=FRAMES)
    return ["track", f"recording={recording}", f"actor={actor_file(tmp_path / 'a.yaml')}", *SMALL]


def moved_farther(tracker, passed):
    """What is found where one frame is farther along the first axis."""
    pose, cameras = passed.poses[ROW].copy(), len(tracker.normalizers)
    pose[0] += FARTHER
    rows = passed.doubts[ROW], passed.baseline[ROW], np.array([0.5]), np.full((1, cameras), 0.25)
    judged = LimbConfidence(*(jnp.asarray(row) for row in rows))
    return Revision({ROW: Revised(pose, 7.0, {"similarity": 8.0}, judged)}, {"left arm": {ROW}})


@pytest.fixture
def farther(monkeypatch):
    """One frame is found to be farther along the first axis."""

    def merge_passes(tracker, passed, frames, *_):
        assert len(list(frames(range(5, 1, -1)))) == 4
        return moved_farther(tracker, passed)

    monkeypatch.setattr(merge, "merge_passes", merge_passes)


@pytest.mark.slow
@pytest.mark.parametrize(("overlay", "rerun"), SHOWN.values(), ids=SHOWN)
def test_the_motion_that_is_written_is_the_revised_one(capsys, tmp_path, request, command, overlay, rerun):
    outputs = [f"outputs.overlay={overlay}", f"outputs.rerun={rerun}", "outputs.page=false"]
    done(capsys, *command, *outputs, "tracking.both_ways=false", "out=before")
    request.getfixturevalue("farther")
    _, err = done(capsys, *command, *outputs, "out=after")
    assert "taken from other passes in 1 frame: left arm (1)" in err
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


@pytest.mark.parametrize("begin", [None, 7], ids=["from its first frame", "from one in the middle"])
def test_frames_read_backwards_are_those_of_the_part_that_is_tracked(capsys, tmp_path, monkeypatch, command, begin):
    """Rows count from where tracking starts, also if it begins in the middle and goes both ways from there."""
    recording, start, seen = open_recording(tmp_path / "walk"), 3, []
    if begin is not None:
        known = InitialPose(begin, np.array([0.0, 0.0, 1.0, 0.0, 0.0], np.float32), "middle")
        monkeypatch.setattr(passes, "find_initial_pose", lambda *_: known)

    def merge_passes(tracker, passed, frames, *_):
        assert len(passed.poses) == FRAMES - start
        seen.extend(frames(range(5, 1, -1)))
        return moved_farther(tracker, passed)

    monkeypatch.setattr(merge, "merge_passes", merge_passes)
    done(
        capsys,
        *command,
        "outputs.overlay=false",
        "outputs.rerun=false",
        "outputs.page=false",
        f"start={start}",
        "out=run",
    )
    expected = [frame.cells for frame in Clip(recording, recording.frames, 4).frames(start + 2, start + 6)]
    np.testing.assert_array_equal([frame.cells for frame in seen], expected[::-1])
    motion = load_motion(tmp_path / "run" / "motion.npz")
    assert motion.frame.tolist() == [*range(start, FRAMES)]
    assert np.flatnonzero(motion.energy == 7.0).tolist() == [ROW]


def test_a_pass_backwards_that_fails_is_said_and_the_motion_stays(capsys, tmp_path, monkeypatch, command):
    def merge_passes(tracker, passed, frames, *_):
        raise InputError("a frame has too many image blobs")

    monkeypatch.setattr(merge, "merge_passes", merge_passes)
    shown = ["outputs.overlay=false", "outputs.rerun=false", "outputs.page=false"]
    _, err = done(capsys, *command, *shown, "out=run")
    assert "limbs were not searched over the clip, which stays as it was tracked: a frame has too many" in err
    assert load_motion(tmp_path / "run" / "motion.npz").num_frames == FRAMES


def test_rivals_are_known_between_key_frames_and_what_is_seen_alone_is_kept():
    unlike = np.full((5, 2), 0.2)
    table = frame_table(np.zeros((5, 3)), limb_doubt=unlike)
    rivals = merge.over_frames({0: np.array([-0.005, np.nan]), 4: np.array([0.001, np.nan])}, 5)
    found = with_rivals(table, rivals)
    np.testing.assert_allclose(found.limb_rival[:, 0], np.linspace(-0.005, 0.001, 5))
    assert np.isnan(found.limb_rival[:, 1]).all()
    assert (np.diff(found.limb_doubt[:, 0]) > 0.0).all()
    np.testing.assert_array_equal(found.limb_doubt[:, 1], unlike[:, 1])
    np.testing.assert_array_equal(found.limb_unlike, unlike)
    assert with_rivals(table, merge.over_frames({}, 5)) is table
    again = with_rivals(found, np.full((5, 2), -0.005))  # poses moved a little, and rivals are known anew
    np.testing.assert_array_equal(again.limb_doubt, unlike)
