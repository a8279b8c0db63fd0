"""Signs of life: bars with the time left, lines where there is no terminal, and silence where little time passes."""

import io
import re
import time

import pytest

from sogjax.run import terminal
from sogjax.run.terminal import Work, alive, progress, say


class Terminal(io.StringIO):
    def isatty(self):
        return True


def worked(out, count=4, seconds=0.03):
    """What is shown of some items that take so long each."""
    assert list(progress((time.sleep(seconds) or k for k in range(count)), count, "tracking", out)) == [*range(count)]
    return out.getvalue()


def test_where_there_is_no_terminal_a_line_comes_every_ten_seconds(monkeypatch):
    now = iter(range(1000, 100_000, 5))  # five seconds pass whenever it is looked at
    monkeypatch.setattr(terminal.time, "monotonic", lambda: float(next(now)))
    out = io.StringIO()
    assert list(progress(range(8), 8, "tracking", out)) == [*range(8)]
    lines = out.getvalue().splitlines()
    assert [re.search(r"tracking: (\d)/8 .*\ds/it", line)[1] for line in lines] == ["4", "6", "8"]


@pytest.mark.parametrize("out", [io.StringIO(), Terminal()])
def test_short_work_says_nothing(out):
    assert worked(out) == ""
    say("a message", out)
    assert out.getvalue() == "a message\n"


def test_a_bar_has_the_time_left_and_ends_with_a_line(monkeypatch):
    monkeypatch.setattr(terminal, "SHOWN_AFTER", 0.05)
    drawn = worked(Terminal(), 12)
    assert re.search(r"tracking: .* [2-9]/12 \[00:00<00:00, .*it/s\]", drawn)
    assert "12/12" in drawn.splitlines()[-1]
    assert drawn.endswith("\n")


def test_the_first_item_which_waits_for_programs_says_nothing_of_the_others(monkeypatch):
    monkeypatch.setattr(terminal, "SHOWN_AFTER", 0.05)
    out = Terminal()
    list(progress((time.sleep(1.0 if k == 0 else 0.03) or k for k in range(12)), 12, "tracking", out))
    rates = [float(rate) for rate in re.findall(r"([0-9.]+)it/s", out.getvalue())]
    assert rates
    assert min(rates) > 12 / 1.3


def test_a_message_stands_above_the_bar(monkeypatch):
    monkeypatch.setattr(terminal, "SHOWN_AFTER", 0.05)
    out = Terminal()
    for k in progress((time.sleep(0.03) or k for k in range(20)), 20, "tracking", out):
        if k == 10:
            say("a message", out)
    said = out.getvalue()
    assert re.search(r"\r *\ra message\n\rtracking: .*/20", said)


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
    assert "so far, about 00:00 left" in out.getvalue()


def test_time_left_follows_from_the_share_that_is_done():
    assert Work(0.25).left(20.0) == ", about 01:00 left"
    assert Work(0.0).left(20.0) == Work(1.0).left(20.0) == ""
