"""Runs that are stopped when all frames are tracked: the same command goes on, and tracks no frame again."""

import numpy as np
import pytest
from command_line import actor_file, done, trackable
from test_resume import SMALL, assert_same, stop_after
from test_revision import ROW, moved_farther

from sogjax.cli.main import main
from sogjax.cli.words import composed
from sogjax.io.actor_file import load_body
from sogjax.io.motion import load_motion
from sogjax.io.recording import open_recording
from sogjax.refine.adjustment import Adjustment
from sogjax.run import adjust_clip, merge, passes, track
from sogjax.settings.compose import track_config
from sogjax.tracking import frame_by_frame

FRAMES, HIGHER = 12, 0.125
SHOWN = ("outputs.bvh=false", "outputs.rerun=false")


@pytest.fixture
def command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recording = trackable(tmp_path / "walk", frames=FRAMES)
    return ["track", f"recording={recording}", f"actor={actor_file(tmp_path / 'a.yaml')}", *SMALL, *SHOWN]


@pytest.fixture
def farther(monkeypatch):
    """One frame is found to be farther along the first axis."""
    monkeypatch.setattr(merge, "merge_passes", lambda tracker, passed, *_: moved_farther(tracker, passed))


@pytest.fixture
def higher(monkeypatch):
    """Every frame is adjusted to be higher."""

    def adjusted(tracker, pictures, poses, frames, similarity, *rest, moves, **_):
        found = poses.copy()
        found[:, 2] += HIGHER
        values = {term.name: np.zeros(len(poses)) for term in tracker.terms} | {"similarity": np.asarray(similarity)}
        return Adjustment(
            found, np.zeros(0), tracker.body, 1.0, 2.0, np.arange(len(poses)), 1, values, 256, np.asarray(moves), {}
        )

    monkeypatch.setattr(adjust_clip, "adjusted", adjusted)
    monkeypatch.setattr(adjust_clip, "_recolored", lambda setup, source, found, table, color: (found.body, 1.0))


def tracks_nothing(context):
    context.setattr(frame_by_frame, "_step", lambda *_: pytest.fail("a frame was tracked again"))
    context.setattr(passes, "merge_backward", lambda *_: pytest.fail("tracked both ways again"))


@pytest.mark.slow
def test_a_run_stopped_while_its_revised_files_are_written(capsys, tmp_path, monkeypatch, command, farther):
    done(capsys, *command, "out=whole")
    with monkeypatch.context() as context:
        stop_after(context, FRAMES + 3)
        main([*command, "out=run"])
    assert "all frames were tracked; the same command with resume=true" in capsys.readouterr().err
    assert not (tmp_path / "run" / "motion.npz").exists()
    with monkeypatch.context() as context:
        tracks_nothing(context)
        done(capsys, *command, "out=run", "resume=true")
    assert_same(tmp_path / "run", tmp_path / "whole")
    names = lambda folder: sorted(path.name for path in (tmp_path / folder).iterdir())
    assert names("run") == names("whole")


@pytest.mark.slow
@pytest.mark.parametrize("both_ways", [True, False], ids=["both ways", "forwards"])
def test_a_run_stopped_while_its_adjusted_files_are_written(
    capsys, tmp_path, monkeypatch, command, farther, higher, both_ways
):
    """What is adjusted is the motion that was kept, the revised one; it stays beside the adjusted one."""
    words = [*command, "adjust=true", f"tracking.both_ways={str(both_ways).lower()}"]
    done(capsys, *words, "out=whole")
    before, after = (load_motion(tmp_path / "whole" / name) for name in ("unadjusted.npz", "motion.npz"))
    np.testing.assert_allclose(after.pose[:, 2] - before.pose[:, 2], HIGHER, atol=1e-5)
    assert (before.energy[ROW] == 7.0) == both_ways
    with monkeypatch.context() as context:
        stop_after(context, FRAMES + 3)
        main([*words, "out=run"])
    assert "the same command with resume=true continues" in capsys.readouterr().err
    assert not (tmp_path / "run" / "motion.npz").exists()
    with monkeypatch.context() as context:
        tracks_nothing(context)
        done(capsys, *words, "out=run", "resume=true")
    assert_same(tmp_path / "run", tmp_path / "whole")
    assert_same(tmp_path / "run", tmp_path / "whole", "unadjusted.npz")
    names = lambda folder: sorted(path.name for path in (tmp_path / folder).iterdir())
    assert names("run") == names("whole")
    assert not any(name.endswith(".partial") for name in names("run"))


def test_a_run_stopped_while_it_is_adjusted(capsys, tmp_path, monkeypatch, command, higher):
    words = [*command, "adjust=true", "outputs.overlay=false"]

    def stop(*_, **__):
        raise KeyboardInterrupt

    with monkeypatch.context() as context:
        context.setattr(adjust_clip, "adjusted", stop)
        main([*words, "out=run"])
    with monkeypatch.context() as context:
        tracks_nothing(context)
        done(capsys, *words, "out=run", "resume=true")
    before, after = (load_motion(tmp_path / "run" / name) for name in ("unadjusted.npz", "motion.npz"))
    np.testing.assert_allclose(after.pose[:, 2] - before.pose[:, 2], HIGHER, atol=1e-5)
    config = composed("track", [*words[1:], "out=run", "resume=true"])
    told = track.track_to_folder(config).motions  # has ended: what is told is the adjusted motion
    assert [motion.pose[0, 2] for motion in told.values()] == [after.pose[0, 2]]


@pytest.mark.slow
def test_a_run_without_a_folder_that_is_stopped_does_not_advise_to_resume(capsys, tmp_path, monkeypatch, command):
    recording, actor = open_recording(tmp_path / "walk"), load_body(tmp_path / "a.yaml")
    config = track_config([*SMALL, *SHOWN], recording=tmp_path / "walk")
    stop_after(monkeypatch, 10)
    with pytest.raises(KeyboardInterrupt):
        track.track_recording(recording, [actor], config)
    assert "resume" not in capsys.readouterr().err
