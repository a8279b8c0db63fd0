"""A recording of which no actor can be made: what was tried by itself is said, and every other way, easiest first."""

from dataclasses import replace
from pathlib import Path

import pytest
from command_line import refused, trackable
from rig_cases import recording_of, ring_rig

from sogjax.run.example_frames import _ways


def test_every_way_to_an_actor_is_named(capsys, tmp_path):
    recording = trackable(tmp_path / "two")
    sentence = refused(capsys, "actor", f"recording={recording}", f"out={tmp_path / 'actor.yaml'}")
    ways = ("learnt from the videos", "background/CAMERA", "`example_poses: [0, 150]`", "CAMERA.mask.png", "actor=FILE")
    places = [sentence.rindex(way) for way in ways]
    assert places == sorted(places)
    assert not (tmp_path / "actor.yaml").exists()


@pytest.mark.parametrize(("words", "end"), [((), "NAME"), (("subject=anna",), "NAME, not anna")])
def test_which_of_several_people_is_wanted_is_asked_before_anything_is_looked_at(capsys, tmp_path, words, end):
    recording = trackable(tmp_path / "two")
    out = tmp_path / "actor.yaml"
    sentence = refused(capsys, "actor", f"recording={recording}", f"out={out}", "actors=2", *words)
    assert sentence.endswith(f"actors=2: choose one of person_1, person_2 with subject={end}")
    assert not out.exists()


def test_only_cameras_without_a_picture_of_the_empty_scene_learn_theirs():
    recording = recording_of(ring_rig(3), 4)
    one, *others = recording.rig.names
    said = _ways(replace(recording, background={one: Path("a.jpg")}))
    assert f"the background of {', '.join(others)} is learnt" in said
    assert f"pictures of the empty scene of {', '.join(others)} (background/" in said
    assert "background is learnt" in _ways(recording)
    assert "background" not in _ways(
        replace(recording, background={name: Path("a.jpg") for name in recording.rig.names})
    )
