"""Each program is compiled by one process: others that want it at the same time wait, and read what that one kept.

jax looks for a program in its folder, compiles it where it is missing, and keeps it; processes that begin together all
find nothing. Here the look locks the program's byte of a file beside them, until it is found or compiled. The system
unlocks what an ended process held. Where a disk knows no locks, each process compiles for itself.
"""

import contextlib
import hashlib
import os
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

try:
    import fcntl
except ImportError:  # on Windows
    fcntl = None

LOCKS = "compiling"
"""Name of the file whose bytes are locked."""
LONGEST_WAIT = 120.0
"""Seconds after which a process compiles what another has not kept yet, such as one that was stopped, not ended."""
ASKED_EVERY = 0.005
"""Seconds between two looks whether a lock is free."""
COMPILED = "/jax/core/compile/backend_compile_duration"
"""What jax calls the end of a compilation, or of reading in its place, failed or not."""

_held = threading.local()
"""The lock of each thread, as file and byte: a thread compiles one program after the other, so none waits for two.
Also the program that it read last, as `read`."""


def compile_once() -> None:
    """Compile nothing that another process compiles; to be called when jax is imported, once or more.

    jax has no place for this but a function of its own: where that is missing, nothing is changed.
    """
    from jax import monitoring
    from jax._src import compilation_cache as of_jax

    made = getattr(of_jax, "get_file_cache", None)
    if fcntl is None or made is None or isinstance(made, partial):
        return
    of_jax.get_file_cache = partial(_with_locks, made)
    of_jax.reset_cache()  # it may have been made already
    monitoring.register_event_duration_secs_listener(_unlock_compiled)


def _with_locks(made: Callable[[str], Any], path: str) -> Any:
    """What jax makes to read and write a folder, locked where it reads."""
    found = made(path)
    with contextlib.suppress(OSError, TypeError, AttributeError):
        programs, _ = found
        file = os.open(Path(path) / LOCKS, os.O_RDWR | os.O_CREAT, 0o666)
        programs.get = partial(_found_or_locked, file, programs.get)
    return found


def _found_or_locked(file: int, read: Callable[[str], bytes | None], key: str) -> bytes | None:
    """A kept program; where there is none, this process is the one that compiles it."""
    unlock()
    lock(file, int.from_bytes(hashlib.sha256(key.encode()).digest()[:7], "big"))
    program = _held.read = read(key)
    if program is not None:
        unlock()
    return program


def watches() -> bool:
    """Whether what jax reads is seen here."""
    from jax._src import compilation_cache as of_jax

    return isinstance(getattr(of_jax, "get_file_cache", None), partial)


@contextlib.contextmanager
def reading() -> Iterator[Callable[[], bytes | None]]:
    """Within the block, tell what this thread read last as it was kept; None: what it asked for was not there.

    An executable that jax has read cannot be written again.

    Raises:
        LookupError: it asked for nothing.
    """
    _held.read = LookupError

    def last() -> bytes | None:
        if _held.read is LookupError:
            raise LookupError
        return _held.read

    yield last
    _held.read = None


def lock(file: int, byte: int) -> None:
    """Lock a byte of a file once no other process holds it; go on without where that lasts or is not possible."""
    assert fcntl is not None
    until = time.monotonic() + LONGEST_WAIT
    while time.monotonic() < until:
        try:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, byte)
        except (BlockingIOError, PermissionError):  # held by another
            time.sleep(ASKED_EVERY)
        except OSError:
            return
        else:
            _held.lock = file, byte
            return


def unlock() -> None:
    """Unlock what this thread holds."""
    if fcntl is None or (held := getattr(_held, "lock", None)) is None:
        return
    _held.lock = None
    with contextlib.suppress(OSError):
        fcntl.lockf(held[0], fcntl.LOCK_UN, 1, held[1])


def _unlock_compiled(event: str, duration_secs: float, **kwargs: object) -> None:
    if event == COMPILED:
        unlock()
