"""Backgrounds learnt from a clip are kept between runs, unless nobody may write there or nobody wants it."""

import numpy as np
import pytest
from small_recording import make_recording

from sogjax.errors import InputError
from sogjax.io import background_cache
from sogjax.io.background_cache import VARIABLE, background_origin, kept_background
from sogjax.io.recording import open_recording


@pytest.fixture
def recording(tmp_path, monkeypatch):
    monkeypatch.setattr(background_cache, "background_origin", lambda _: {"files": "as they were"})
    return open_recording(make_recording(tmp_path / "clip"))


class Learning:
    """Counts how often a background is learnt."""

    def __init__(self):
        self.count = 0

    def __call__(self):
        self.count += 1
        return {"left.picture": np.arange(3)}


def ask(recording, learning, chosen=None):
    said = []
    found = kept_background(chosen, recording, learning, said.append)
    np.testing.assert_array_equal(found["left.picture"], [0, 1, 2])
    return said


def test_it_is_learnt_once(recording, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, "")
    monkeypatch.setenv("SOGJAX_CACHE", str(tmp_path / "cache"))
    learning = Learning()
    assert ask(recording, learning) == ask(recording, learning) == []
    assert learning.count == 1
    (kept,) = (tmp_path / "cache" / "backgrounds").glob("*.npz")
    kept.write_bytes(b"damaged")
    (said,) = ask(recording, learning)
    assert "is damaged" in said
    assert learning.count == 2


def test_other_files_are_learnt_anew(recording, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "own"))
    learning = Learning()
    ask(recording, learning)
    monkeypatch.setattr(background_cache, "background_origin", lambda _: {"files": "others"})
    (said,) = ask(recording, learning)
    assert "other files" in said
    assert learning.count == 2


def test_another_decoder_is_another_origin(tmp_path, monkeypatch):
    recording = open_recording(make_recording(tmp_path / "clip"))
    origins = []
    for version in ("17.0.0", "18.0.0", None):
        monkeypatch.setattr(background_cache, "pyav_version", lambda version=version: version)
        origins.append(background_origin(recording))
    assert [origin["PyAV"] for origin in origins] == ["17.0.0", "18.0.0", None]


def test_nothing_is_kept_when_switched_off(recording, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, "off")
    monkeypatch.setenv("SOGJAX_CACHE", str(tmp_path / "cache"))
    learning = Learning()
    ask(recording, learning)
    ask(recording, learning)
    assert learning.count == 2
    assert not (tmp_path / "cache").exists()


def test_a_usual_folder_that_cannot_be_written_is_no_error_but_a_chosen_one_is(recording, tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv(VARIABLE, str(tmp_path / "file" / "below"))
    ask(recording, Learning())
    with pytest.raises(InputError, match=r"images\.cache"):
        ask(recording, Learning(), chosen=str(tmp_path / "file" / "below"))
