"""Kept cells: the same as those of the videos, and made again where they may not be."""

import json
import zlib
from collections.abc import Generator

import numpy as np
import pytest
from command_line import actor_file, done, refused, trackable
from small_recording import make_recording, write_images, write_video

from sogjax.io import cell_cache
from sogjax.io.motion import load_motion
from sogjax.io.recording import open_recording
from sogjax.run.backwards import frames_backwards
from sogjax.run.build import cell_grids
from sogjax.run.cells import cells_of, cells_of_clip, picture_reader
from sogjax.run.pipeline import Preparation
from sogjax.settings.method import ImagesConfig

DEPTH = 4


@pytest.fixture
def walk(tmp_path):
    return make_recording(tmp_path / "walk")


def cells(folder, cache, frames=(0, 4), depth=DEPTH):
    """Cells of a recording, and how many frames had to be decoded for them."""
    recording = open_recording(folder)
    read = picture_reader(ImagesConfig(depth=depth, cache=None if cache is None else str(cache)))
    taken = list(read(recording, Preparation(cell_grids(recording, depth)), *frames))
    decoded = sum(any(picture.seconds > 0.0 for picture in pictures) for pictures in taken)
    return np.stack([cells_of(pictures) for pictures in taken]), decoded


def array_and_note(cache):
    (array,), (note,) = cache.glob("*.npy"), cache.glob("*.json")
    return array, note


def test_kept_cells_are_those_of_the_videos(walk, tmp_path):
    cache = tmp_path / "cache"
    direct, _ = cells(walk, None)
    first, decoded = cells(walk, cache)
    again, decoded_again = cells(walk, cache)
    assert (decoded, decoded_again) == (4, 0)
    np.testing.assert_array_equal(first, direct)
    np.testing.assert_array_equal(again, direct)
    assert sorted(path.suffix for path in cache.iterdir()) == [".json", ".npy"]


def test_a_part_of_what_was_kept_is_found_and_more_is_decoded(walk, tmp_path):
    cache = tmp_path / "cache"
    kept, _ = cells(walk, cache, (1, 4))
    part, decoded = cells(walk, cache, (2, 3))
    assert decoded == 0
    np.testing.assert_array_equal(part, kept[1:2])
    assert cells(walk, cache, (0, 2))[1] == 2
    assert cells(walk, cache, (0, 2))[1] == 0


def test_other_depths_and_other_recordings_have_their_own_cells(walk, tmp_path):
    cache = tmp_path / "cache"
    coarse, fine = cells(walk, cache)[0], cells(walk, cache, depth=DEPTH + 1)[0]
    assert fine.shape[2] > coarse.shape[2]
    other = make_recording(tmp_path / "other" / "walk")
    write_video(other / "videos" / "left.mp4", 3)
    assert cells(other, cache)[1] == 4
    np.testing.assert_array_equal(cells(walk, cache)[0], coarse)


def test_a_changed_recording_is_decoded_again_and_said(walk, tmp_path, capsys):
    cache = tmp_path / "cache"
    before, _ = cells(walk, cache)
    write_video(walk / "videos" / "right.mp4", 4)
    after, decoded = cells(walk, cache)
    assert decoded == 4
    assert np.abs(after.astype(int) - before.astype(int)).max() > 100
    assert "was made from other files" in capsys.readouterr().err
    np.testing.assert_array_equal(after, cells(walk, None)[0])
    assert cells(walk, cache)[1] == 0
    (walk / "recording.yaml").write_text("up: z\nframe_offset: {left: 1}\nlast_frame: 2\n")
    assert cells(walk, cache, (0, 3))[1] == 3
    assert "was made from other files or settings" in capsys.readouterr().err


def test_a_changed_image_of_a_folder_is_noticed(walk, tmp_path):
    (walk / "videos" / "left.mp4").unlink()
    write_images(walk / "images" / "left")
    cache = tmp_path / "cache"
    cells(walk, cache)
    assert cells(walk, cache)[1] == 0
    write_images(walk / "images" / "left", camera=2)
    assert cells(walk, cache)[1] == 4


@pytest.mark.parametrize("damage", ["cut short", "one bit", "no array", "no note", "no number", "empty"])
def test_damaged_cells_are_never_used(walk, tmp_path, capsys, damage):
    cache = tmp_path / "cache"
    whole, _ = cells(walk, cache)
    array, note = array_and_note(cache)
    content = bytearray(array.read_bytes())
    if damage == "cut short":
        array.write_bytes(content[:-100])
    elif damage == "one bit":
        content[-50] ^= 1
        array.write_bytes(content)
    elif damage == "no array":
        array.unlink()
    elif damage == "no number":
        note.write_text(json.dumps(json.loads(note.read_text()) | {"first_frame": {}}))
    elif damage == "empty":
        array.write_bytes(b"")
    else:
        note.write_text(json.dumps({"made_from": 1})[:-1])
    again, decoded = cells(walk, cache)
    assert decoded == 4
    np.testing.assert_array_equal(again, whole)
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("images.cache: ")
    assert line.endswith("it is made again")
    assert cells(walk, cache)[1] == 0


def test_an_interrupted_run_keeps_nothing(walk, tmp_path):
    cache = tmp_path / "cache"
    recording = open_recording(walk)
    read = picture_reader(ImagesConfig(depth=DEPTH, cache=str(cache)))
    frames = read(recording, Preparation(cell_grids(recording, DEPTH)), 0, 4)
    next(frames)
    assert isinstance(frames, Generator)
    frames.close()
    assert list(cache.iterdir()) == []


def test_outputs_that_show_pictures_still_get_them(walk, tmp_path):
    recording, cache = open_recording(walk), tmp_path / "cache"
    kept, _ = cells(walk, cache)
    shown = Preparation(cell_grids(recording, DEPTH), tile=lambda camera, image: image)
    pictures = list(picture_reader(ImagesConfig(depth=DEPTH, cache=str(cache)))(recording, shown, 0, 4))
    assert all(picture.tile is not None for frame in pictures for picture in frame)
    np.testing.assert_array_equal(np.stack([cells_of(frame) for frame in pictures]), kept)


def test_a_clip_is_the_stack_of_its_frames(walk, tmp_path):
    recording = open_recording(walk)
    grids = cell_grids(recording, DEPTH)
    expected, _ = cells(walk, None, (1, 3))
    for cache in (None, str(tmp_path / "cache"), str(tmp_path / "cache")):
        clip = cells_of_clip(recording, grids, ImagesConfig(depth=DEPTH, cache=cache), (1, 3))
        np.testing.assert_array_equal(clip, expected)
    assert isinstance(clip, np.memmap)


@pytest.mark.slow
def test_tracking_with_and_without_kept_cells_gives_one_motion(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    actor = actor_file(tmp_path / "actor.yaml")
    light = ("outputs.overlay=false", "outputs.rerun=false", "outputs.bvh=false", "solver.max_iterations=12")
    words = ("track", f"recording={trackable(tmp_path / 'walk')}", f"actor={actor}", "images.depth=4", *light)
    done(capsys, *words, "out=plain")
    done(capsys, *words, "images.cache=kept cells", "out=making")
    out, _ = done(capsys, *words, "images.cache=kept cells", "out=using")
    assert "averaging pictures" not in out
    poses = [load_motion(tmp_path / name / "motion.npz").pose for name in ("plain", "making", "using")]
    np.testing.assert_array_equal(poses[0], poses[1])
    np.testing.assert_array_equal(poses[0], poses[2])


def test_a_cache_that_is_a_file_is_refused(capsys, tmp_path):
    (tmp_path / "cells").write_text("")
    walk = trackable(tmp_path / "walk")
    words = (f"actor={actor_file(tmp_path / 'a.yaml')}", f"images.cache={tmp_path / 'cells'}", f"out={tmp_path / 'o'}")
    words = (*words, "images.background=none")
    assert "no folder can be made there" in refused(capsys, "track", f"recording={walk}", *words)


def test_kept_cells_are_checked_once_for_many_parts_of_a_clip(walk, tmp_path, monkeypatch):
    """Else a long clip would be read as a whole for each stretch that is tracked backwards."""
    cells(walk, tmp_path / "cache")
    checked, crc32 = [], zlib.crc32
    monkeypatch.setattr(cell_cache.zlib, "crc32", lambda *found: checked.append(1) or crc32(*found))
    recording = open_recording(walk)
    images = ImagesConfig(depth=DEPTH, cache=str(tmp_path / "cache"))
    for first in range(3):
        assert len(list(frames_backwards(recording, cell_grids(recording, DEPTH), images, first, first + 1))) == 1
    assert len(checked) == 1
