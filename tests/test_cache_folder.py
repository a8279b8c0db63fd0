"""What is kept between runs stays within bounds."""

import os
import pwd

import pytest

from sogjax.errors import InputError
from sogjax.io.background_cache import background_folder
from sogjax.io.cache_folder import default_cache_dir, named_folder, sweep
from sogjax.run.compilation_cache import use_compilation_cache


def test_what_was_not_used_for_longest_goes_first(tmp_path):
    (tmp_path / "here").mkdir()
    paths = [tmp_path / "here" / f"{k}-cache" for k in range(8)]
    for k, path in enumerate(paths):
        path.write_bytes(bytes(100))
        os.utime(path, (k, k))
    sweep(tmp_path, "*/*-cache", largest=400)
    assert sorted(path.name for path in tmp_path.glob("*/*-cache")) == ["5-cache", "6-cache", "7-cache"]
    paths[0].write_bytes(bytes(1000))
    sweep(tmp_path, "*/*-cache", largest=400)  # not twice on one day
    assert paths[0].exists()


def test_what_fits_stays_and_other_files_do_not_count(tmp_path):
    (tmp_path / "a-cache").write_bytes(bytes(100))
    (tmp_path / "other").write_bytes(bytes(10000))
    sweep(tmp_path, "*-cache", largest=400)
    assert (tmp_path / "a-cache").exists()
    assert (tmp_path / "other").exists()


def test_a_folder_that_is_not_there_is_no_error(tmp_path):
    sweep(tmp_path / "none", "*", largest=1)


def test_files_without_content_go(tmp_path):
    (tmp_path / "a-cache").write_bytes(bytes(100))
    (tmp_path / "b-cache").touch()
    sweep(tmp_path, "*-cache", largest=400)
    assert [path.name for path in tmp_path.glob("*-cache")] == ["a-cache"]


@pytest.fixture
def nobody(monkeypatch):
    """A user of whom the system knows no home, as in containers."""

    def unknown(user):
        raise KeyError(user)

    monkeypatch.setattr(pwd, "getpwuid", unknown)
    for name in ("HOME", "XDG_CACHE_HOME", "LOCALAPPDATA", "SOGJAX_CACHE"):
        monkeypatch.delenv(name, raising=False)
    for name in ("SOGJAX_COMPILATION_CACHE", "SOGJAX_BACKGROUND_CACHE"):
        monkeypatch.setenv(name, "")


def test_nothing_is_kept_where_no_home_is_known(nobody):
    use_compilation_cache()
    assert background_folder(None) is None
    with pytest.raises(InputError, match="SOGJAX_CACHE=FOLDER"):
        default_cache_dir()


def test_the_home_is_told_by_a_tilde_in_every_variable(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in ("SOGJAX_CACHE", "SOGJAX_BACKGROUND_CACHE"):
        monkeypatch.setenv(name, "~/kept")
    assert default_cache_dir() == background_folder(None) == tmp_path / "kept"


def test_a_tilde_without_a_home_is_a_sentence(nobody, monkeypatch):
    monkeypatch.setenv("SOGJAX_BACKGROUND_CACHE", "~/kept")
    with pytest.raises(InputError, match="SOGJAX_BACKGROUND_CACHE=~/kept"):
        named_folder("SOGJAX_BACKGROUND_CACHE")
