"""A request to end (SIGTERM, as batch systems and `kill` send it) is obeyed as Ctrl-C is: tidily."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


class TerminatedError(KeyboardInterrupt):
    """Somebody asked the program to end."""


@contextmanager
def terminated_as_interrupted() -> Iterator[None]:
    """Within the block SIGTERM raises a `TerminatedError`, so that what was found is written and the rest removed.

    In other threads than the main one, which gets the signals, nothing changes.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _terminate(number: int, frame: object) -> None:
    raise TerminatedError
