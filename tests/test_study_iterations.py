"""What has no way of a solver to show is refused, each case with a sentence of its own."""

from types import SimpleNamespace

import pytest
from iterations import check_showable

from sogjax.errors import InputError
from sogjax.study.source import Source


def source_of(folder, people, frames=6):
    source = Source("pass-seed0", folder, "", frames, folder)
    source.__dict__ |= {"bodies": ["body"] * people, "recording": SimpleNamespace(num_frames=frames)}
    return source


def test_several_people_and_a_wrong_frame_are_told_apart(tmp_path):
    check_showable(source_of(tmp_path, 1), frame=5)
    with pytest.raises(InputError, match="pass-seed0: has 2 people") as people:
        check_showable(source_of(tmp_path, 2), frame=5)
    assert "frame" not in str(people.value)
    for frame in (0, 6, -1):
        with pytest.raises(InputError, match=rf"frame={frame}: choose one of 1 to 5, frames of pass-seed0"):
            check_showable(source_of(tmp_path, 1), frame=frame)
