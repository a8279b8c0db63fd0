"""Passes of which little is taken by themselves: the best path through several of them."""

from itertools import product

import numpy as np
import pytest
from body_cases import shipped
from hypothesis import given
from hypothesis import strategies as st

from sogjax.model.limbs import limb_blobs, limb_names, limbs
from sogjax.quality.fitted import fitted_numbers
from sogjax.search.best_passes import best_passes
from sogjax.search.other_pass import Compared, Pass
from sogjax.search.placed_body import means_of
from sogjax.search.tracklets import Tracklets
from sogjax.tracking.culling import Capacities

BODY, FRAMES, ENERGY = shipped("human"), 30, 100.0
ARM = limb_names(BODY).index("left arm")
LOST = np.asarray(BODY.poses["rest"])
RIGHT = np.where(np.isin(np.arange(len(LOST)), limbs(BODY.skeleton)[ARM]), np.asarray(BODY.poses["tpose"]), LOST)


def known_pass():
    """Who stands, with an arm that is lost in all frames."""
    nothing = np.zeros((FRAMES, 1))
    energies = np.full(FRAMES, ENERGY)
    return Pass(np.tile(LOST, (FRAMES, 1)), nothing, np.zeros((FRAMES, 2, 1)), energies, Capacities(1, 1))


def found_in(rows, gained, pose=RIGHT):
    """A pass with the arm where it belongs; what each of its rows gains."""
    nothing = [np.zeros(1)] * len(rows)
    return Compared([*rows], [], [pose] * len(rows), nothing, nothing, [gained] * len(rows))


def kept(*passes):
    tracklets = Tracklets(BODY)
    for each in passes:
        tracklets.add(each)
    return tracklets


def change():
    """What it costs to change to the other pass, or back."""
    moved = np.linalg.norm(np.diff(means_of(BODY, np.stack([LOST, RIGHT])), axis=0)[0], axis=-1)
    costs, members = fitted_numbers().merge_passes, limb_blobs(BODY)
    far = sum(max(float(moved[blobs].mean()) - costs.apart, 0.0) for blobs in members if blobs.any())
    return costs.leap * far * ENERGY


def test_two_passes_are_taken_together_of_which_neither_is_by_itself():
    passed = known_pass()
    of_both = 1.2 * 2.0 * change() / 15
    first, second = found_in(range(5, 13), of_both), found_in(range(19, 11, -1), of_both)  # the other one goes back
    assert kept(first).best_path(passed) == {}
    assert kept(second).best_path(passed) == {}
    path = kept(second, first).best_path(passed)
    assert sorted(path) == [*range(5, 20)]
    np.testing.assert_array_equal(np.stack([*path.values()]), np.tile(RIGHT, (15, 1)))


def test_where_two_end_and_begin_they_may_only_be_beside_each_other():
    passed, of_both = known_pass(), 1.2 * 2.0 * change() / 14
    assert len(kept(found_in(range(5, 12), of_both), found_in(range(12, 19), of_both)).best_path(passed)) == 14
    assert not kept(found_in(range(5, 12), of_both), found_in(range(13, 20), of_both)).best_path(passed)


@pytest.mark.parametrize("rows", [range(8), range(22, 30)])
def test_nothing_is_changed_to_or_from_at_an_end_of_the_clip(rows):
    passed = known_pass()
    assert {*kept(found_in(rows, 1.1 * change() / 8)).best_path(passed)} == {*rows}
    assert not kept(found_in(rows, 0.9 * change() / 8)).best_path(passed)


def test_what_loses_energy_is_not_taken_though_it_changes_nothing():
    assert not kept(found_in(range(FRAMES), -0.01)).best_path(known_pass())


def test_what_is_as_good_as_where_the_known_one_is_stays_as_it_is():
    """Else frames would change to and fro by what is left of rounding."""
    near = np.where(RIGHT != LOST, LOST + 0.02, LOST).astype(LOST.dtype)
    assert not kept(found_in(range(FRAMES), 0.01 * change(), near)).best_path(known_pass())


def test_a_change_between_two_others_costs_as_well():
    passed, other_arm = known_pass(), limb_names(BODY).index("right arm")
    opposite = np.where(np.isin(np.arange(len(LOST)), limbs(BODY.skeleton)[other_arm]), BODY.poses["tpose"], LOST)
    first, second = range(15), range(15, FRAMES)
    gained = 1.5 * change() / 15
    alike = kept(found_in(first, gained), found_in(second, gained)).best_path(passed)
    other = kept(found_in(first, gained), found_in(second, 0.1 * gained, opposite.astype(LOST.dtype))).best_path(passed)
    assert {*alike} == {*range(FRAMES)}
    assert {*other} == {*first}


def test_a_row_of_which_nothing_is_known_is_not_taken():
    gains = np.full(FRAMES, change())
    gains[10] = np.nan
    found = found_in(range(FRAMES), 0.0)
    found.gained[:] = gains.tolist()
    assert sorted(kept(found).best_path(known_pass())) == [*range(10), *range(11, FRAMES)]


def test_nothing_is_asked_twice_of_the_same_passes():
    tracklets = kept(found_in(range(5, 20), change()))
    assert tracklets.best_path(known_pass())
    assert not tracklets.best_path(known_pass())


@given(seed=st.integers(0, 1000))
def test_the_best_of_all_choices_of_passes_is_found(seed):
    rng = np.random.default_rng(seed)
    worth, changes = rng.normal(size=(5, 2)), rng.random((6, 3, 3))
    worth[rng.random(worth.shape) < 0.2] = -np.inf
    values = np.concatenate([np.zeros((5, 1)), worth], axis=1)

    def value(chosen):
        path = [0, *chosen, 0]
        return values[np.arange(5), chosen].sum() - sum(changes[t, path[t], path[t + 1]] for t in range(6))

    taken, total = best_passes(worth, changes)
    assert total == pytest.approx(max(value(np.array(each)) for each in product(range(3), repeat=5)))
    assert value(taken) == pytest.approx(total)


def test_what_gained_beside_a_row_that_changed_is_forgotten():
    passed = known_pass()
    tracklets = kept(found_in(range(5, 20), change()))
    tracklets.forget(range(5, 12))
    assert sorted(tracklets.best_path(passed)) == [*range(12, 20)]
    tracklets.forget(range(12, 20))
    assert tracklets.best_path(passed) == {}
