"""Images of a recording arrive complete, in order and in step; videos that are written are whole."""

import dataclasses
import gc
import os
import threading
from pathlib import Path

import cv2
import numpy as np
import pytest
from full_disk import files_of_at_most
from small_recording import (
    FPS,
    frame_image,
    frame_of,
    make_recording,
    shared_recording,
    toml_camera,
    write_calibration,
    write_image,
    write_images,
    write_video,
)

from sogjax.errors import InputError
from sogjax.io import source
from sogjax.io.image_file import read_image, read_mask
from sogjax.io.recording import open_recording
from sogjax.io.video import VideoWriter, read_chosen, read_frames
from sogjax.io.video_file import frame_times


def frames_read(recording, *span):
    return [[frame_of(image) for image in images] for images in read_frames(recording, *span)]


def test_all_frames_of_all_cameras_in_the_rigs_order(tmp_path):
    recording = open_recording(make_recording(tmp_path / "r", frames=6))
    steps = list(read_frames(recording))
    assert [[frame_of(image) for image in images] for images in steps] == [[t, t] for t in range(6)]
    left, right = steps[0]
    assert left.dtype == np.uint8
    assert left.shape == (48, 64, 3)
    assert left[:, 16].mean() < 45 < right[:, 16].mean()


@pytest.mark.parametrize("span", [(0, 3), (2, 5), (5, None), (3, 3), (0, 99)])
def test_start_and_stop(tmp_path, span):
    recording = open_recording(make_recording(tmp_path / "r", frames=6))
    assert frames_read(recording, *span) == [[t, t] for t in range(6)[span[0] : span[1]]]


def test_a_span_outside_the_recording_is_an_error_of_the_caller(tmp_path):
    recording = open_recording(make_recording(tmp_path / "r"))
    for span in [(-1, 2), (3, 2), (9, None)]:
        with pytest.raises(ValueError, match="0 to 3"):
            read_frames(recording, *span)


def test_offsets_and_first_frame(tmp_path):
    """Frame t of a camera is frame t + offset of its file; start is a number of the recording."""
    yaml = "up: z\nframe_offset: {left: 2, right: -1}\nfirst_frame: 2\nlast_frame: 4\n"
    recording = open_recording(make_recording(tmp_path / "r", frames=8, settings=yaml))
    assert frames_read(recording) == [[4, 1], [5, 2], [6, 3]]
    assert frames_read(recording, 3, 4) == [[5, 2]]


@pytest.mark.parametrize("gap", [0, 2, 99])
@pytest.mark.parametrize("start", [0, 2])
def test_chosen_frames_are_those_of_the_whole_however_they_are_reached(tmp_path, monkeypatch, gap, start):
    monkeypatch.setattr("sogjax.io.video.WORTH_A_JUMP", gap)
    yaml = f"up: z\nframe_offset: {{left: {start}, right: -1}}\nfirst_frame: 1\n"
    recording = open_recording(make_recording(tmp_path / "r", frames=8, settings=yaml))
    found = [(frame, [frame_of(image) for image in images]) for frame, images in read_chosen(recording, [5, 1, 2, 5])]
    assert found == [(t, [t + start, t - 1]) for t in (1, 2, 5)]
    assert list(read_chosen(recording, [])) == []


def test_image_folders_are_read_as_videos_are(tmp_path):
    folder = make_recording(tmp_path / "r", cameras=(), settings="up: z\nframe_offset: {left: 1}\n")
    write_calibration(folder, toml_camera("left"), toml_camera("right"))
    write_images(folder / "images" / "left", first=98, frames=5)
    write_video(folder / "videos" / "right.mp4")
    assert frames_read(open_recording(folder), 1) == [[2, 1], [3, 2], [4, 3]]


def test_decoding_runs_ahead_of_the_consumer_in_other_threads(tmp_path, monkeypatch):
    folder = make_recording(tmp_path / "r", cameras=(), settings="up: z\nfps: 25\n")
    write_calibration(folder, toml_camera("left"), toml_camera("right"))
    for camera in ("left", "right"):
        write_images(folder / "images" / camera)
    recording = open_recording(folder)
    read_by = []

    def spy(path):
        read_by.append(threading.get_ident())
        return read_image(path)

    monkeypatch.setattr(source, "read_image", spy)
    frames = read_frames(recording)
    next(frames)
    for _ in range(200):
        if len(read_by) == 4:
            break
        threading.Event().wait(0.01)
    assert len(read_by) == 4, "two cameras, the first frame and the one ahead"
    assert threading.get_ident() not in read_by


def open_files(folder):
    return [fd for fd in Path("/proc/self/fd").iterdir() if os.path.realpath(fd).startswith(str(folder))]


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="needs /proc to see the open files")
def test_a_consumer_that_stops_early_leaves_nothing_open(tmp_path):
    recording = open_recording(make_recording(tmp_path / "r"))
    assert open_files(tmp_path) == []
    threads = threading.active_count()
    frames = read_frames(recording)
    next(frames)
    assert len(open_files(tmp_path)) == 2
    frames.close()  # pyright: ignore[reportAttributeAccessIssue]
    gc.collect()
    assert open_files(tmp_path) == []
    assert threading.active_count() == threads


def test_a_header_that_promises_too_many_frames_is_found_out(tmp_path):
    folder = make_recording(tmp_path / "r", cameras=())
    write_calibration(folder, toml_camera("left"))
    video = folder / "videos" / "left.avi"
    write_video(video, frames=18)
    video.write_bytes(video.read_bytes()[: video.stat().st_size * 8 // 10])
    recording = open_recording(folder)
    assert 2 < recording.num_frames < 18
    assert frames_read(recording) == [[t] for t in range(recording.num_frames)]


def test_a_video_taken_sideways_is_turned_upright(tmp_path):
    """Phones store portrait videos lying, with a matrix in the track header; 90 degrees are written into it here."""
    folder = make_recording(tmp_path / "r", cameras=("left",))
    video = folder / "videos" / "left.mp4"
    content = bytearray(video.read_bytes())
    matrix = content.index(b"tkhd") + 44
    assert content[matrix : matrix + 4] == b"\0\1\0\0"
    content[matrix : matrix + 20] = np.array([0, 1 << 16, 0, -1 << 16, 0], ">i4").tobytes()
    video.write_bytes(content)
    write_calibration(folder, toml_camera("left", size="[48, 64]"))
    image = next(read_frames(open_recording(folder), 1))[0]
    assert image.shape == (64, 48, 3)
    np.testing.assert_allclose(image, cv2.rotate(frame_image(0, 1), cv2.ROTATE_90_CLOCKWISE), atol=6)


def test_a_video_that_ends_early_is_one_sentence(tmp_path):
    folder = make_recording(tmp_path / "r", frames=6)
    recording = open_recording(folder)
    write_video(folder / "videos" / "right.mp4", frames=3)
    with pytest.raises(InputError, match=r"right\.mp4: ends before frame 3.*last_frame: 2"):
        list(read_frames(recording))


def damaged(video, kept):
    """Overwrite the images of a video behind a part of them; the list of images stays as it is."""
    content = bytearray(video.read_bytes())
    start, stop = content.index(b"mdat") + 4, content.index(b"moov") - 4
    middle = start + round(kept * (stop - start))
    content[middle:stop] = bytes(stop - middle)
    video.write_bytes(content)


def last_readable(video):
    """The number of the last image that OpenCV gives."""
    capture, count = cv2.VideoCapture(str(video)), 0
    while capture.read()[0]:
        count += 1
    capture.release()
    return count - 1


@pytest.mark.parametrize("gap", [3, 99])
@pytest.mark.parametrize("planes", [True, False])
def test_of_a_damaged_video_the_last_frame_that_can_be_read_is_named(tmp_path, monkeypatch, planes, gap):
    """Also where the next frame that is wanted lies far behind it, by a jump or past others."""
    monkeypatch.setattr("sogjax.io.video.WORTH_A_JUMP", gap)
    if not planes:
        monkeypatch.setattr(source, "plane_video", lambda *_: None)
    yaml = "up: z\nframe_offset: {right: 2}\nfirst_frame: 1\n"
    folder = make_recording(tmp_path / "r", frames=16, settings=yaml)
    damaged(folder / "videos" / "right.mp4", 0.5)
    last = last_readable(folder / "videos" / "right.mp4") - 2
    assert 2 < last < 11
    recording = open_recording(folder)
    for wanted in ([1, 13], [1, 12, 13], [13]):
        with pytest.raises(InputError, match=rf"right\.mp4: ends before frame {last + 1},.*`last_frame: {last}`"):
            list(read_chosen(recording, wanted))
    (folder / "recording.yaml").write_text(f"{yaml}last_frame: {last}\n")
    assert frames_read(open_recording(folder)) == [[t, t + 2] for t in range(1, last + 1)]


def test_of_a_video_without_any_frame_that_can_be_read_none_is_named(tmp_path):
    folder = make_recording(tmp_path / "r", frames=16, settings="up: z\nfirst_frame: 12\n")
    damaged(folder / "videos" / "right.mp4", 0.5)
    with pytest.raises(InputError, match=r"right\.mp4: ends before frame 12, .*; convert the video again") as error:
        list(read_chosen(open_recording(folder), [14]))
    assert "last_frame" not in str(error.value)


def test_a_video_that_vanishes_or_changes_size_is_one_sentence(tmp_path):
    folder = make_recording(tmp_path / "r")
    recording = open_recording(folder)
    write_video(folder / "videos" / "right.mp4", size=(32, 32))
    with pytest.raises(InputError, match=r"right\.mp4.*32x32"):
        list(read_frames(recording))
    (folder / "videos" / "right.mp4").unlink()
    with pytest.raises(InputError, match=r"right\.mp4"):
        list(read_frames(recording))


def test_an_image_of_another_size_among_others_is_named(tmp_path):
    folder = make_recording(tmp_path / "r", cameras=(), settings="up: z\nfps: 25\n")
    write_calibration(folder, toml_camera("left"))
    write_images(folder / "images" / "left")
    write_image(folder / "images" / "left" / "000002.png", frame_image(0, 0, (32, 32)))
    with pytest.raises(InputError, match=r"000002\.png: is 32x32"):
        list(read_frames(open_recording(folder)))


@pytest.mark.parametrize("name", ["rendered_walk", "real_tpose", "real_turning"])
def test_seeking_is_exact_in_real_videos(name):
    folder = shared_recording(name)
    if folder is None:
        pytest.skip(f"there is no recording {name} beside the project")
    recording = open_recording(folder)
    recording = dataclasses.replace(recording, rig=recording.rig.select(recording.rig.names[:2]))
    start = recording.num_frames - 3
    images, (_, picked) = next(iter(read_frames(recording, start))), next(read_chosen(recording, [start]))
    for camera, image, same in zip(recording.rig.names, images, picked, strict=True):
        capture = cv2.VideoCapture(str(recording.sources[camera]))
        for _ in range(start + 1):
            _, expected = capture.read()
        capture.release()
        np.testing.assert_array_equal(image, expected)
        np.testing.assert_array_equal(same, expected)


def test_a_written_video_is_read_again(tmp_path):
    with VideoWriter(tmp_path / "new" / "overlay.mp4", FPS) as video:
        for frame in range(5):
            video.write(frame_image(0, frame))
        assert not (tmp_path / "new" / "overlay.mp4").exists()
    capture = cv2.VideoCapture(str(tmp_path / "new" / "overlay.mp4"))
    assert capture.get(cv2.CAP_PROP_FPS) == FPS
    assert [frame_of(capture.read()[1]) for _ in range(5)] == [0, 1, 2, 3, 4]
    assert not capture.read()[0]
    capture.release()
    assert list((tmp_path / "new").iterdir()) == [tmp_path / "new" / "overlay.mp4"]


def test_a_video_is_whole_or_not_there(tmp_path):
    def write(*images):
        with VideoWriter(tmp_path / "a.mp4", FPS) as video:
            for image in images:
                video.write(image)

    with pytest.raises(ValueError, match="no image"):
        write()
    with pytest.raises(ValueError, match="shape"):
        write(frame_image(0, 0), frame_image(0, 0, (32, 32)))
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(InputError, match=r"a\.avi"):
        VideoWriter(tmp_path / "a.avi", FPS)


def test_images_and_masks(tmp_path):
    image = np.random.default_rng(0).integers(0, 255, (12, 17, 3), np.uint8)
    write_image(tmp_path / "image.png", image)
    np.testing.assert_array_equal(read_image(tmp_path / "image.png"), image)
    write_image(tmp_path / "mask.png", np.array([[0, 127], [128, 255]], np.uint8))
    assert read_mask(tmp_path / "mask.png").tolist() == [[False, False], [True, True]]
    with pytest.raises(InputError, match=r"absent\.png"):
        read_image(tmp_path / "absent.png")


@pytest.mark.parametrize("size", [10, 3000])
def test_a_video_for_which_there_is_no_room_is_refused(tmp_path, size):
    """The codec says nothing of it."""

    def write():
        chance = np.random.default_rng(0)
        with VideoWriter(tmp_path / "a.mp4", FPS) as video:
            for _ in range(20):
                video.write(chance.integers(0, 255, (48, 64, 3), np.uint8))

    with files_of_at_most(size), pytest.raises(InputError, match=r"a\.mp4: (could not|a video).*be written") as error:
        write()
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []
    write()
    assert len(frame_times(tmp_path / "a.mp4")) == 20
