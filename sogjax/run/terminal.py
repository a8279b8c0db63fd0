"""Signs of life and messages on standard error: a bar on a terminal, elsewhere a line every ten seconds."""

import sys
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import TextIOBase
from typing import TypeVar

Item = TypeVar("Item")

SHOWN_AFTER = 1.0
"""Seconds before a bar appears: shorter work needs none."""
REDRAWN_AFTER = 0.1
LINE_AFTER = 10.0
"""Seconds between lines where there is no terminal, and between signs of life of work without a count."""
WIDTH = 24


@dataclass
class _Said:
    """When something was last said, by the monotonic clock."""

    at: float = 0.0


_said = _Said()


def progress(items: Iterable[Item], total: int, label: str, stream: TextIOBase | None = None) -> Iterator[Item]:
    """The items, with a bar like `tracking ######---- 12/40 8.1/s, 3 s left` on standard error.

    Where that is no terminal, such a line comes every ten seconds. The speed is that of the items after the first,
    which waits for programs to be compiled.
    """
    out = sys.stderr if stream is None else stream
    terminal = out.isatty()
    begin = drawn = first = time.monotonic()
    count = 0
    try:
        for item in items:
            yield item
            count += 1
            now = time.monotonic()
            first = now if count == 1 else first
            if terminal and now - begin > SHOWN_AFTER and (now - drawn > REDRAWN_AFTER or count == total):
                drawn = _said.at = now
                out.write("\r" + bar(label, count, total, now - first))
                out.flush()
            elif not terminal and now - drawn > LINE_AFTER:
                drawn = _said.at = now
                print(bar(label, count, total, now - first).rstrip(), file=out, flush=True)
    finally:
        if terminal and drawn > begin:
            out.write("\n")
            out.flush()


@dataclass
class Work:
    """Work that is under way."""

    share: float = 0.0
    """How much of it is done, 0 to 1; 0: not known."""

    def left(self, seconds: float) -> str:
        """How long the rest takes, when so many seconds are over."""
        return f", about {remaining(seconds * (1.0 / self.share - 1.0))} left" if 0.0 < self.share < 1.0 else ""


@contextmanager
def alive(label: str, stream: TextIOBase | None = None) -> Iterator[Work]:
    """For work without a count: while nothing else was said for ten seconds, a line like `first pose: 20 s so far`.

    With the time that is left, where whoever works sets the `share` of what was yielded.
    """
    out = sys.stderr if stream is None else stream
    begin, ended, work = time.monotonic(), threading.Event(), Work()

    def tell() -> None:
        told = begin
        while not ended.wait(max(told + LINE_AFTER - time.monotonic(), 0.0)):
            told = max(told, _said.at)
            if time.monotonic() - told >= LINE_AFTER:
                told = time.monotonic()
                print(f"{label}: {told - begin:.0f} s so far{work.left(told - begin)}", file=out, flush=True)

    thread = threading.Thread(target=tell, daemon=True)
    thread.start()
    try:
        yield work
    finally:
        ended.set()
        thread.join()


def bar(label: str, count: int, total: int, seconds: float) -> str:
    """One line with the progress of a job, its speed since the first item was done, and how long the rest takes so."""
    filled, speed = WIDTH * count // max(total, 1), ""
    if count > 1:
        each = max(seconds, 1e-9) / (count - 1)
        speed = f" {1.0 / each:.1f}/s" + (f", {remaining(each * (total - count))} left" if count < total else "")
    shown = f"{label:<18} {'#' * filled}{'-' * (WIDTH - filled)} {count}/{total}{speed}"
    return f"{shown:<{len(label) + WIDTH + 40}}"


def remaining(seconds: float) -> str:
    """A time that is left, as people say it."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def say(text: str) -> None:
    """Print a message for the user, apart from the results on standard output."""
    print(text, file=sys.stderr, flush=True)
    _said.at = time.monotonic()
