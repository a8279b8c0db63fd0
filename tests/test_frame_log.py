"""The table of frames grows on disk, can be read at any moment, and is the same as the whole one."""

import os
from dataclasses import replace

import numpy as np
import pytest
from body_cases import shipped
from command_line import actor_file, trackable
from frame_table_cases import frame_table

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.io.array_log import ROWS
from sogjax.io.frame_motions import FRAMES, PARTIAL, ClipFacts, load_motions, load_one_motion, motions_of
from sogjax.io.frame_table import FrameLog, FrameTable, read_frames_log
from sogjax.io.motion_data import save_motion
from sogjax.io.npz_file import npy_header
from sogjax.io.recording import open_recording
from sogjax.model.limbs import limb_names
from sogjax.run.actors import Actors

POSES = np.random.default_rng(0).normal(size=(11, 5)).astype(np.float32)
JUDGED = {
    "limb_doubt": np.linspace(0.0, 1.0, 22).reshape(11, 2),
    "baseline": np.ones((11, 2, 3), np.float32),
    "explained": np.full((11, 1), 0.5),
    "overlap": np.full((11, 1, 2), np.nan),
}


def assert_same(one, other):
    arrays, others = one.arrays(), other.arrays()
    assert arrays.keys() == others.keys()
    for name, values in arrays.items():
        np.testing.assert_array_equal(values, others[name], name)


@pytest.mark.parametrize("columns", [{}, JUDGED], ids=["plain", "judged"])
def test_every_part_can_be_read_while_the_log_is_open(tmp_path, columns):
    table = frame_table(POSES, **columns)
    with FrameLog(tmp_path / FRAMES) as log:
        for first, stop in ((0, 4), (4, 5), (5, 11)):
            log.append(table[first:stop])
            assert_same(read_frames_log(log.folder), table[:stop])


def test_a_log_goes_on_after_rows_that_are_kept_and_drops_the_others(tmp_path):
    table = frame_table(POSES)
    with FrameLog(tmp_path / FRAMES) as log:
        log.append(table[:7])
    with FrameLog(tmp_path / FRAMES, 4) as log:
        log.append(table[4:6])
    assert_same(read_frames_log(tmp_path / FRAMES), table[:6])
    with FrameLog(tmp_path / FRAMES) as log:
        log.append(table[:3])
    assert_same(read_frames_log(tmp_path / FRAMES), table[:3])


def written(folder, count=8):
    table = frame_table(POSES[:count])
    with FrameLog(folder) as log:
        log.append(table)
    return table


def test_rows_that_were_cut_off_in_the_middle_are_left_out(tmp_path):
    """As after a loss of power: the header counts whole blocks only, and comes after them."""
    table = written(tmp_path, 6)
    with (tmp_path / ROWS).open("ab") as file:
        file.write(b"half a row")
    assert_same(read_frames_log(tmp_path), table)


def test_only_a_record_that_was_cut_in_half_is_lost(tmp_path):
    table, path = written(tmp_path), tmp_path / ROWS
    with path.open("rb") as file:
        row = npy_header(file)[1].itemsize
    path.write_bytes(path.read_bytes()[: -row // 2])
    assert_same(read_frames_log(tmp_path), table[:7])


@pytest.mark.parametrize("damage", [(b"{'descr'", b"{('escr'"), (b"(8,)", b"(-8,)"), (b"'shape': (", b"'shape': 9L")])
def test_a_header_that_numpy_cannot_parse_is_as_good_as_none(tmp_path, damage):
    written(tmp_path)
    path = tmp_path / ROWS
    content = path.read_bytes()
    assert damage[0] in content
    path.write_bytes(content.replace(*damage, 1))
    assert read_frames_log(tmp_path) is None


def test_rows_are_on_the_disk_before_the_header_counts_them(tmp_path, monkeypatch):
    """Else a loss of power may leave a header that counts rows of zeros."""
    table, counts, whole = frame_table(POSES[:8]), [], os.fsync

    def fsync(file):
        whole(file)
        with (tmp_path / ROWS).open("rb") as rows:
            (count,), dtype = npy_header(rows)
            counts.append((count, (os.fstat(file.fileno()).st_size - rows.tell()) // dtype.itemsize))

    monkeypatch.setattr(os, "fsync", fsync)
    with FrameLog(tmp_path) as log:
        for first, stop in ((0, 4), (4, 8)):
            log.append(table[first:stop])
    assert counts == [(0, 4), (4, 8)]


def test_a_table_without_a_column_is_refused():
    arrays = frame_table(POSES).arrays()
    del arrays["iterations"]
    with pytest.raises(InputError, match="'iterations'"):
        FrameTable.from_arrays(arrays)


def test_each_actor_has_what_is_known_of_its_own_limbs():
    bodies = [replace(shipped("human"), name=name) for name in ("anna", "ben")]
    dofs, limbs = bodies[0].skeleton.num_dofs, len(limb_names(bodies[0]))
    of_limbs = np.tile(np.arange(2.0 * limbs), (3, 1))
    judged = {name: of_limbs + k for k, name in enumerate(("limb_doubt", "limb_unlike", "limb_rival"))}
    table = frame_table(np.zeros((3, 2 * dofs)), explained=np.zeros((3, 2)), overlap=np.zeros((3, 2, 2)), **judged)
    motions = motions_of(table, bodies, ClipFacts(25.0, "z", ("left", "right")))
    for name, part in (("anna", slice(limbs)), ("ben", slice(limbs, None))):
        for column, expected in judged.items():
            np.testing.assert_array_equal(getattr(motions[name], column), expected[:, part])


@pytest.fixture
def partial(tmp_path):
    """The folder of a run that was stopped."""
    folder = tmp_path / "run" / PARTIAL
    folder.mkdir(parents=True)
    recording, body = open_recording(trackable(tmp_path / "walk")), load_body(actor_file(tmp_path / "a.yaml"))
    Actors((body,)).save(folder)
    facts, table = ClipFacts.of(recording), frame_table(POSES[:4], first=2)
    facts.save(folder)
    with FrameLog(folder / FRAMES) as log:
        log.append(table)
    return folder, motions_of(table, [body], facts)["puppet"]


def test_the_motion_so_far_of_a_stopped_run_is_found_by_its_folders(partial):
    folder, motion = partial
    for path in (folder, folder / "puppet", folder.parent):
        found = load_one_motion(path)
        np.testing.assert_array_equal(found.pose, motion.pose)
        np.testing.assert_array_equal(found.world_from_joint, motion.world_from_joint)
        assert (found.frame.tolist(), found.up) == ([2, 3, 4, 5], "z")
    with pytest.raises(InputError, match="holds the motions of puppet, none of anna"):
        load_one_motion(folder / "anna")


def test_a_run_is_read_by_its_motions_alone(partial):
    """Other arrays beside them are nobody's motion."""
    folder, motion = partial
    run = folder.parent
    for name in ("anna", "ben"):
        save_motion(run / f"motion_{name}.npz", replace(motion, actor=name))
    save_motion(run / "unadjusted.npz", motion)
    np.savez(run / "kept.npz", pose=motion.pose)
    assert [*load_motions(run)] == ["anna", "ben"]
    with pytest.raises(InputError, match=r"motions of anna, ben; name one, such as .*motion_anna\.npz"):
        load_one_motion(run)
    with pytest.raises(InputError, match="no motion"):
        load_motions(folder.parent.parent / "walk")
