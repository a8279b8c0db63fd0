"""A recording of which no actor can be made: what was tried by itself is said, and every other way, easiest first."""

from command_line import refused, trackable


def test_every_way_to_an_actor_is_named(capsys, tmp_path):
    recording = trackable(tmp_path / "two")
    sentence = refused(capsys, "actor", f"recording={recording}", f"out={tmp_path / 'actor.yaml'}")
    ways = ("learnt from the videos", "background/CAMERA", "`example_poses: [0, 150]`", "CAMERA.mask.png", "actor=FILE")
    places = [sentence.rindex(way) for way in ways]
    assert places == sorted(places)
    assert not (tmp_path / "actor.yaml").exists()
