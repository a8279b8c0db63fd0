"""The report's section about few cameras is made of what was kept, and says what could not be done."""

import json

import pytest
from few_cameras import each_table

from sogjax.errors import InputError
from sogjax.study import few_cameras
from sogjax.study.few_cameras import KINDS, Result, Trial, Trials, few_cameras_section
from sogjax.study.study import Study
from sogjax.synth.settings import SynthSettings


@pytest.fixture
def study(tmp_path):
    return Study(tmp_path, ["walk:0"], 60, do=False)


def test_results_that_were_kept_are_averaged_over_sequences(study, monkeypatch):
    results = {
        Trial("walk", 2, "without"): Result(30.0, 80.0, 1, float("nan"), 0),
        Trial("walk", 2, "keypoints"): Result(20.0, 40.0, 0, 50.0, 3),
        Trial("run", 2, "keypoints"): Result(24.0, 44.0, 2, 54.0, 1),
    }
    monkeypatch.setattr(Trials, "kept", lambda self, trial: results.get(trial))
    about, together = few_cameras_section(study).parts
    assert "few_cameras.py" in about
    assert together.splitlines()[2:] == [
        "| 2 | without | 30.0 | 80.0 | 1 |  |  |",
        "| 2 | keypoints | 22.0 | 42.0 | 2 | 52.0 | 4 |",
    ]
    walk, run = each_table(results, KINDS).splitlines()[2:]
    assert walk.startswith("| walk | 30.0, 1 | 20.0 |")
    assert run.startswith("| run |  | 24.0, 2 |")


def test_a_result_is_read_from_where_it_was_written(study, monkeypatch):
    trials = Trials(study.folder, {"walk": SynthSettings()}, 60)
    trial, result = Trial("walk", 2, "without"), Result(30.0, 80.0, 1, 2.0, 0)
    assert trials.kept(trial) is None
    monkeypatch.setattr(Trials, "_run", lambda self, trial: result)
    assert trials.result(trial) == result
    assert trials.kept(trial) == result
    assert json.loads(next(study.folder.glob("results/*.json")).read_text())["trial"]["cameras"] == 2


def test_results_of_another_program_are_none_of_this_one(study, monkeypatch):
    trials = Trials(study.folder, {"walk": SynthSettings()}, 60)
    trial, result = Trial("walk", 2, "without"), Result(30.0, 80.0, 1, 2.0, 0)
    monkeypatch.setattr(Trials, "_run", lambda self, trial: result)
    trials.result(trial)
    monkeypatch.setattr(few_cameras, "program_digest", lambda *_: "another", raising=False)
    assert trials.kept(trial) is None


def test_a_trial_that_cannot_be_tracked_is_a_sentence(tmp_path, monkeypatch):
    def refused(self, trial):
        raise InputError("no such thing")

    monkeypatch.setattr(Trials, "result", refused)
    parts = few_cameras_section(Study(tmp_path, ["walk:0"], 60)).parts
    assert "Nothing was tracked for this." in parts
    assert "walk, 2 cameras, without: no such thing" in parts
