"""A motion that grows on disk can be read at any moment, and is the same as the whole one."""

import os
from dataclasses import fields, replace

import numpy as np
import pytest
from motion_cases import walking_motion

from sogjax.errors import InputError
from sogjax.io.array_log import ROWS
from sogjax.io.motion import Motion, load_motion, save_motion
from sogjax.io.motion_log import PER_FRAME, SOMETIMES_PER_FRAME, MotionLog
from sogjax.io.npz_file import npy_header


def part(motion, frames):
    rows = [name for name in (*PER_FRAME, *SOMETIMES_PER_FRAME) if getattr(motion, name) is not None]
    return replace(motion, **{name: getattr(motion, name)[frames] for name in rows})


def assert_same(one, other):
    for entry in fields(Motion):
        np.testing.assert_array_equal(getattr(one, entry.name), getattr(other, entry.name), entry.name)


def test_doubts_about_limbs_grow_with_the_motion(tmp_path):
    motion = walking_motion(6)
    of_joint = np.arange(len(motion.joint_names)) % 2
    doubt = np.linspace(0.0, 1.0, 12).reshape(6, 2)
    motion = replace(motion, limb_names=np.array(["arm", "leg"]), joint_limb=of_joint, limb_doubt=doubt)
    log = MotionLog(tmp_path / "motion.partial")
    for first, stop in ((0, 4), (4, 6)):
        log.append(part(motion, slice(first, stop)))
    assert_same(log.motion(mapped=False), motion)
    log.remove()


def test_every_prefix_can_be_read_while_the_log_is_open(tmp_path):
    motion, log = walking_motion(11), MotionLog(tmp_path / "motion.partial")
    for first, stop in ((0, 4), (4, 5), (5, 11)):
        log.append(part(motion, slice(first, stop)))
        assert_same(load_motion(log.folder), part(motion, slice(0, stop)))
    mapped = log.motion(mapped=True)
    assert isinstance(mapped.pose.base if mapped.pose.base is not None else mapped.pose, np.memmap)
    save_motion(tmp_path / "motion.npz", mapped)
    assert_same(load_motion(tmp_path / "motion.npz"), motion)
    log.remove()
    assert [path.name for path in tmp_path.iterdir()] == ["motion.npz"]


def test_rows_that_were_cut_off_in_the_middle_are_left_out(tmp_path):
    """As after a loss of power: the header counts whole blocks only, and comes after them."""
    motion, log = walking_motion(8), MotionLog(tmp_path / "motion.partial")
    log.append(part(motion, slice(0, 6)))
    log.close()
    with (log.folder / ROWS).open("ab") as file:
        file.write(b"half a row")
    assert_same(load_motion(log.folder), part(motion, slice(0, 6)))


def test_a_log_begins_anew(tmp_path):
    for count in (9, 3):
        log = MotionLog(tmp_path / "m")
        log.append(walking_motion(count))
        log.close()
    assert load_motion(tmp_path / "m").num_frames == 3


def test_a_folder_that_is_no_log_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"constant\.npz"):
        load_motion(tmp_path)


@pytest.mark.parametrize("damage", [(b"{'descr'", b"{('escr'"), (b"(8,)", b"(-8,)"), (b"'shape': (", b"'shape': 9L")])
def test_a_header_that_numpy_cannot_parse_is_refused(tmp_path, damage):
    log = MotionLog(tmp_path / "motion.partial")
    log.append(walking_motion(8))
    log.close()
    path = log.folder / ROWS
    content = path.read_bytes()
    assert damage[0] in content
    path.write_bytes(content.replace(*damage, 1))
    with pytest.raises(InputError, match=ROWS):
        load_motion(log.folder)


def test_rows_are_on_the_disk_before_the_header_counts_them(tmp_path, monkeypatch):
    """Else a loss of power may leave a header that counts rows of zeros."""
    log, counts = MotionLog(tmp_path / "motion.partial"), []
    whole = os.fsync

    def fsync(file):
        whole(file)
        with (log.folder / ROWS).open("rb") as rows:
            (count,), dtype = npy_header(rows)
            counts.append((count, (os.fstat(file.fileno()).st_size - rows.tell()) // dtype.itemsize))

    monkeypatch.setattr(os, "fsync", fsync)
    motion = walking_motion(8)
    for first, stop in ((0, 4), (4, 8)):
        log.append(part(motion, slice(first, stop)))
    log.close()
    assert counts == [(0, 4), (4, 8)]


def test_only_a_record_that_was_cut_in_half_is_lost(tmp_path):
    motion, log = walking_motion(8), MotionLog(tmp_path / "motion.partial")
    log.append(motion)
    log.close()
    path = log.folder / ROWS
    with path.open("rb") as file:
        row = npy_header(file)[1].itemsize
    path.write_bytes(path.read_bytes()[: -row // 2])
    assert_same(load_motion(log.folder), part(motion, slice(0, 7)))
