"""The assembler and the slot: which pictures come together, who is waited for, what is lost and counted as what."""

import threading
import time

import numpy as np
import pytest

from sogjax.realtime.assembler import GIVEN_UP, Assembler
from sogjax.realtime.figures import Durations, Figures, Stamps
from sogjax.realtime.outlet import Outlet
from sogjax.realtime.pictures import Seen
from sogjax.realtime.slot import Slot

CELLS = np.zeros((2, 3, 3), np.uint8)
PERIOD = 0.04


def seen(camera, exposed, arrived=None):
    return Seen(camera, CELLS, exposed, exposed if arrived is None else arrived)


def test_a_complete_set_is_handed_over_at_once():
    assembler = Assembler(2, PERIOD)
    assert assembler.put(seen(0, 1.0), 1.0) == []
    (found,) = assembler.put(seen(1, 1.003), 1.003)
    assert set(found.pictures) == {0, 1}
    assert (found.arrived, found.handed_over) == (1.0, 1.003)
    assert assembler.last == {1: 1}


def test_half_a_frame_later_there_is_what_there_is():
    assembler = Assembler(3, PERIOD)
    assembler.put(seen(0, 1.0), 1.0)
    assembler.put(seen(2, 1.0), 1.001)
    assert assembler.due(1.0 + 0.49 * PERIOD) == []
    assert assembler.deadline() == pytest.approx(1.0 + 0.5 * PERIOD)
    (found,) = assembler.due(1.0 + 0.51 * PERIOD)
    cells, present = found.stacked(3, (2, 3))
    np.testing.assert_array_equal(present, [True, False, True])
    assert cells.shape == (3, 2, 3, 3)
    assert assembler.missing == {1: 1}
    assert assembler.put(seen(1, 1.0, 1.03), 1.03) == []  # too late
    assert assembler.late == {1: 1}


def test_pictures_of_different_moments_are_never_mixed():
    assembler = Assembler(2, PERIOD)
    assembler.put(seen(0, 1.0), 1.0)
    sets = assembler.put(seen(1, 1.04, 1.01), 1.01) + assembler.put(seen(0, 1.04), 1.04)
    assert [sorted(each.pictures) for each in sets] == [[0], [0, 1]]
    assert [each.exposed for each in sets] == [1.0, 1.04]


def test_a_camera_that_is_always_late_is_not_waited_for_until_it_is_in_time_again():
    assembler, handed = Assembler(2, PERIOD), []
    for k in range(GIVEN_UP):
        assembler.put(seen(0, k * PERIOD), k * PERIOD)
        handed += assembler.due(k * PERIOD + 0.51 * PERIOD)
    assert assembler.given_up == {1}
    (found,) = assembler.put(seen(0, 1.0), 1.0)  # at once
    assert found.handed_over == 1.0
    assembler.put(seen(1, 2.0), 2.0)
    assembler.put(seen(0, 2.001), 2.001)
    assert assembler.given_up == frozenset()


def test_the_latest_set_wins_and_what_it_replaces_is_counted():
    slot = Slot(Assembler(1, PERIOD))
    for k in range(5):
        slot.put(seen(0, float(k)))
    found = slot.take(0.1)
    assert found is not None
    assert found.exposed == 4.0
    assert (slot.overwritten, slot.handed_over) == (4, 5)
    assert slot.take(0.01) is None


def test_the_tracker_is_woken_when_half_a_frame_is_over():
    slot = Slot(Assembler(2, PERIOD))
    now = time.monotonic()
    threading.Timer(0.01, lambda: slot.put(seen(0, now, time.monotonic()))).start()
    found = slot.take(1.0)
    assert found is not None
    assert 0.01 + 0.5 * PERIOD <= time.monotonic() - now < 0.5


def test_an_error_of_a_camera_comes_after_the_sets_before_it():
    slot = Slot(Assembler(1, PERIOD))
    slot.put(seen(0, 1.0))
    slot.end(ValueError("gone"))
    assert slot.take(0.1) is not None
    with pytest.raises(ValueError, match="gone"):
        slot.take(0.1)


def test_percentiles_are_those_of_the_numbers_to_a_hundredth():
    values = np.random.default_rng(0).lognormal(-3.5, 0.5, 20_000)
    durations = Durations()
    for value in values:
        durations.add(float(value))
    for percent in (50, 95, 99):
        assert durations.percentile(percent) == pytest.approx(np.percentile(values, percent), rel=0.012)
    assert durations.longest == values.max()
    assert durations.deviation() == pytest.approx(values.std(), rel=1e-6)


def test_latency_counts_from_the_first_picture_to_sending():
    figures = Figures()
    for k in range(3):
        figures.add(Stamps(k + 0.0, k + 0.01, k + 0.02, k + 0.03, k + 0.05, k + 0.06), tracked=True)
    figures.add(Stamps(4.0, 4.0, 4.0, 4.0, 4.0, 4.0), tracked=False)
    found = figures.as_dict(3.0)
    assert found["latency_ms"]["max"] == pytest.approx(50.0, abs=0.1)
    assert found["interval_ms"]["p50"] == pytest.approx(1000.0, rel=0.01)
    assert (found["poses"], figures.unsolved) == (3, 1)


def test_an_outlet_never_makes_its_giver_wait_and_keeps_the_newest():
    taken, gate = [], threading.Event()

    def consume(item):
        gate.wait(2.0)
        taken.append(item)

    with Outlet("slow", consume, 2) as outlet:
        begin = time.monotonic()
        for k in range(50):
            outlet.put(k)
        assert time.monotonic() - begin < 0.5
        gate.set()
    assert taken[-2:] == [48, 49]
    assert outlet.dropped == 50 - len(taken)


@pytest.mark.parametrize("error", [OSError("no space"), AttributeError("a mistake of ours")])
def test_an_outlet_that_fails_says_so_once(capsys, error):
    def consume(item):
        raise error

    with Outlet("motion", consume, 2) as outlet:
        for k in range(5):
            outlet.put(k)
            time.sleep(0.01)
    assert capsys.readouterr().err.count("motion: stopped") == 1
