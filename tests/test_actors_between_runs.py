"""Actors that a refused run made are there for the next one."""

from dataclasses import replace

import numpy as np
import pytest
from body_cases import shipped
from rig_cases import recording_of, ring_rig

from sogjax.actor.make import MadeActor
from sogjax.io import background_cache
from sogjax.run import kept_actors
from sogjax.run.actors import ActorRequest, Actors
from sogjax.run.background import Background
from sogjax.run.clip import Clip
from sogjax.run.kept_actors import forget_actors, kept_or_made, kept_place
from sogjax.settings.method import ImagesConfig


@pytest.fixture
def request_and_count(tmp_path, monkeypatch):
    """Actors that are asked for, whose making is counted."""
    (tmp_path / "walk").mkdir()
    plate = tmp_path / "walk/cam0.jpg"
    plate.write_bytes(b"a")
    recording = replace(recording_of(ring_rig(2), 2), path=tmp_path / "walk", background={"cam0": plate})
    names = recording.rig.names
    recording = replace(recording, sources=dict.fromkeys(names, plate), frame_offset=dict.fromkeys(names, 0))
    count = []

    def made(request, report):
        count.append(request)
        report([object.__new__(MadeActor)])
        return Actors((shipped("human"),))

    monkeypatch.setattr(kept_actors, "make_actors", made)
    return ActorRequest(Clip(recording, recording.frames, 4), lambda: Background(None)), count


@pytest.mark.slow
def test_the_next_run_takes_them_until_one_comes_to_its_end(request_and_count, tmp_path, capsys):
    request, count = request_and_count
    images = ImagesConfig(cache=str(tmp_path / "cache"))
    assert kept_place(request, images) is None
    first = kept_or_made(request, images)
    again = kept_or_made(request, images)
    assert len(count) == 1
    np.testing.assert_array_equal(again.bodies[0].blob_colors, first.bodies[0].blob_colors)
    assert str(kept_place(request, images)) in capsys.readouterr().err
    kept_or_made(replace(request, symmetric=False), images)
    assert len(count) == 2, "of other settings"
    request.recording.background["cam0"].write_bytes(b"another")
    kept_or_made(replace(request, symmetric=False), images)
    assert len(count) == 3, "of other pictures"
    forget_actors(request, images)
    assert kept_place(request, images) is None


@pytest.mark.slow
def test_another_decoder_makes_them_anew(request_and_count, tmp_path, monkeypatch):
    """Its pixels differ: those of another PyAV, or of OpenCV, where that is not installed."""
    request, count = request_and_count
    images = ImagesConfig(cache=str(tmp_path / "cache"))
    kept_or_made(request, images)
    assert kept_place(request, images) is not None
    for version in ("1.0.0", None):
        monkeypatch.setattr(background_cache, "pyav_version", lambda version=version: version)
        assert kept_place(request, images) is None
    kept_or_made(request, images)
    assert len(count) == 2


def test_nothing_is_kept_where_that_is_off(request_and_count):
    """As the environment says for all tests."""
    request, count = request_and_count
    kept_or_made(request, ImagesConfig())
    kept_or_made(request, ImagesConfig())
    assert len(count) == 2
