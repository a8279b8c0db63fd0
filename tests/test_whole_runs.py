"""The table of whole runs: what is told of a run, and what the table says in all."""

import numpy as np
import pytest
import whole_runs

from sogjax.errors import InputError
from sogjax.quality.fitted import PATH, read_fitted
from sogjax.quality.limb_confidence import beside_rivals


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


def judged(astray, unlike, rival):
    """A run of one actor, of one of whose limbs so much is known in ten frames out of thirty."""
    limb = np.full((3, 30), [[0.01], [-0.01], [0.02]])
    limb[:2, 10:20] = [[unlike], [rival]]
    return {"actors": [{"astray": astray, "limbs": {"left arm": limb.tolist(), "right arm": limb[:, :9].tolist()}}]}


def test_what_rivals_count_is_chosen_by_who_is_told_to_be_wrong(tmp_path):
    path = tmp_path / "fitted.yaml"
    path.write_text(PATH.read_text())
    lost, right = [judged(0.3, 0.05, 0.002)] * 3, [judged(0.0, 0.35, -0.006), judged(0.0, 0.02, -0.003)] * 2
    said, missed, doubted = whole_runs.fit_rivals(path, [*lost, *right, {"actors": []}])
    found = read_fitted(path.read_text()).rivals
    assert said.startswith(f"8 runs; 7 actors, 3 with a joint astray: weight {found.weight:g}, ")
    assert missed.endswith("0 of 3, by others 0")
    assert doubted.endswith("0 of 4, by others 0")
    assert beside_rivals(np.array([0.05]), np.array([0.002]), found.weight) > found.doubtful >= 0.35
    with pytest.raises(InputError, match="nobody of these runs has a joint astray"):
        whole_runs.fit_rivals(path, right)
