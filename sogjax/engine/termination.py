"""SIGTERM, as sent by batch systems and `kill`, ends a run as tidily as Ctrl-C."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_DEAF = ("_xla_gc_callback", "__del__")
"""Functions that the interpreter calls between two lines of others, and whose errors it ignores."""
_LATER = 0.05
"""Seconds after which a signal that came there is sent again."""


class TerminatedError(KeyboardInterrupt):
    """Somebody asked the program to end."""


@contextmanager
def terminated_as_interrupted() -> Iterator[None]:
    """Within the block SIGTERM raises a `TerminatedError`, so that results are written and the rest is removed.

    Does nothing outside the main thread, which alone receives signals.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _terminate(number: int, frame: FrameType | None) -> None:
    if frame is not None and frame.f_code.co_name in _DEAF:
        threading.Timer(_LATER, os.kill, (os.getpid(), number)).start()
        return
    raise TerminatedError
