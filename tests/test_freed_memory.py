"""What was freed goes back to the system, or nothing happens."""

import ctypes
import sys
from pathlib import Path

import pytest

from sogjax.run import memory as freed_memory
from sogjax.run.memory import return_freed_memory


def resident_mib():
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 2**20


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_small_pieces_that_were_freed_are_given_back():
    try:
        ctypes.CDLL(None).malloc_trim  # noqa: B018
    except AttributeError:
        pytest.skip("the C library has no malloc_trim")
    libc = ctypes.CDLL(None)
    libc.malloc.restype, libc.free.argtypes = ctypes.c_void_p, [ctypes.c_void_p]
    pieces = [libc.malloc(60_000) for _ in range(1000)]
    for piece in pieces:
        ctypes.memset(piece, 1, 60_000)
    for piece in pieces[:-1]:  # the last one keeps the end of the heap from shrinking by itself
        libc.free(ctypes.c_void_p(piece))
    before = resident_mib()
    return_freed_memory()
    assert resident_mib() < before - 30.0
    libc.free(ctypes.c_void_p(pieces[-1]))


def test_nothing_happens_elsewhere(monkeypatch):
    monkeypatch.setattr(freed_memory.sys, "platform", "win32")
    monkeypatch.setattr(freed_memory.ctypes, "CDLL", lambda name: pytest.fail("asked for the C library"))
    return_freed_memory()
