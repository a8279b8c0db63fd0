"""Studies: their files, that a run is done once, what a summary says, and the documents."""

import re
import runpy
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import actor_file
from slow_values import fast_and_slow

from sogjax.cli.words import composed
from sogjax.errors import InputError
from sogjax.run.build import check
from sogjax.settings.run import TrackConfig
from sogjax.study import record as records
from sogjax.study import runner
from sogjax.study.document import Picture, Section, write_html, write_markdown
from sogjax.study.experiment import Experiment, ExperimentConfig, RowConfig, experiment_names
from sogjax.study.record import RunFolder, RunPlan, RunRecord
from sogjax.study.source import source_named
from sogjax.study.study import Study
from sogjax.study.summary import pooled_std, summarized
from sogjax.study.table import difference_words, findings, markdown_table, significance
from sogjax.synth.render import render_recording
from sogjax.synth.settings import SynthSettings

STUDY = Path(__file__).resolve().parents[1] / "experiments" / "study.py"
SMALL = ("images.depth=5", "solver.max_iterations=12")


@pytest.mark.parametrize("name", fast_and_slow(*experiment_names()))
def test_every_experiment_can_be_composed(name):
    experiment = Experiment.named(name)
    for method in experiment.methods:
        for row in experiment.rows_of(method):
            check(composed("track", ["recording=x", *experiment.overrides(row, method=method)]))


@pytest.mark.parametrize(
    ("words", "said"), [([], "no experiment"), (["luck"], "luck: no such"), (["depth", "luck"], "depth and luck")]
)
def test_a_study_without_the_name_of_one_experiment_lists_them(monkeypatch, capsys, words, said):
    monkeypatch.setattr(sys, "argv", [str(STUDY), *words, "frames=4"])
    with pytest.raises(SystemExit) as end:
        runpy.run_path(str(STUDY), run_name="__main__")
    assert end.value.code == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.splitlines()) == 1
    assert said in err
    assert all(name in err for name in experiment_names())


def experiment(**rows):
    config = ExperimentConfig(title="T", question="Q?", axis="x", reference="a", rows=rows)
    return Experiment("small", config)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("title: T\nquestion: Q\naxis: x\nrows: {a: {}}", "has no reference"),
        ("title: T\nquestion: Q\naxis: x\nreference: b\nrows: {a: {}}", "'b' is not a row"),
        ("title: T\nquestion: Q\naxis: x\nreference: a\nrows: {a: {cameras: 0}}", "must be 1 or more"),
        ("title: T\nquestion: Q\naxis: x\nreference: a\nrows: {a: {sets: []}}", "sets"),
        (
            "title: T\nquestion: Q\naxis: x\nreference: a\nmethods: {m: []}\nrows: {a: {methods: [n]}}",
            "'n' is none of m",
        ),
        ("title: T\nquestion: Q\naxis: x\nreference: a\nmeasure: luck\nrows: {a: {}}", "luck"),
        ("title: T\nquestion: Q\naxis: x\nreference: null\nrows: {a: {synth: {motion: fly}}}", "row 'a'.*fly"),
        ("title: T\nquestion: Q\naxis: x\nreference: null\nrows: {a: {synth: {camera: 3}}}", "row 'a'.*cameras"),
    ],
)
def test_a_wrong_experiment_file_is_refused(tmp_path, text, words):
    (tmp_path / "e.yaml").write_text(text)
    with pytest.raises(InputError, match=words):
        Experiment.from_file(tmp_path / "e.yaml")


def test_the_key_of_a_run_knows_its_numbers_and_not_its_outputs():
    base = RunPlan.of("walk", 9, ("a",), "accuracy", TrackConfig())
    same = TrackConfig(out="elsewhere", recording="there")
    same.images.cache = "cells"
    assert RunPlan.of("walk", 9, ("a",), "accuracy", same).key == base.key
    other = TrackConfig()
    other.energy.limit_weight = 2.0
    stepped = RunPlan.of("walk", 9, ("a",), "accuracy", TrackConfig(every=2, adjust=True))
    assert stepped.config == base.config | {"every": 2, "adjust": True}
    keys = {replace(base, frames=8).key, replace(base, cameras=["b"]).key}
    assert len(keys | {base.key, RunPlan.of("walk", 9, ("a",), "accuracy", other).key}) == 4


PAPERS = dict.fromkeys("abc", ("", None))


def record(errors, frames=None, **more):
    frames = list(range(len(errors))) if frames is None else frames
    return RunRecord({}, "here", frame=frames, error_mm=list(errors), joint_error_mm=list(errors), **more)


def test_differences_are_taken_in_the_frames_that_both_runs_have():
    slow, fast = record([9.0, 1.0, 9.0, 1.0]), record([2.0, 2.0], frames=[1, 3])
    papers = {"a": ("", None), "b": ("", None)}
    rows = summarized({"a": {"r": slow, "s": slow}, "b": {"r": fast, "s": fast}}, "a", papers)
    assert rows[0].difference is None
    assert difference_words(rows[0]) == "reference"
    assert rows[1].difference.mean == pytest.approx(1.0)
    assert rows[1].difference.is_significant
    assert difference_words(rows[1]) == "+1.0 (+1.0 to +1.0)"


def test_a_difference_on_one_recording_alone_is_never_significant():
    rows = summarized({"a": {"r": record(np.arange(40.0))}, "b": {"r": record(np.arange(40.0) + 5.0)}}, "a", PAPERS)
    assert not rows[1].difference.is_significant
    assert difference_words(rows[1]).startswith("one recording: +5.0")
    assert significance(rows[1]) == "+5.0"


def test_where_the_reference_failed_the_first_row_that_worked_takes_its_place():
    done = record([1.0, 2.0])
    rows = summarized({"a": {"r": record([], failed="no")}, "b": {"r": done}, "c": {"r": done}}, "a", PAPERS)
    assert [row.is_reference for row in rows] == [False, True, False]
    assert [difference_words(row) for row in rows][:2] == ["", "reference"]


def test_the_best_rows_are_told_on_the_recordings_that_all_have():
    hard, easy = record([50.0, 50.0]), record([10.0, 10.0])
    rows = summarized({"a": {"r": hard, "s": easy}, "b": {"s": record([11.0, 11.0])}, "c": {"s": easy}}, "a", PAPERS)
    said = findings(experiment(a=RowConfig(), b=RowConfig(), c=RowConfig()), rows)
    assert said[0] == "Smallest mean error: a, c (10.0 mm)."


def test_a_clear_difference_is_significant_and_one_within_the_spread_is_not():
    rng = np.random.default_rng(0)
    base = {f"r{k}": record(rng.normal(20.0, 4.0, 40)) for k in range(4)}
    shaken = {name: record(run.errors + rng.normal(0.0, 4.0, 40)) for name, run in base.items()}
    worse = {name: record(run.errors + 5.0) for name, run in base.items()}
    papers = dict.fromkeys("abc", ("", None))
    rows = summarized({"a": base, "b": shaken, "c": worse}, "a", papers)
    assert [significance(row).endswith(", not significant") for row in rows] == [False, True, False]


def test_the_standard_deviation_of_all_distances_is_that_of_the_parts_together():
    rng = np.random.default_rng(1)
    parts = [rng.normal(mean, 3.0, (30, 7)) for mean in (10.0, 25.0)]
    found = pooled_std([part.mean(axis=1) for part in parts], [part.std() for part in parts])
    assert found == pytest.approx(np.concatenate(parts).std())


def test_a_failed_run_is_an_empty_row_that_says_why():
    rows = summarized({"a": {"r": record([], failed="no such thing")}}, "a", {"a": ("44 mm", 44.0)})
    assert rows[0].failed == ("r: no such thing",)
    assert "| a |" in markdown_table(experiment(a=RowConfig(paper="44 mm")), rows)
    assert findings(experiment(a=RowConfig()), rows) == []


@pytest.fixture(scope="module")
def source_folder(tmp_path_factory):
    """A rendered person in small pictures, and an actor of few joints for it."""
    folder = tmp_path_factory.mktemp("study")
    settings = SynthSettings(cameras=3, frames=4, width=96, height=72, example_poses=False, background=False)
    render_recording(settings, folder / "person")
    (folder / "person" / "initial_pose.yaml").write_text("pose: rest\nposition: [0.0, 0.0, 1.0]\nheading: 0.0\n")
    source = source_named(str(folder / "person"), 4, folder)
    source.actor_folder.mkdir(parents=True)
    actor_file(source.actor_folder / "0_puppet.yaml")
    return folder


@pytest.mark.slow
def test_a_run_is_done_once_and_resumed_after_that(source_folder, monkeypatch, capsys):
    rows = {"a": RowConfig(set=list(SMALL)), "b": RowConfig(set=[*SMALL, "every=2"], cameras=2)}
    study = Study(source_folder, [str(source_folder / "person")], 4)
    first = {row: run for row, _, run in study.records(experiment(**rows))}
    assert [run.frame for run in first.values()] == [[0, 1, 2, 3], [0, 2]]
    assert len(first["b"].plan["cameras"]) == 2
    assert all(np.isfinite(run.errors[1:]).all() for run in first.values())
    assert all(run.errors[0] < 1e-3 for run in first.values())  # mm: where markers are attached; it counts, too
    assert all(len(run.closest_mm) == len(run.error_mm) for run in first.values())
    monkeypatch.setattr(runner, "track_recording", None)
    again = {row: run for row, _, run in Study(source_folder, study.recordings, 4).records(experiment(**rows))}
    assert repr(again) == repr(first)  # NaN equals nothing
    assert len(list((source_folder / "runs").glob("*.json"))) == 2


@pytest.mark.slow
def test_rows_of_more_cameras_than_there_are_are_left_out(source_folder):
    rows = {"a": RowConfig(set=list(SMALL), cameras=12), "b": RowConfig(set=list(SMALL), cameras=3)}
    study = Study(source_folder, [str(source_folder / "person")], 4)
    assert [row for row, _, _ in study.records(experiment(**rows))] == ["b"]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"frames": 0}, "frames=0"),
        ({"recordings": []}, r"recordings=\[\]"),
        ({"overrides": ["actor=/nope.yaml"]}, "overrides: actor=/nope.yaml"),
        ({"overrides": ["start=3"]}, "overrides: start=3"),
    ],
)
def test_a_study_that_cannot_be(tmp_path, settings, words):
    with pytest.raises(InputError, match=words):
        Study(tmp_path, **{"recordings": ["walk:0"], "frames": 4} | settings)


@pytest.mark.slow
def test_other_files_of_a_recording_are_another_recording(source_folder, tmp_path):
    folder = shutil.copytree(source_folder / "person", tmp_path / "person")
    before = source_named(str(folder), 4, tmp_path).identity
    assert source_named(str(folder), 4, tmp_path).identity == before
    (folder / "calibration.toml").touch()
    assert source_named(str(folder), 4, tmp_path).identity != before


@pytest.mark.slow
def test_a_run_that_fails_is_kept_and_the_others_go_on(source_folder):
    rows = {"a": RowConfig(set=[*SMALL, "images.background=pictures"]), "b": RowConfig(set=list(SMALL))}
    study = Study(source_folder, [str(source_folder / "person")], 4)
    records = {row: run for row, _, run in study.records(experiment(**rows))}
    assert "background/ has no picture" in records["a"].failed
    assert records["b"].failed == ""


def test_a_broken_record_is_made_again(tmp_path):
    runs, plan = RunFolder(tmp_path), RunPlan.of("walk", 9, (), "accuracy", TrackConfig())
    runs.keep(plan, record([1.0, float("nan")]))
    np.testing.assert_array_equal(runs.find(plan).errors, [1.0, np.nan])
    (tmp_path / "runs" / f"{plan.key}.json").write_text("{")
    assert runs.find(plan) is None


def test_a_study_without_its_recording_says_what_it_takes(tmp_path):
    with pytest.raises(InputError, match="MOTION:SEED"):
        Study(tmp_path, ["walk:first"], 4).source("walk:first")


def test_documents_hold_the_same_and_html_needs_nothing_beside_it(tmp_path):
    picture = Picture("p.png", b"\x89PNG", "a <picture>")
    table = "| a | b |\n|---|---|\n| 1 & 2 | `x` |\n\nfailed, a: why"
    sections = [Section("One", ["Text with `code`.", table, "- first\n- second", "```\na: <b>\n```"], [picture])]
    files = write_markdown(tmp_path / "report.md", "Title", sections)
    assert [path.name for path in files] == ["report.md", "p.png"]
    assert "![a <picture>](report/p.png)" in files[0].read_text()
    write_html(tmp_path / "report.html", "Title", sections)
    page = (tmp_path / "report.html").read_text()
    assert re.search(r"<td>1 &amp; 2</td>\s*<td><code>x</code></td>", page)
    assert "<p>failed, a: why</p>" in page
    assert "<li>second</li>" in page
    assert "a: &lt;b&gt;" in page
    assert not re.search(r'(src|href)="(?!data:|#)', page)


def test_the_packages_that_decide_a_result_are_there():
    root = Path(records.__file__).parents[1]
    assert [name for name in records._DECIDE if not (root / name / "__init__.py").is_file()] == []
