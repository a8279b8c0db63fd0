"""The figures about limbs in doubt: areas, shares and weights against cases that are known."""

from dataclasses import fields, replace

import numpy as np
import pytest
import yaml
from limb_doubt import ON_BACKGROUND, fitted_weights, regained_table, write_weights
from scipy.special import expit

from sogjax.quality.fitted import PATH, PoseEvidenceBounds, fitted_numbers, read_fitted
from sogjax.search.pose_confidence import PoseEvidence
from sogjax.study.limb_calibration import (
    area_table,
    area_under_roc,
    calibration_table,
    limb_curve,
    said_of,
)
from sogjax.study.limb_trials import PLAIN, JudgedLimb, LimbTrial

TRIAL = LimbTrial("walk", "walk:0", 4, "pictures")


def drawn(count, seed=0):
    """Limbs that are lost as often as a known logistic regression says."""
    random = np.random.default_rng(seed)
    worse, contradicted = random.uniform(0.0, 3.0, count), random.uniform(0.0, 1.0, count)
    lost = random.uniform(size=count) < expit(-4.0 + 2.0 * worse + 3.0 * contradicted)
    return JudgedLimb(TRIAL, PLAIN, "left arm", worse, contradicted, np.where(lost, 0.3, 0.02))


def test_the_area_is_the_share_of_pairs_in_order():
    random = np.random.default_rng(1)
    said, lost = random.integers(0, 20, 200) / 20.0, random.uniform(size=200) < 0.3
    pairs = [(a > b) + 0.5 * (a == b) for a in said[lost] for b in said[~lost]]
    assert area_under_roc(said, lost) == pytest.approx(np.mean(pairs))
    assert np.isnan(area_under_roc(said, np.zeros(200, bool)))


def without_background(limb):
    """The limb, told without a background: no bound holds its weights."""
    return replace(limb, trial=replace(limb.trial, background="none"))


def test_weights_that_limbs_were_drawn_with_are_found():
    weights = fitted_weights([without_background(drawn(40_000))])
    assert weights.constant == pytest.approx(-4.0, abs=0.2)
    assert weights.worse == pytest.approx(2.0, abs=0.1)
    assert weights.contradicted == pytest.approx(3.0, abs=0.2)


def test_a_measure_that_would_reassure_gets_no_weight():
    limb = drawn(4000)
    turned = JudgedLimb(TRIAL, PLAIN, "left arm", limb.worse, 1.0 - limb.contradicted, limb.error)
    assert fitted_weights([without_background(turned)]).contradicted == pytest.approx(0.0, abs=1e-9)


def test_what_lies_on_nothing_but_background_is_likely_lost_whatever_was_drawn():
    limb = drawn(4000)
    bound, free = fitted_weights([limb]), fitted_weights([without_background(limb)])
    on_background = lambda weights: expit(weights.constant + weights.contradicted)
    assert on_background(free) < 0.5
    assert on_background(bound) == pytest.approx(ON_BACKGROUND, abs=1e-3)
    kept = fitted_numbers().limb_weights.with_background
    assert on_background(kept) > 0.5


def test_other_weights_count_without_a_background():
    values = np.array([0.1, 1.5]), np.array([0.2, 0.6]), np.array([0.01, 0.5])
    kept = fitted_numbers().limb_weights
    for background, weights in (("clip", kept.with_background), ("none", kept.without_background)):
        limb = JudgedLimb(LimbTrial("walk", "walk:0", 4, background), PLAIN, "left arm", *values)
        said, lost = said_of([limb])
        score = weights.constant + weights.worse * values[0] + weights.contradicted * values[1]
        np.testing.assert_allclose(said, expit(score))
        assert lost.tolist() == [False, True]


def test_tables_and_curve_count_all_frames():
    limb = drawn(500)
    assert f"| all | 500 | {int((limb.error > 0.1).sum())} |" in area_table([limb], {"all": lambda _: True})
    rows = [line.split("|")[2] for line in calibration_table([limb]).splitlines()[2:]]
    assert sum(map(int, rows)) == 500
    curve = limb_curve([limb])
    assert curve.false_alarms[-1] == curve.noticed[-1] == pytest.approx(1.0)
    middle = 0.5 * (curve.noticed[1:] + curve.noticed[:-1])
    area = np.sum(middle * np.diff(curve.false_alarms))
    assert area == pytest.approx(curve.area, abs=0.01)


def test_displaced_limbs_are_counted_once_by_their_last_frame():
    ends = {"left arm": 0.02, "right arm": 0.4}
    limbs = [
        JudgedLimb(TRIAL, f"{moved} displaced", name, np.full(3, 9.0), np.ones(3), np.array([0.3, 0.2, end]))
        for moved in ends
        for name, end in ends.items()
    ]
    assert "| all | 2 | 50.0 % | 100 % |" in regained_table(limbs, {"all": lambda _: True})


def test_the_file_holds_what_the_records_need():
    """Every number is there, and no other; the file says of each part what it rests on."""
    text = PATH.read_text()
    assert read_fitted(text) == fitted_numbers()
    for part in yaml.safe_load(text).values():
        assert part == 1 or all(part[key] for key in ("how", "by", "recordings"))
    for wrong in (text.replace("unseen:", "unseeing:"), text.replace("version: 1", "version: 2"), "version: 1\n"):
        with pytest.raises(ValueError, match=r"fitted\.yaml"):
            read_fitted(wrong)


def test_the_names_of_bounds_are_those_of_what_is_bounded():
    assert {bound.name for bound in fields(PoseEvidenceBounds)} < {value.name for value in fields(PoseEvidence)}


def test_weights_are_written_into_the_file_and_nothing_else_changes(tmp_path):
    path = tmp_path / "fitted.yaml"
    path.write_text(PATH.read_text())
    write_weights(path, {"with_background": [drawn(4000)]}, "drawn limbs")
    before, after = (yaml.safe_load(each.read_text()) for each in (PATH, path))
    found = read_fitted(path.read_text()).limb_weights.with_background
    assert found.worse == round(fitted_weights([drawn(4000)]).worse, 1)
    assert after["limb_weights"]["recordings"].startswith("drawn limbs; with_background: 4000 limbs, ")
    assert "; without_background: " in after["limb_weights"]["recordings"]  # which was not fitted anew
    assert after["limb_weights"]["values"].pop("with_background") != before["limb_weights"]["values"].pop(
        "with_background"
    )
    after["limb_weights"]["recordings"] = before["limb_weights"]["recordings"]
    assert after == before
    others = lambda text: text[text.index("limb_baseline:") :]
    assert others(path.read_text()) == others(PATH.read_text())
    assert path.read_text().startswith("# Numbers that rest on recordings")
