"""The table of whole runs: what is told of a run, and what the table says in all."""

import numpy as np
import pytest
import whole_runs
from scipy.special import expit, logit

from sogjax.errors import InputError
from sogjax.quality.fitted import PATH, read_fitted


def actor(mean, astray, looks_right):
    sentence = "looks right" if looks_right else "look at frames 3-9, left arm"
    return {"mean": mean, "astray": astray, "looks_right": looks_right, "sentence": sentence}


def entry(row, *actors, folder):
    (folder / whole_runs.FOUND).touch()
    return whole_runs._entry(row, {"actors": list(actors), "refused": "" if actors else "nobody is seen"}, folder)


def test_an_entry_counts_who_is_silently_wrong_and_who_is_doubted_in_vain(tmp_path):
    row = "talk 3 6 videos 5"
    found = entry(row, actor(0.02, 0.3, True), actor(0.03, 0.0, False), actor(0.04, 0.5, False), folder=tmp_path)
    assert (found["joints_mm"], found["astray_percent"]) == ("20 / 30 / 40", "30 / 0 / 50")
    assert (found["silent"], found["doubted"]) == ("1", "1")
    refused = entry(row, folder=tmp_path)
    assert (refused["joints_mm"], refused["silent"], refused["verdict"]) == ("", "", "refused: nobody is seen")


def test_groups_count_recordings_and_only_the_verdicts_that_were_kept(tmp_path):
    new = entry("talk 2 6 videos 5", actor(0.02, 0.3, False), actor(0.03, 0.0, True), folder=tmp_path)
    old = new | {"joints_mm": "100", "silent": "", "doubted": ""}
    median_and_high = "30 | 86"
    assert whole_runs._of_group([new, old]) == f"2 | {median_and_high} | 2 | 1 | 0 | 0"


def test_the_table_has_each_recording_once_and_as_it_can_be_run_again():
    table = whole_runs._table()
    assert len(table) > 200
    for row, found in table.items():
        _, people, cameras, given, _, *settings = row.split()
        assert given in whole_runs.GIVEN
        assert int(cameras) > 1
        refused = found["verdict"].startswith("refused")
        assert refused or len(found["joints_mm"].split("/")) == int(people)
        assert not found["astray_percent"] or len(found["astray_percent"].split("/")) == int(people)
        assert bool(found["silent"]) == bool(found["doubted"])
        assert all("=" in setting for setting in settings)


@pytest.mark.parametrize(("cameras", "name"), [(12, "10 to 12"), (6, "5 to 8"), (4, "3 or 4")])
def test_cameras_fall_into_one_group(cameras, name):
    lines = whole_runs._in_all({f"walk 1 {cameras} plates 7": {"joints_mm": "20", "silent": "", "astray_percent": ""}})
    assert [line.split("|")[1].strip() for line in lines if "| 1 | 20 |" in line] == [f"plates, {name}", "all"]


def run_of(random, count=4000):
    """A run of one actor whose limb is lost as often as a known weight says."""
    unlike, rival = random.uniform(0.001, 0.3, count), random.uniform(-0.01, 0.003, count)
    lost = random.uniform(size=count) < expit(logit(unlike) + 400.0 * np.maximum(rival + 0.005, 0.0))
    return {"actors": [{"limbs": {"left arm": [unlike.tolist(), rival.tolist(), np.where(lost, 0.3, 0.02).tolist()]}}]}


def test_the_weight_of_rivals_is_fitted_to_what_was_lost_and_written(tmp_path):
    path, random = tmp_path / "fitted.yaml", np.random.default_rng(1)
    path.write_text(PATH.read_text())
    count, seen, beside = whole_runs.fit_rivals(path, [run_of(random), run_of(random), {"actors": []}])
    assert count.startswith("2 runs; 8000 limbs, ")
    assert read_fitted(path.read_text()).rivals.weight == pytest.approx(4.0, abs=0.3)
    area = lambda line: float(line.split("ROC ")[1].split(";")[0])
    assert area(beside) > area(seen) + 0.05
    with pytest.raises(InputError, match="no limb of these runs is lost"):
        whole_runs.fit_rivals(path, [{"actors": [{"limbs": {"left arm": [[0.1], [-0.01], [0.02]]}}]}])
