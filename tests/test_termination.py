"""SIGTERM ends a command as Ctrl-C does."""

import os
import signal
import time

import pytest

from sogjax.cli import track
from sogjax.cli.main import TerminatedError, main, terminated_as_interrupted


def terminate(*_):
    os.kill(os.getpid(), signal.SIGTERM)
    pytest.fail("was not obeyed")


def test_a_command_ends_with_the_status_that_shells_have(capsys, monkeypatch):
    monkeypatch.setattr(track, "run", terminate)
    assert main(["track", "recording=anything"]) == 143
    assert capsys.readouterr().err == "\nstopped\n"


def test_the_handler_of_before_is_put_back():
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(TerminatedError), terminated_as_interrupted():
        terminate()
    assert signal.getsignal(signal.SIGTERM) is before


def test_a_signal_that_comes_where_errors_are_ignored_is_not_lost():
    """As while JAX is told of a garbage collection: the error would only be printed, and the run go on."""

    class Collected:
        def __del__(self):
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(0.01)

    def collect():
        Collected()
        time.sleep(5.0)

    with pytest.raises(TerminatedError), terminated_as_interrupted():
        collect()
