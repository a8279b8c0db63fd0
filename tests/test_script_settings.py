"""Settings of scripts: from the command line, with help, and a sentence where one is wrong."""

from dataclasses import dataclass

import pytest
from omegaconf import MISSING

from sogjax.study.script import settings_from


@dataclass
class Some:
    recording: str = MISSING
    frames: int = 60


def test_settings_come_from_the_command_line():
    found = settings_from(Some, ["recording=walk", "frames=5"])
    assert (found.recording, found.frames) == ("walk", 5)


def test_help_is_no_error_and_names_the_settings(capsys):
    with pytest.raises(SystemExit) as end:
        settings_from(Some, ["--help"])
    assert end.value.code == 0
    assert "recording=... frames=60" in capsys.readouterr().out


@pytest.mark.parametrize(("words", "said"), [(["frames=5"], "recording"), (["recording=walk", "frames=many"], "many")])
def test_wrong_settings_are_refused_with_the_known_ones(capsys, words, said):
    with pytest.raises(SystemExit) as end:
        settings_from(Some, words)
    assert end.value.code == 2
    error = capsys.readouterr().err
    assert said in error
    assert "frames=60" in error
