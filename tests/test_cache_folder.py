"""What is kept between runs stays within bounds."""

import os

from sogjax.data.cache_folder import sweep


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
