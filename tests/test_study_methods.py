"""The paper's method and ours beside each other: which runs are made, and the tables."""

import pytest

from sogjax.settings.compose import track_config
from sogjax.study import study as study_module
from sogjax.study.experiment import Experiment, ExperimentConfig, RowConfig
from sogjax.study.methods import comparison_table, overview_table, settings_table
from sogjax.study.record import RunRecord
from sogjax.study.report import experiment_section, experiment_sections
from sogjax.study.source import Source
from sogjax.study.study import Study

METHODS = {"theirs": ["preset=paper"], "ours": []}
ROWS = {
    "a": RowConfig(set=["energy.limit_weight=1"], paper="44 mm", paper_value=44.0),
    "b": RowConfig(set=["energy.limit_weight=2"], paper="47 mm"),
    "c": RowConfig(methods=["ours"]),
}


def experiment(**more):
    config = {"title": "T", "question": "Q?", "axis": "w_l", "reference": "a", "rows": ROWS, "methods": METHODS}
    return Experiment("small", ExperimentConfig(**config | more))


@pytest.fixture
def study(tmp_path, monkeypatch):
    """A study whose runs are told by their settings: the paper's preset is 30 mm worse."""

    def run(experiment, row, source, runs, common, do, method):
        config = track_config(experiment.overrides(row, common, method), recording="x")
        if config.preset == "paper" and row == "b":
            return RunRecord({}, "here", failed="lost")
        error = 10.0 + config.energy.limit_weight + 30.0 * (config.preset == "paper")
        errors = {"error_mm": [0.0, 2 * error], "closest_mm": [0.0, 4 * error], "joint_error_mm": [1.0, 2.0]}
        more = {"std_mm": 1.0, "closest_std_mm": 2.0, "iterations": [4, 5], "milliseconds": [9.0, 50.0], "lost": 7}
        return RunRecord({}, "here", frame=[0, 1], **errors, **more)

    monkeypatch.setattr(study_module, "run_row", run)
    monkeypatch.setattr(Study, "sources_of", lambda self, experiment, row: [Source("r", tmp_path, "", 2, tmp_path)])
    return Study(tmp_path, ["walk:0"], 2)


def cells(table, line):
    return [cell.strip() for cell in table.splitlines()[line].strip("|").split("|")]


def summaries(study, which):
    return {method: study.summary(which, method) for method in which.methods}


def test_rows_are_run_with_every_method_but_those_that_name_theirs(study):
    which = experiment()
    assert which.overrides("b", ["x=1"], "theirs") == ["x=1", "preset=paper", "energy.limit_weight=2"]
    assert {method: [row.name for row in rows] for method, rows in summaries(study, which).items()} == {
        "theirs": ["a", "b"],
        "ours": ["a", "b", "c"],
    }


def test_every_row_has_the_papers_figure_and_both_methods_in_one_line(study):
    table = comparison_table(experiment(), summaries(study, experiment()))
    titles = cells(table, 0)
    assert titles[:3] == ["w_l", "the paper", "theirs: error, mm"]
    a, b, c = (dict(zip(titles, cells(table, line), strict=True)) for line in (2, 3, 4))
    assert (a["the paper"], a["theirs: error, mm"], a["ours: error, mm"]) == ("44 mm", "41.0", "11.0")
    assert (a["theirs: closest rule, mm"], a["ours: closest rule, mm"], a["ours: lost"]) == ("82.0", "22.0", "7")
    assert (b["theirs: error, mm"], b["ours: error, mm"], b["ours: difference"]) == ("failed", "12.0", "+1.0")
    assert (c["theirs: error, mm"], c["ours: error, mm"]) == ("", "11.0")


def test_rows_of_recordings_of_their_own_have_joints_markers_and_losses_and_a_mean(study):
    rows = {"a": RowConfig(cameras=12), "b": RowConfig(cameras=12), "c": RowConfig(cameras=4, methods=["ours"])}
    which = experiment(reference=None, rows=rows)
    table = comparison_table(which, summaries(study, which))
    titles = cells(table, 0)
    lines = {line[0]: dict(zip(titles, line, strict=True)) for line in (cells(table, k) for k in range(2, 7))}
    assert (lines["a"]["theirs: markers, mm"], lines["a"]["ours: joints, mm"], lines["a"]["ours: lost"]) == (
        *("41.0", "1.5", "7"),
    )
    assert (lines["b"]["theirs: joints, mm"], lines["b"]["theirs: lost"]) == ("failed", "")
    assert lines["**all 1 that worked, 12 cameras**"]["ours: lost"] == "7"
    assert (lines["c"]["theirs: lost"], lines["**all 1 that worked, 4 cameras**"]["ours: markers, mm"]) == ("", "11.0")
    assert "difference" not in table
    assert experiment_section(which, study, []).pictures[0].content.startswith(b"\x89PNG")


def test_a_section_tells_the_failures_of_a_method(study):
    done = []
    section = experiment_section(experiment(), study, done)
    assert [(one.method, one.row) for one in done] == [
        *(("theirs", "a"), ("theirs", "b")),
        *(("ours", "a"), ("ours", "b"), ("ours", "c")),
    ]
    assert "failed, theirs, b: r: lost" in "\n".join(section.parts)
    assert any(part.startswith("**Ours** (`preset=default`): Smallest mean error: a") for part in section.parts)
    assert len(section.pictures) == 1


def test_the_experiments_with_the_papers_method_lead(study):
    ours = experiment(methods={}, title="U", rows={"a": RowConfig()})
    titles = [section.title for section in experiment_sections([ours, experiment()], study, [])]
    assert titles == ["The two methods", "T", "Experiments with our method", "U"]
    assert [section.title for section in experiment_sections([ours], study, [])] == ["U"]


def test_the_overview_has_both_rules_and_the_rate_of_the_step(study):
    table = overview_table(study.summary(experiment(), "ours"))
    line = dict(zip(cells(table, 0), cells(table, 2), strict=True))
    assert line["error by the closest rule, mm"] == "22.0 +- 2.0"
    assert line["error by the scaled rule, mm"].startswith("11.0")
    assert line["tracking step, frames/s"] == "20.0"


@pytest.mark.slow
def test_the_methods_are_told_by_their_settings():
    lines = {cells(settings_table(), line)[0]: cells(settings_table(), line)[1:] for line in range(2, 12)}
    theirs, ours = lines["solver"]
    assert theirs == "conditioned ascent, mu+ 1.2, mu- 0.5, n_iter 10, epsilon 0.002"
    assert ours.startswith("Gauss-Newton")
    assert lines["weights"] == ["w_l 1, w_a 0.05", "w_l 1, w_a 0.01"]
    assert lines["colours"][0] == "hsv, eps_sim 0.15"
    assert lines["background"] == ["not used", "empty background pictures (plates), else learnt from the clip"]


def test_slow_experiments_are_run_on_one_seed_of_each_motion_and_on_folders(tmp_path, monkeypatch):
    monkeypatch.setattr(Study, "source", lambda self, name, frames=None: Source(name, tmp_path, "", 2, tmp_path))
    names = ["walk:0", "walk:1", "arms:1", str(tmp_path)]
    study = Study(tmp_path, names, 4)
    tracked = lambda study, which: [source.name for source in study.sources_of(which, "a")]
    assert tracked(study, experiment()) == ["walk:0", "arms:1", str(tmp_path)]
    assert tracked(study, experiment(methods={})) == names
    assert tracked(Study(tmp_path, names, 4, compared=["walk:1"]), experiment()) == ["walk:1"]
