"""A file is whole or not there."""

import errno
import os

import pytest

from sogjax.errors import InputError
from sogjax.io.files import atomic_path


def names_in(folder):
    return [path.name for path in folder.iterdir()]


def test_the_temporary_file_lies_beside_the_target_with_its_suffix_and_becomes_it(tmp_path):
    target = tmp_path / "new" / "walk.mp4"
    with atomic_path(target) as temporary:
        assert temporary.parent == target.parent
        assert temporary.suffix == ".mp4"
        temporary.write_text("whole")
        assert not target.exists()
    assert target.read_text() == "whole"
    assert names_in(target.parent) == ["walk.mp4"]


def test_an_error_leaves_the_older_file_and_nothing_else(tmp_path):
    target = tmp_path / "motion.npz"
    target.write_text("old")

    def fail():
        with atomic_path(target) as temporary:
            temporary.write_text("half")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert target.read_text() == "old"
    assert names_in(tmp_path) == ["motion.npz"]


def test_what_the_user_did_wrong_is_one_sentence(tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(InputError, match=r"file/out\.bvh: the folder .* cannot be written"):
        atomic_path(file / "out.bvh").__enter__()
    with pytest.raises(InputError, match="is a folder"):
        atomic_path(tmp_path).__enter__()


def test_a_full_disk_is_no_traceback_but_other_errors_pass(tmp_path):
    with pytest.raises(InputError, match="No space left"), atomic_path(tmp_path / "a.npz"):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    with pytest.raises(FileNotFoundError), atomic_path(tmp_path / "a.npz"):
        (tmp_path / "missing").read_text()
    assert names_in(tmp_path) == []


def test_a_folder_that_is_removed_meanwhile_is_one_sentence(tmp_path):
    def write():
        with atomic_path(tmp_path / "a" / "motion.npz") as path:
            path.unlink()
            path.parent.rmdir()

    with pytest.raises(InputError, match=r"motion\.npz: was removed"):
        write()
