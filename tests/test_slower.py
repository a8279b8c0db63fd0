"""The small mode of the benchmarks says what became slower, and nothing where nothing did."""

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parents[1] / "benchmarks"))
import energies
import small
from gradient import Settings as Sizes
from gradient import scattered_views


@pytest.fixture
def clock(monkeypatch):
    """CPU time that passes only where work says so: the same machine for everybody."""
    now = [0.0]
    monkeypatch.setattr(small.time, "process_time", lambda: now[0])

    def work(seconds, *disturbed):
        extra = iter(disturbed)
        return lambda: now.__setitem__(0, now[0] + seconds + next(extra, 0.0))

    return work


@pytest.mark.parametrize(("factor", "slower"), [(0.5, False), (1.0, False), (1.15, False), (1.3, True), (3.0, True)])
def test_a_calculation_that_became_slower_is_named(clock, capsys, factor, slower):
    works = {"step": clock(0.02 * factor), "picture": clock(0.003)}
    assert small.compare(works, clock(0.001), {"step": 20.0, "picture": 3.0}) == slower
    assert ("slower by more than 20%: step\n" in capsys.readouterr().out) == slower


def test_a_slower_machine_changes_nothing(clock):
    assert small.compare({"step": clock(0.06)}, clock(0.003), {"step": 20.0}) == 0


def test_what_seems_slower_once_is_measured_again(clock):
    whole_measurement = [0.02] * 26
    assert small.ratio(clock(0.02, *whole_measurement), clock(0.001)) == pytest.approx(40.0)
    assert small.compare({"step": clock(0.02, *whole_measurement)}, clock(0.001), {"step": 20.0}) == 0


@pytest.mark.slow
def test_what_is_measured_of_near_pairs_is_the_energy_of_all():
    body = energies.human()
    dense = energies.frame_energy(body, scattered_views(body, Sizes(cameras=2, image_blobs=128)))
    assert energies.difference(dense, energies.with_near_pairs(dense)) < 1e-4
