"""Kept cells: the same as those of the videos, and made again where they may not be."""

import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from command_line import actor_file, done, refused, trackable
from small_recording import make_recording, write_images, write_video

from sogjax.errors import InputError
from sogjax.io.cell_store import CELLS, FRAMES, MADE_FROM, CellStore
from sogjax.io.motion import load_motion
from sogjax.io.recording import open_recording
from sogjax.run import clip as clip_module
from sogjax.run.clip import Clip, SampleKind

DEPTH = 4


@pytest.fixture
def walk(tmp_path):
    return make_recording(tmp_path / "walk")


@pytest.fixture
def decoded(monkeypatch):
    """The frames whose pictures are cut into cells."""
    seen, whole = [], clip_module._Preparation.__call__

    def call(self, camera, frame, image):
        if frame not in self.known and camera == 0:
            seen.append(frame)
        return whole(self, camera, frame, image)

    monkeypatch.setattr(clip_module._Preparation, "__call__", call)
    return seen


def opened(folder, cache=None, depth=DEPTH):
    recording = open_recording(folder)
    clip = Clip(recording, recording.frames, depth)
    return clip if cache is None else clip.kept_in(cache, str(cache))


def cells(clip, *span):
    found = np.stack([frame.cells for frame in clip.frames(*span)])
    clip.close()
    return found


def taken(decoded):
    """What was decoded since this was last asked."""
    found = [*decoded]
    decoded.clear()
    return found


def test_kept_cells_are_those_of_the_videos(walk, tmp_path, decoded):
    direct, cache = cells(opened(walk)), tmp_path / "cache"
    decoded.clear()
    np.testing.assert_array_equal(cells(opened(walk, cache)), direct)
    assert taken(decoded) == [0, 1, 2, 3]
    np.testing.assert_array_equal(cells(opened(walk, cache)), direct)
    assert taken(decoded) == []


def test_frames_that_two_threads_keep_at_once_are_all_kept(walk, tmp_path):
    store = opened(walk, tmp_path / "cache").store
    present = np.ones(store._shape[0], bool)
    content = lambda frame: np.full(store._shape, frame % 251, np.uint8)
    keep = lambda first: [store.keep(frame, content(frame), present) for frame in range(first, 400, 2)]
    with ThreadPoolExecutor(2) as pool:
        [*pool.map(keep, range(2))]
    assert store.kept(range(400)).all()
    assert all((store.find(frame)[0] == content(frame)).all() for frame in range(400))
    store.close()


def test_only_what_is_missing_is_decoded(walk, tmp_path, decoded):
    cache = tmp_path / "cache"
    kept = cells(opened(walk, cache), 1, 3)
    decoded.clear()
    np.testing.assert_array_equal(cells(opened(walk, cache), 2, 3), kept[1:])
    assert taken(decoded) == []
    every = cells(opened(walk, cache))
    assert taken(decoded) == [0, 3]
    np.testing.assert_array_equal(every[1:3], kept)


def test_a_clip_is_decoded_once_whoever_reads_it(walk, tmp_path, decoded):
    """Samples for a background, tracking and what looks at single frames; cells of all frames are kept on the way."""
    clip = opened(walk, tmp_path / "cache")
    kind = SampleKind("small", (0, 3), lambda camera, picture: picture[::4, ::4])
    (samples,) = clip.sampled([kind])
    assert [sorted(of_camera) for of_camera in samples] == [[0, 3]] * 2
    cells(clip)
    cells(clip, 2, 3)
    assert taken(decoded) == [0, 1, 2, 3]
    (again,) = opened(walk, tmp_path / "cache").sampled([kind])
    for one, other in zip(samples, again, strict=True):
        np.testing.assert_array_equal([one[k] for k in (0, 3)], [other[k] for k in (0, 3)])
    assert taken(decoded) == []


def test_other_depths_and_other_recordings_have_their_own_cells(walk, tmp_path, decoded):
    cache = tmp_path / "cache"
    coarse, fine = cells(opened(walk, cache)), cells(opened(walk, cache, DEPTH + 1))
    assert fine.shape[2] > coarse.shape[2]
    other = make_recording(tmp_path / "other" / "walk")
    write_video(other / "videos" / "left.mp4", 3)
    decoded.clear()
    cells(opened(other, cache))
    assert len(taken(decoded)) == 4
    np.testing.assert_array_equal(cells(opened(walk, cache)), coarse)


def test_a_changed_recording_is_decoded_again_and_said(walk, tmp_path, capsys, decoded):
    cache = tmp_path / "cache"
    before = cells(opened(walk, cache))
    write_video(walk / "videos" / "right.mp4", 4)
    decoded.clear()
    after = cells(opened(walk, cache))
    assert len(taken(decoded)) == 4
    assert np.abs(after.astype(int) - before.astype(int)).max() > 100
    assert "made from other files" in capsys.readouterr().err
    np.testing.assert_array_equal(after, cells(opened(walk)))
    (walk / "recording.yaml").write_text("up: z\nframe_offset: {left: 1}\nlast_frame: 2\n")
    decoded.clear()
    cells(opened(walk, cache))
    assert len(taken(decoded)) == 3
    assert "made from other files or settings" in capsys.readouterr().err


def test_a_changed_image_of_a_folder_is_noticed(walk, tmp_path, decoded):
    (walk / "videos" / "left.mp4").unlink()
    write_images(walk / "images" / "left")
    cache = tmp_path / "cache"
    cells(opened(walk, cache))
    write_images(walk / "images" / "left", camera=2)
    decoded.clear()
    cells(opened(walk, cache))
    assert len(taken(decoded)) == 4


@pytest.mark.parametrize("damage", ["cut short", "one bit", "no cells", "no note", "no list of frames", "empty"])
def test_damaged_cells_are_never_used(walk, tmp_path, capsys, damage):
    cache = tmp_path / "cache"
    whole = cells(opened(walk, cache))
    (folder,) = cache.iterdir()
    content = bytearray((folder / CELLS).read_bytes())
    if damage == "cut short":
        (folder / CELLS).write_bytes(content[:-100])
    elif damage == "one bit":
        content[-50] ^= 1
        (folder / CELLS).write_bytes(content)
    elif damage == "empty":
        (folder / CELLS).write_bytes(b"")
    elif damage == "no cells":
        (folder / CELLS).unlink()
    elif damage == "no note":
        (folder / MADE_FROM).write_text(json.dumps({"depth": 1})[:-1])
    else:
        (folder / FRAMES).unlink()
    for _ in range(2):
        np.testing.assert_array_equal(cells(opened(walk, cache)), whole)
    said = capsys.readouterr().err
    assert said.count("frame 3 are damaged; they are made again") == (damage not in ("no note", "no list of frames"))


def test_frames_are_kept_one_by_one_so_that_a_stopped_run_loses_none(walk, tmp_path, decoded):
    clip = opened(walk, tmp_path / "cache")
    frames = clip.frames()
    first = next(frames)
    frames.close()
    clip.close()
    decoded.clear()
    found = cells(opened(walk, tmp_path / "cache"))
    assert 0 not in taken(decoded)
    np.testing.assert_array_equal(found[0], first.cells)


def test_pictures_are_decoded_where_something_is_made_of_them(walk, tmp_path):
    clip = opened(walk, tmp_path / "cache")
    kept = cells(clip)
    shown = list(clip.read(clip.numbers, lambda camera, frame, image: (camera, frame, image.shape)))
    assert [frame.pictures for frame in shown] == [[(k, frame, (48, 64, 3)) for k in range(2)] for frame in range(4)]
    np.testing.assert_array_equal([frame.input.cells for frame in shown], kept)
    clip.close()


def test_a_disk_that_fills_stops_keeping_but_not_the_run(walk, tmp_path, monkeypatch, capsys):
    def full(self, *_):
        raise InputError("cells.bin: could not be written (No space left on device)")

    monkeypatch.setattr(CellStore, "keep", full)
    recording = open_recording(walk)
    clip = Clip(recording, recording.frames, DEPTH).kept_in(tmp_path, None)
    np.testing.assert_array_equal(cells(clip), cells(opened(walk)))
    assert capsys.readouterr().err.count("No space left on device") == 1
    with pytest.raises(InputError, match="No space left"):
        cells(opened(walk, tmp_path / "asked for"))


def test_a_disk_that_fills_with_samples_stops_keeping_but_not_the_run(walk, tmp_path, monkeypatch, capsys):
    def full(path, array):
        raise OSError("Not enough free space to write 56687040 bytes after offset 128")  # numpy's own, without a number

    monkeypatch.setattr(np, "save", full)
    recording = open_recording(walk)
    clip, kind = Clip(recording, recording.frames, DEPTH), SampleKind("shown", (0, 2), lambda camera, picture: picture)
    keeping = clip.kept_in(tmp_path, None)
    found = keeping.sampled([kind])[0]
    keeping.close()
    for one, other in zip(found, clip.sampled([kind])[0], strict=True):
        assert [*one] == [*other] == [0, 2]
        np.testing.assert_array_equal(one[2], other[2])
    assert "Not enough free space" in (said := capsys.readouterr().err)
    assert "decoded again" in said
    asked = opened(walk, tmp_path / "asked for")
    with pytest.raises(InputError, match="Not enough free space"):
        asked.sampled([kind])
    asked.close()


@pytest.mark.slow
def test_tracking_with_and_without_kept_cells_gives_one_motion(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    actor = actor_file(tmp_path / "actor.yaml")
    light = (
        "outputs.overlay=false",
        "outputs.rerun=false",
        "outputs.page=false",
        "outputs.bvh=false",
        "solver.max_iterations=12",
    )
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
    assert "no cells can be kept there" in refused(capsys, "track", f"recording={walk}", *words)
