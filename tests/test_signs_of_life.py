"""Signs of life: bars with the time left, lines where there is no terminal, and silence where little time passes."""

import io
import time

import pytest

from sogjax.run import terminal
from sogjax.run.terminal import Work, alive, bar, progress, remaining


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    """Five seconds pass whenever it is looked at."""
    now = iter(range(1000, 100_000, 5))
    monkeypatch.setattr(terminal.time, "monotonic", lambda: float(next(now)))


def test_where_there_is_no_terminal_a_line_comes_every_ten_seconds(clock):
    out = io.StringIO()
    assert list(progress(range(8), 8, "tracking", out)) == list(range(8))
    lines = out.getvalue().splitlines()
    assert len(lines) == 2  # after 15 and 30 of 40 seconds
    assert "3/8" in lines[0]
    assert lines[0].endswith("left")


def test_short_work_says_nothing():
    out = io.StringIO()
    list(progress(range(8), 8, "tracking", out))
    assert out.getvalue() == ""


def test_a_bar_has_the_time_left_and_none_at_the_end(clock):
    out = Terminal()
    list(progress(range(4), 4, "tracking", out))
    _, first, *_, last = [text for text in out.getvalue().split("\r") if text]
    assert "10 s left" in first
    assert "left" not in last
    assert "4/4" in last


@pytest.mark.parametrize(("seconds", "said"), [(12.4, "12 s"), (200.0, "3 min"), (9000.0, "2.5 h")])
def test_times_as_people_say_them(seconds, said):
    assert remaining(seconds) == said


def test_the_first_item_which_waits_for_programs_says_nothing_of_the_others(monkeypatch):
    now = iter((0.0, 60.0, 61.0, 62.0, 63.0))
    monkeypatch.setattr(terminal.time, "monotonic", lambda: next(now))
    out = Terminal()
    list(progress(range(4), 4, "tracking", out))
    assert "1/4  " in out.getvalue()
    assert "2/4 1.0/s, 2 s left" in out.getvalue()


def test_nothing_is_divided_by_nothing_done():
    assert "0/5" in bar("tracking", 0, 5, 3.0)


def test_work_without_a_count_shows_that_it_goes_on(monkeypatch):
    monkeypatch.setattr(terminal, "LINE_AFTER", 0.02)
    out = io.StringIO()
    with alive("searching", out):
        deadline = time.monotonic() + 5.0
        while "searching: 0 s so far" not in out.getvalue() and time.monotonic() < deadline:
            time.sleep(0.01)
    said = out.getvalue()
    assert said.startswith("searching: 0 s so far")
    time.sleep(0.05)
    assert out.getvalue() == said


def test_work_whose_share_is_known_says_how_long_the_rest_takes(monkeypatch):
    monkeypatch.setattr(terminal, "LINE_AFTER", 0.02)
    out = io.StringIO()
    with alive("searching", out) as work:
        work.share = 0.25
        deadline = time.monotonic() + 5.0
        while "left" not in out.getvalue() and time.monotonic() < deadline:
            time.sleep(0.01)
    assert "so far, about 0 s left" in out.getvalue()


def test_time_left_follows_from_the_share_that_is_done():
    assert Work(0.25).left(20.0) == ", about 60 s left"
    assert Work(0.0).left(20.0) == Work(1.0).left(20.0) == ""
