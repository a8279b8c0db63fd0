"""SIGTERM ends a command as Ctrl-C does."""

import os
import signal

import pytest

from sogjax.app import track
from sogjax.app.cli import main
from sogjax.engine.termination import TerminatedError, terminated_as_interrupted


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
