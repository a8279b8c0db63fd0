"""Progress bar and messages on standard error; the bar only appears on a terminal."""

import sys
import time
from collections.abc import Iterable, Iterator
from typing import TextIO, TypeVar

Item = TypeVar("Item")

SHOWN_AFTER = 1.0
"""Seconds before a bar appears: shorter work needs none."""
REDRAWN_AFTER = 0.1
WIDTH = 24


def progress(items: Iterable[Item], total: int, label: str, stream: TextIO | None = None) -> Iterator[Item]:
    """The items, with a bar like `tracking ######---- 12/40 8.1/s` on standard error."""
    out = sys.stderr if stream is None else stream
    if not out.isatty():
        yield from items
        return
    begin = drawn = time.monotonic()
    count = 0
    try:
        for item in items:
            yield item
            count += 1
            now = time.monotonic()
            if now - begin > SHOWN_AFTER and (now - drawn > REDRAWN_AFTER or count == total):
                drawn = now
                out.write("\r" + bar(label, count, total, now - begin))
                out.flush()
    finally:
        if drawn > begin:
            out.write("\n")
            out.flush()


def bar(label: str, count: int, total: int, seconds: float) -> str:
    """One line with the progress and speed of a job."""
    filled = WIDTH * count // max(total, 1)
    return f"{label:<18} {'#' * filled}{'-' * (WIDTH - filled)} {count}/{total} {count / max(seconds, 1e-9):.1f}/s "


def say(text: str) -> None:
    """Print a message for the user, apart from the results on standard output."""
    print(text, file=sys.stderr, flush=True)
