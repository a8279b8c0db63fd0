"""The runner: passes in their order, each done once however often a run is stopped."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from frame_table_cases import frame_table
from run_cases import DOG, stand_in_passes, stand_in_tracked, tiny_clip, tiny_run

from sogjax.io.frame_table import FramesRecord
from sogjax.run import passes
from sogjax.run.initial_pose import InitialPose
from sogjax.run.passes import BEFORE_TRACKING, PASSES, Pass
from sogjax.run.run import Run
from sogjax.run.runner import run_passes
from sogjax.settings.compose import track_config


@dataclass(frozen=True)
class Count:
    """A record that knows how many passes came before."""

    number: int

    def save(self, folder):
        (folder / "count").write_text(str(self.number))

    @classmethod
    def load(cls, folder):
        path = folder / "count"
        return cls(int(path.read_text())) if path.is_file() else None


def run_in(folder: Path, **records):
    return Run(tiny_clip(), track_config(recording="r"), folder, folder, records=records)


def counting(done, stopped=False):
    def counted(run):
        done.append("first")
        return Count(len(run.records))

    def second(run):
        done.append("second")
        if stopped:
            raise KeyboardInterrupt
        return run.records["first"].number + 1

    unwanted = Pass("unwanted", "", lambda run: pytest.fail("not wanted"), wanted=lambda run: False)
    return [Pass("first", "", counted, Count), unwanted, Pass("second", "", second)]


def test_a_stopped_run_does_what_is_left(tmp_path):
    done = []
    with pytest.raises(KeyboardInterrupt):
        run_passes(run_in(tmp_path), counting(done, stopped=True))
    run = run_passes(run_in(tmp_path), counting(done))
    assert done == ["first", "second", "second"]
    assert [*run.records] == ["first", "second"]
    assert run.records["second"] == 1


def test_records_that_are_given_stay(tmp_path):
    done = []
    run = run_passes(run_in(tmp_path, first=Count(7)), counting(done))
    assert (done, run.records["second"]) == (["second"], 8)
    assert not (tmp_path / "count").exists()


def test_frames_are_those_of_the_last_pass_that_left_any(tmp_path):
    """So a pass may change them without others knowing of it."""
    tracked, filtered = (FramesRecord(frame_table([[float(k)] * 5] * 3)) for k in range(2))
    run = run_in(tmp_path, tracked=tracked, relearnt=Count(1))
    assert run.frames is tracked.table
    run.records["filtered"] = filtered
    assert run.frames is run.unadjusted is filtered.table
    run.records |= {"adjusted": FramesRecord(frame_table([[2.0] * 5] * 3)), "smoothed": FramesRecord(tracked.table)}
    assert run.unadjusted is filtered.table
    assert run.frames is tracked.table


def test_every_record_that_is_kept_says_how():
    assert all(hasattr(each.record, "save") and hasattr(each.record, "load") for each in PASSES if each.record)


def wanted(run):
    return [each.name for each in PASSES if each.name not in run.records and each.wanted(run)]


def test_the_passes_of_a_command_are_those_that_it_wants(tmp_path):
    """Of every pass it is said here which commands have it."""
    tracking = ["initial_pose", "tracked", "occluders", "merged"]
    assert wanted(tiny_run(out=tmp_path)) == [*tracking, "result", "files"]
    assert wanted(tiny_run()) == tracking
    given = tiny_run("adjust=true", out=tmp_path, frames_given=True, tracked=None)
    assert wanted(given) == ["adjusted", "result", "files"]
    assert wanted(tiny_run("adjust=true")) == [*tracking, "adjusted"]
    assert wanted(tiny_run("adjust=true", "outputs.filter=6")) == [*tracking, "adjusted", "filtered"]
    assert [each.name for each in BEFORE_TRACKING] == ["background", "actors", "initial_pose", "keypoint_bias"]
    # a learnt background, actors that are doubtful by it, keypoints, things in front, actors that are not given
    conditional = {"relearnt", "remade", "keypoint_bias", "retracked", "recolored"}
    named = {"background", "actors", *tracking, "adjusted", "filtered", "result", "files"}
    assert {each.name for each in PASSES} == named | conditional


ONCE = "tracking.both_ways=false"


@pytest.mark.slow
@pytest.mark.parametrize("words", [(ONCE,), (), (ONCE, "adjust=true"), (ONCE, "outputs.filter=6")])
def test_files_grow_while_tracking_only_where_no_later_pass_changes_the_frames(tmp_path, monkeypatch, words):
    """Whichever pass that is: one is added behind the others."""
    seen = []
    monkeypatch.setattr(passes, "track_forward", lambda *given: seen.append(given[5]) or stand_in_tracked(run).table)
    for further in ((), (Pass("smoothed", "", stand_in_tracked, changes_frames=True),)):
        run = tiny_run(*words, out=tmp_path, initial_pose=InitialPose(0, np.zeros(DOG.skeleton.num_dofs), "given"))
        with monkeypatch.context() as context:
            context.setattr(passes, "PASSES", (*PASSES, *further))
            run_passes(run, [each for each in PASSES if each.name == "tracked"])
    assert [streams is not None for streams in seen] == [words == (ONCE,), False]


def test_a_filter_needs_no_more_than_its_line():
    """The run's frames and motions are those that it leaves."""
    still = lambda run: FramesRecord(replace(run.frames, pose=0.0 * run.frames.pose))
    run = run_passes(tiny_run(), stand_in_passes(Pass("still", "standing still", still)))
    assert run.records["tracked"].table.pose.any()
    assert not run.result_so_far.motions["dog"].pose.any()
