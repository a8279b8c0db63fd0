"""The calibration of initial poses: what counts as right, which searches are drawn, and what the tables say."""

from dataclasses import replace

import numpy as np
import pytest
from first_pose import least_share, reliability, reliability_chart, sure_table, write_searches, wrong_table
from searches import FoundError, Search, Trial, drawn_trials, kind_of, other_side

from sogjax.study.true_poses import LimbErrors

LIMBS = ("trunk", "left arm", "right arm", "left leg", "right leg")
TRIAL = Trial(3, "walk", {"motion": "walk"}, 4, 0, True, 17)


def of_limbs(*values):
    limbs = np.array([values], float)
    return LimbErrors(LIMBS, limbs, limbs.mean(axis=1))


@pytest.mark.parametrize(
    ("errors", "mirrored", "kind"),
    [
        ((0.02, 0.03, 0.03, 0.03, 0.03), (0.2, 0.5, 0.5, 0.2, 0.2), "right"),
        ((0.02, 0.02, 0.02, 0.18, 0.18), (0.2, 0.5, 0.5, 0.02, 0.02), "legs exchanged"),
        ((0.20, 0.50, 0.50, 0.20, 0.20), (0.02, 0.02, 0.02, 0.02, 0.02), "back to front"),
        ((0.02, 0.02, 0.60, 0.02, 0.02), (0.2, 0.5, 0.5, 0.2, 0.2), "misplaced: right arm"),
        ((2.0, 2.0, 2.0, 2.0, 2.0), (2.0, 2.0, 2.0, 2.0, 2.0), "elsewhere"),
        ((0.02, 0.02, 0.04, 0.04, 0.04), (0.2, 0.02, 0.02, 0.03, 0.03), "right"),
    ],
)
def test_a_pose_near_on_average_is_wrong_where_sides_are_exchanged(errors, mirrored, kind):
    found = of_limbs(*errors)
    assert kind_of(float(found.mean[0]), found, of_limbs(*mirrored)) == kind


def test_the_other_side_of_a_joint():
    assert [other_side(name) for name in ("l_knee", "right_hip", "neck")] == ["r_knee", "left_hip", "neck"]


def test_more_trials_begin_with_the_same_ones_and_differ_from_each_other():
    synth = {name: {"motion": name} for name in ("walk", "run")}
    many = list(drawn_trials(synth, range(3, 13), 60, 40))
    assert list(drawn_trials(synth, range(3, 13), 60, 5)) == many[:5]
    assert {trial.cameras for trial in many} == set(range(3, 13))
    assert {trial.plates for trial in many} == {True, False}
    assert {trial.synth["motion"] for trial in many} == set(synth)
    assert len({trial.frame for trial in many}) > 20


def test_tables_count_what_was_sure_and_show_what_was_sure_and_wrong(tmp_path):
    right = Search(TRIAL, "anna", FoundError(0.03, "trunk", 0.04, "right"), True, 0.9, 12.0, 20.0)
    wrong = replace(right, error=FoundError(0.07, "left leg", 0.2, "legs exchanged"), confidence=0.6)
    doubtful = replace(wrong, sure=False, confidence=0.1)
    refused = replace(right, error=None, sure=False, confidence=0.0, refused="not sure")
    searches = [right] * 8 + [wrong, doubtful, refused]
    line = next(line for line in sure_table(searches).splitlines() if line.startswith("| all"))
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    assert cells == ["all", "11", "9", "8 (88.9 %)", "57 %", "1", "0 (0.0 %)", "1", "12", "20"]
    assert least_share([right] * 299) == pytest.approx(0.99, abs=1e-4)
    assert wrong_table(searches).count("legs exchanged") == 1
    assert "none is wrong" in wrong_table([right, doubtful])
    chart = reliability(searches)
    assert np.all(np.diff(chart.confidence) >= 0.0)
    assert sum(stop - first for first, stop in chart.bins) == len(chart.error) == 10
    assert reliability_chart(chart).startswith(b"\x89PNG")
    write_searches(tmp_path / "searches.csv", searches)
    assert len((tmp_path / "searches.csv").read_text().splitlines()) == 12
