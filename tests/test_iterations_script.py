"""The script that shows a solver's way within a frame: what it refuses, each with a sentence of its own."""

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

sys.path.append(str(Path(__file__).parents[1] / "experiments"))

import iterations

from sogjax.errors import InputError


def source_of(people, frames=6):
    return SimpleNamespace(name="pass-seed0", bodies=["body"] * people, recording=SimpleNamespace(num_frames=frames))


def test_several_people_and_a_wrong_frame_are_told_apart():
    iterations.check_showable(source_of(1), iterations.Settings("pass:0", frame=5))
    with pytest.raises(InputError, match="recording=pass:0: has 2 people") as people:
        iterations.check_showable(source_of(2), iterations.Settings("pass:0", frame=5))
    assert "frame" not in str(people.value)
    for frame in (0, 6, -1):
        with pytest.raises(InputError, match=rf"frame={frame}: choose one of 1 to 5, frames of pass-seed0"):
            iterations.check_showable(source_of(1), iterations.Settings("pass:0", frame=frame))
