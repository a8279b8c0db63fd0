"""The runner: passes in their order, each done once however often a run is stopped."""

from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from body_cases import shipped
from frame_table_cases import frame_table
from rig_cases import recording_of, ring_rig

from sogjax.io.frame_table import FramesRecord
from sogjax.run.actors import Actors
from sogjax.run.background import Background
from sogjax.run.clip import Clip
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
    recording = recording_of(ring_rig(2), 4)
    config = track_config(recording="r")
    return Run(Clip(recording, recording.frames, 4), config, folder, folder, records=records)


def passes(done, stopped=False):
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
        run_passes(run_in(tmp_path), passes(done, stopped=True))
    run = run_passes(run_in(tmp_path), passes(done))
    assert done == ["first", "second", "second"]
    assert [*run.records] == ["first", "second"]
    assert run.records["second"] == 1


def test_records_that_are_given_stay(tmp_path):
    done = []
    run = run_passes(run_in(tmp_path, first=Count(7)), passes(done))
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
    recording = recording_of(ring_rig(2), 8)
    clip, config = Clip(recording, recording.frames, 4), track_config(recording="r")
    known = {"background": Background(None), "actors": Actors((shipped("dog"),))}
    tracking = ["initial_pose", "tracked", "merged"]
    assert wanted(Run(clip, config, tmp_path, records=dict(known))) == [*tracking, "result", "files"]
    assert wanted(Run(clip, config, records=dict(known))) == tracking
    adjusting = replace(config, adjust=True)
    given = Run(clip, adjusting, tmp_path, frames_given=True, records=known | {"tracked": None})
    assert wanted(given) == ["adjusted", "result", "files"]
    assert wanted(Run(clip, adjusting, records=dict(known))) == [*tracking, "adjusted"]
    assert [each.name for each in BEFORE_TRACKING] == ["background", "actors", "initial_pose", "keypoint_bias"]
    conditional = {"relearnt", "keypoint_bias"}  # a background learnt from the clip, keypoints
    assert {each.name for each in PASSES} == {*known, *tracking, "adjusted", "result", "files"} | conditional
