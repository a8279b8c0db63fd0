"""Which threads yield to which: the tracker comes first, then what makes cells of pictures, then searches."""

import os
import threading
from contextlib import suppress

CAMERA, SEARCH = 5, 10
"""Niceness of camera threads and of searches. The tracker's steps wait for all of their own threads, and are several
times slower where decoders keep one of these from running."""


def yield_to_others(niceness: int) -> None:
    """Make the calling thread, and those that it starts, less urgent, where the system can."""
    with suppress(AttributeError, OSError):
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), niceness)
