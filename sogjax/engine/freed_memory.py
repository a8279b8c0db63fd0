"""Memory that was freed but is still held: compiling leaves half a gigabyte of it."""

import ctypes
import sys


def return_freed_memory() -> None:
    """Give it back to the system, where the C library can (glibc's malloc_trim, some 40 ms); elsewhere nothing happens.

    Of a process that compiles several programs, each needs its memory beside what the earlier ones left, otherwise.
    """
    if not sys.platform.startswith("linux"):
        return
    try:
        trim = ctypes.CDLL(None).malloc_trim
    except (OSError, AttributeError):
        return
    trim(0)
