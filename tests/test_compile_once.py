"""Processes that want the same program at the same time compile it once; none waits for long."""

import os
import subprocess
import sys
import time
from types import SimpleNamespace

import pytest

from sogjax.run import compile_once
from sogjax.run.compile_once import LOCKS, _with_locks, lock, unlock

fcntl = pytest.importorskip("fcntl", reason="no locks of bytes here")

PROGRAM = """
import jax
from sogjax.run.compilation_cache import use_compilation_cache
use_compilation_cache()
def program(x):
    for k in range(300):  # which takes longer to compile than both processes are apart
        x = jax.numpy.sin(x) + x * k
    return x
compiled = jax.jit(program).lower(jax.numpy.ones(3, "float32"))
events = []
jax.monitoring.register_event_listener(lambda event, **_: events.append(event.rpartition("/")[2]))
print("ready", flush=True)
input()
compiled.compile()
print(events.count("cache_hits"), events.count("cache_misses"))
"""
HOLDER = """
import os, sys, time
from sogjax.run.compile_once import lock
lock(os.open(sys.argv[1], os.O_RDWR | os.O_CREAT), 7)
print("locked", flush=True)
time.sleep(60)
"""


def started(code, *words, **environment):
    line, pipe = [sys.executable, "-c", code, *words], subprocess.PIPE
    return subprocess.Popen(line, stdin=pipe, stdout=pipe, text=True, env=os.environ | environment)


@pytest.mark.slow
def test_of_two_processes_one_compiles_and_the_other_reads(tmp_path):
    both = [started(PROGRAM, SOGJAX_COMPILATION_CACHE=str(tmp_path)) for _ in range(2)]
    for process in both:
        assert process.stdout.readline() == "ready\n"
    for process in both:
        process.stdin.write("\n")
        process.stdin.flush()
    assert sorted(process.communicate()[0].split() for process in both) == [["0", "1"], ["1", "0"]]


@pytest.fixture
def locked(tmp_path):
    """A file, and a process that holds a lock of its seventh byte."""
    process = started(HOLDER, str(tmp_path / "locks"))
    assert process.stdout.readline() == "locked\n"
    file = os.open(tmp_path / "locks", os.O_RDWR)
    yield file, process
    unlock()
    os.close(file)
    process.kill()
    process.communicate()


def test_nobody_waits_for_a_process_that_was_killed(locked):
    file, process = locked
    process.kill()
    begin = time.monotonic()
    lock(file, 7)
    assert time.monotonic() - begin < 10.0


def test_nobody_waits_longer_than_allowed_or_for_another_program(locked, monkeypatch):
    file, _ = locked
    lock(file, 8)
    unlock()
    monkeypatch.setattr(compile_once, "LONGEST_WAIT", 0.05)
    lock(file, 7)


def test_without_locks_work_goes_on(locked, monkeypatch):
    def refused(*_):
        raise OSError("No locks available")

    monkeypatch.setattr(fcntl, "lockf", refused)
    lock(locked[0], 7)


def test_a_folder_without_a_file_of_locks_is_read_as_before(tmp_path):
    (tmp_path / LOCKS).mkdir()  # in the way
    programs = SimpleNamespace(get=str.encode)
    assert _with_locks(lambda path: (programs, path), str(tmp_path)) == (programs, str(tmp_path))
    assert programs.get is str.encode
