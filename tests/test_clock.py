"""The clock of a command: its stages add up to the whole, those within others count for themselves."""

import json
import threading
import time
from contextlib import suppress

import pytest
from command_line import actor_file, done, trackable
from test_resume import LIGHT, SMALL

from sogjax.run import clock
from sogjax.run.clock import ADJUSTING, FIRST_FRAME, OTHER, STAGES, STARTING, TOTAL, TRACKING, Clock, clocked, stage


@pytest.fixture
def at(monkeypatch):
    """Sets the time."""
    now = [100.0]
    monkeypatch.setattr(clock.time, "perf_counter", lambda: now[0])
    return lambda seconds: now.__setitem__(0, 100.0 + seconds)


def test_a_stage_within_another_counts_for_itself(at):
    with clocked(before=3.0) as running:
        at(1.0)
        with stage(TRACKING):
            at(3.0)
            with stage(ADJUSTING):
                at(7.0)
            at(8.0)
        at(8.5)
    assert running.seconds() == {STARTING: 3.0, TRACKING: 3.0, ADJUSTING: 4.0, OTHER: 1.5, TOTAL: 11.5}


def test_one_stage_takes_the_place_of_another(at):
    with clocked() as running, stage(FIRST_FRAME) as turn:
        at(2.0)
        turn(TRACKING)
        at(5.0)
        turn(TRACKING)
        at(6.0)
    assert running.seconds() == {FIRST_FRAME: 2.0, TRACKING: 4.0, OTHER: 0.0, TOTAL: 6.0}


def test_a_stage_that_ends_with_an_error_ends(at):
    with clocked() as running:
        with suppress(KeyboardInterrupt), stage(TRACKING):
            at(2.0)
            raise KeyboardInterrupt
        at(3.0)
    assert running.seconds() == {TRACKING: 2.0, OTHER: 1.0, TOTAL: 3.0}


def test_a_stage_of_any_name_has_its_line(at):
    with clocked() as running, stage("smoothing"):
        at(2.0)
    assert running.seconds() == {"smoothing": 2.0, OTHER: 0.0, TOTAL: 2.0}


def test_other_threads_and_no_clock_count_nothing(at):
    with stage(TRACKING):
        at(1.0)

    def beside():
        with stage(ADJUSTING):
            at(5.0)

    with clocked() as running, clocked() as the_same:
        thread = threading.Thread(target=beside)
        thread.start()
        thread.join()
    assert running is the_same
    assert running.seconds() == {OTHER: 4.0, TOTAL: 4.0}


def lines_of(table):
    return {line[:32].strip(): float(line[32:].removesuffix(" s")) for line in table.splitlines()}


def test_the_lines_add_up_to_the_total_as_they_are_printed(at):
    """Though each is rounded, and stages that took next to no time have no line."""
    running = Clock()
    seconds = 0.0
    for name, each in zip(STAGES, [0.14, 0.14, 0.14, 0.03, 2.349, 0.06], strict=False):
        running.turn(name)
        seconds += each
        at(seconds)
    lines = lines_of(running.table())
    assert STAGES[3] not in lines
    total = lines.pop(TOTAL)
    assert total == pytest.approx(seconds, abs=0.051)
    assert sum(lines.values()) == pytest.approx(total, abs=1e-9)


@pytest.mark.slow
def test_track_ends_with_its_times_which_are_those_of_the_clock(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recording = trackable(tmp_path / "walk", frames=4)
    begin = time.perf_counter()
    actor = actor_file(tmp_path / "a.yaml")
    out, _ = done(capsys, "track", f"recording={recording}", f"actor={actor}", *SMALL, *LIGHT, "out=run")
    seconds = time.perf_counter() - begin
    lines = lines_of(out[out.rindex("\n\n") :].strip())
    assert [*lines][-2:] == [OTHER, TOTAL]
    total = lines.pop(TOTAL)
    assert sum(lines.values()) == pytest.approx(total, abs=1e-9)
    assert total == pytest.approx(seconds, abs=0.1 + 0.1 * seconds)
    noted = json.loads((tmp_path / "run" / "run.json").read_text())["seconds"]
    assert noted[FIRST_FRAME] > 0.0
    assert noted[FIRST_FRAME] == pytest.approx(lines.get(FIRST_FRAME, 0.0), abs=0.2)
    assert noted.pop(TOTAL) == pytest.approx(sum(noted.values()), abs=0.01)
