"""Signs of life and messages on standard error: a bar on a terminal, elsewhere a line about every ten seconds."""

import shutil
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import TextIOBase
from typing import Any, TypeVar

from tqdm import tqdm

Item = TypeVar("Item")

SHOWN_AFTER = 1.0
"""Seconds before a bar appears: shorter work needs none."""
LINE_AFTER = 10.0
"""Seconds between lines where there is no terminal, and between signs of life of work without a count."""
_LINE = "{desc}: {n_fmt}/{total_fmt} [{elapsed}<{remaining}, {rate_fmt}]"


class _Bar(tqdm):
    """A bar that notes when anything was last said, by the monotonic clock, and is not drawn before its time."""

    monitor_interval = 0  # no thread that looks after bars: each item looks at the time itself
    said_at = 0.0

    def display(self, *arguments: Any, **named: Any) -> None:
        """Draw the bar, unless its work may still turn out to be short."""
        if time.time() >= self.start_t + self.delay:
            _Bar.said_at = time.monotonic()
            super().display(*arguments, **named)


_Bar.set_lock(threading.RLock())  # tqdm's own lock is shared between processes, for which it starts another one


def progress(items: Iterable[Item], total: int, label: str, stream: TextIOBase | None = None) -> Iterator[Item]:
    """The items, with a bar on standard error that tells their speed and the time that is left.

    Where that is no terminal, a line with the same numbers comes every ten seconds. Both begin after the first item,
    which waits for programs to be compiled and says nothing of the speed of the others.
    """
    out: Any = sys.stderr if stream is None else stream
    rest = iter(items)
    for first in rest:
        yield first
        break
    if out.isatty():
        columns, rows = shutil.get_terminal_size()  # where a terminal does not tell it, tqdm would draw nothing
        settings: dict[str, Any] = {"initial": 1, "delay": SHOWN_AFTER, "miniters": 1, "smoothing": 0.0}
        yield from _Bar(rest, label, total, file=out, ncols=columns, nrows=rows, **settings)
        return
    begin = told = time.monotonic()
    for count, item in enumerate(rest, 2):
        yield item
        now = time.monotonic()
        if now - told > LINE_AFTER:
            told, line = now, tqdm.format_meter(count, total, now - begin, prefix=label, initial=1, bar_format=_LINE)
            say(line, out)


@dataclass
class Work:
    """Work that is under way."""

    share: float = 0.0
    """How much of it is done, 0 to 1; 0: not known."""

    def left(self, seconds: float) -> str:
        """How long the rest takes, when so many seconds are over."""
        known = 0.0 < self.share < 1.0
        return f", about {tqdm.format_interval(seconds * (1.0 / self.share - 1.0))} left" if known else ""


@contextmanager
def alive(label: str, stream: TextIOBase | None = None) -> Iterator[Work]:
    """Say that work without a count goes on: a line like `initial pose: 20 s so far`, whenever nothing came for ten.

    The line tells the time that is left, too, if whoever works sets the `share` of what is yielded.
    """
    begin, ended, work = time.monotonic(), threading.Event(), Work()

    def tell() -> None:
        told = begin
        while not ended.wait(max(told + LINE_AFTER - time.monotonic(), 0.0)):
            told = max(told, _Bar.said_at)
            if time.monotonic() - told >= LINE_AFTER:
                told = time.monotonic()
                say(f"{label}: {told - begin:.0f} s so far{work.left(told - begin)}", stream)

    thread = threading.Thread(target=tell, daemon=True)
    thread.start()
    try:
        yield work
    finally:
        ended.set()
        thread.join()


def say(text: str, stream: TextIOBase | None = None) -> None:
    """Print a message for the user above the bars, apart from the results on standard output."""
    out = sys.stderr if stream is None else stream
    _Bar.write(text, out)
    out.flush()
    _Bar.said_at = time.monotonic()
