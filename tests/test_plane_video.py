"""Videos in their own colours (PyAV): the same cells and the same frames as OpenCV's pictures."""

import sys
from dataclasses import replace
from fractions import Fraction
from itertools import islice

import cv2
import numpy as np
import pytest
from small_recording import make_recording, shared_recording, toml_camera, write_calibration, write_video

from sogjax.io import plane_video as module
from sogjax.io import video_file
from sogjax.io.plane_video import PlaneVideo, plane_video
from sogjax.io.recording import open_recording
from sogjax.io.source import open_with_least_work
from sogjax.io.video import read_chosen, read_frames, read_prepared
from sogjax.io.video_file import VideoFile
from sogjax.model.yuv_picture import YuvPicture
from sogjax.run.clip import Clip
from sogjax.scene.cells import CellGrid, padded_cells

av = pytest.importorskip("av")

MEAN = 0.6
"""Grey levels between the cells of one picture, on average: both are rounded to bytes."""
WORST = 3
"""Levels in any cell without saturated pixels: what FFmpeg's converter drops is taken off on average only."""


def painted(frame, size):
    """A smooth picture with noise, whose colours are far from saturated and change with the frame."""
    width, height = size
    rng = np.random.default_rng(frame)
    patches = rng.integers(70, 180, (9, 12, 3), np.uint8)
    noise = rng.normal(0.0, 3.0, (height, width, 3))
    return np.clip(cv2.resize(patches, size, interpolation=cv2.INTER_CUBIC) + noise, 0, 255).astype(np.uint8)


def painted_video(path, size=(208, 116), frames=6, kind="yuv420p", colors=None):
    """MPEG-4 as OpenCV writes it; with a kind of pixels or colours, H.264."""
    with av.open(str(path), "w") as container:
        plain = kind == "yuv420p" and colors is None
        stream = container.add_stream("mpeg4" if plain else "libx264", rate=25, bit_rate=20_000_000)
        stream.width, stream.height = size
        stream.pix_fmt = kind
        if colors is not None:
            stream.codec_context.colorspace = colors
        for frame in range(frames):
            image = av.VideoFrame.from_ndarray(painted(frame, size), format="bgr24").reformat(format=kind)
            if colors is not None:
                image.colorspace = colors
            container.mux(stream.encode(image))
        container.mux(stream.encode())
    return path


def cells_of(image, depth):
    grid = CellGrid.from_depth(image.shape[1], image.shape[0], depth)
    return padded_cells(image, grid, (grid.rows, grid.columns)).astype(int)


def images_of(stream):
    found = []
    while (image := stream.read()) is not None:
        found.append(image)
    return found


@pytest.mark.parametrize(
    ("kind", "colors", "depth"),
    [("yuv420p", None, 8), ("yuv420p", None, 7), ("yuv420p", None, 5), ("yuvj420p", None, 6), ("yuv420p", 1, 6)],
)
def test_cells_are_those_of_pictures(tmp_path, kind, colors, depth):
    path = painted_video(tmp_path / "video.mp4", kind=kind, colors=colors)
    found, expected = images_of(plane_video(path, 0, 1)), images_of(VideoFile(path, 0, 1))
    assert len(found) == len(expected) == 6
    for planes, picture in zip(found, expected, strict=True):
        assert isinstance(planes, YuvPicture)
        difference = np.abs(cells_of(planes, depth) - cells_of(picture, depth))
        assert difference.mean() < MEAN
        assert difference.max() <= WORST


def test_cells_of_a_real_recording():
    folder = shared_recording("rendered_walk")
    if folder is None:
        pytest.skip("there is no recording rendered_walk beside the project")
    source = open_recording(folder).sources["cam03"]
    differences = [
        cells_of(planes, 8) - cells_of(picture, 8)
        for planes, picture in zip(
            images_of(plane_video(source, 30, 1)), images_of(VideoFile(source, 30, 1)), strict=True
        )
    ]
    assert abs(np.mean(differences)) < 0.3
    assert np.percentile(np.abs(differences), 99) <= 1


@pytest.mark.parametrize("start", [1, 4, 12, 25, 29])
def test_seeking_is_exact(tmp_path, start):
    path = painted_video(tmp_path / "video.mp4", size=(64, 48), frames=30)
    everything = images_of(plane_video(path, 0, 1))
    rest = images_of(plane_video(path, start, 2))
    assert len(rest) == 30 - start
    for found, expected in zip(rest, everything[start:], strict=True):
        np.testing.assert_array_equal(found.luma, expected.luma)


BARS = 6
"""Bits of a frame's number, shown as black and white bars."""


def numbered_video(path, codec, options, when, rate=30):
    """Images that show their numbers; `when` says at which frame time each is to be shown."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=rate, options=options)
        stream.width, stream.height, stream.pix_fmt = 16 * BARS, 32, "yuv420p"
        stream.codec_context.time_base = Fraction(1, 10 * rate)
        for number, time in enumerate(when):
            bits = [255 * (number >> bit & 1) for bit in range(BARS)]
            picture = np.broadcast_to(np.repeat(np.uint8(bits), 16)[None, :, None], (32, 16 * BARS, 3))
            image = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="bgr24")
            image.pts, image.time_base = round(10 * time), Fraction(1, 10 * rate)
            container.mux(stream.encode(image))
        container.mux(stream.encode())
    return path


def number_shown(image):
    shown = image.luma if isinstance(image, YuvPicture) else image[..., 0]
    return sum((int(bar.mean()) > 127) << bit for bit, bar in enumerate(np.split(shown.astype(int), BARS, axis=1)))


EVENLY = range(60)
VIDEOS = {
    "AVI of H.264": ("video.avi", "libx264", {"bf": "0"}, EVENLY),
    "AVI of H.264 with B-frames": ("video.avi", "libx264", {"bf": "2"}, EVENLY),
    "AVI of MPEG-4 with B-frames": ("video.avi", "mpeg4", {"bf": "2", "g": "12"}, EVENLY),
    "AVI whose second packet is a key frame": ("video.avi", "mpeg4", {"bf": "2", "g": "3"}, EVENLY),
    "mp4 with B-frames": ("video.mp4", "libx264", {"bf": "2", "g": "12"}, EVENLY),
    "mkv": ("video.mkv", "libx264", {"g": "12"}, EVENLY),
    "three images missing": ("video.mp4", "libx264", {"g": "12"}, [k + 3 * (k > 10) for k in EVENLY]),
    "one image missing": ("video.mp4", "libx264", {"g": "12"}, [k + (k > 10) for k in EVENLY]),
    "times that are not even": ("video.mp4", "libx264", {"g": "12"}, [k + 0.3 * (k % 3 == 1) for k in EVENLY]),
}


@pytest.mark.parametrize("name", VIDEOS)
def test_all_readers_begin_with_the_image_of_that_number(tmp_path, name):
    file, *how = VIDEOS[name]
    path = numbered_video(tmp_path / file, *how)
    for start in (1, 7, 12, 20, 31, 45, 58):
        for stream in (open_with_least_work(path, start), VideoFile(path, start, 1)):
            assert [number_shown(image) for image in images_of(stream)] == [*range(start, 60)], (start, stream)


@pytest.mark.parametrize("name", VIDEOS)
def test_the_reader_does_not_depend_on_the_start(tmp_path, name):
    """Else a resumed run would not get the cells of an undisturbed one."""
    file, *how = VIDEOS[name]
    path = numbered_video(tmp_path / file, *how)
    everything = images_of(plane_video(path, 0, 1))
    for start in (1, 2, 3, 20, 59):
        rest = images_of(plane_video(path, start, 1))
        assert len(rest) == 60 - start
        for found, expected in zip(rest, everything[start:], strict=True):
            np.testing.assert_array_equal(found.luma, expected.luma)


def test_images_are_counted_where_jumping_fails(tmp_path, monkeypatch):
    def fail(path):
        raise av.error.ExternalError(1, "nothing of Python's")

    monkeypatch.setattr(module, "_times", fail)
    file, *how = VIDEOS["mp4 with B-frames"]
    stream = plane_video(numbered_video(tmp_path / file, *how), 20, 1)
    assert isinstance(stream, PlaneVideo)
    assert number_shown(stream.read()) == 20


def test_missing_images_of_large_videos_are_seen_too(tmp_path, monkeypatch):
    monkeypatch.setattr(video_file, "_COUNT_PACKETS_BELOW", 0)
    file, *how = VIDEOS["three images missing"]
    path = numbered_video(tmp_path / file, *how)
    for start in (12, 31, 45):
        assert number_shown(VideoFile(path, start, 1).read()) == start


def test_full_range_without_a_format_of_its_own_is_left_to_opencv(tmp_path):
    path = tmp_path / "video.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libvpx-vp9", rate=25, bit_rate=20_000_000)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        stream.codec_context.color_range = 2
        container.mux(stream.encode(av.VideoFrame.from_ndarray(painted(0, (64, 48)), format="bgr24")))
        container.mux(stream.encode())
    video = plane_video(path, 0, 1)
    (expected,) = images_of(VideoFile(path, 0, 1))
    found = expected if video is None else video.read()
    assert np.abs(cells_of(found, 4) - cells_of(expected, 4)).mean() < MEAN


def test_skipping(tmp_path):
    path = painted_video(tmp_path / "video.mp4", size=(64, 48))
    stream, everything = plane_video(path, 0, 1), images_of(plane_video(path, 0, 1))
    stream.skip()
    np.testing.assert_array_equal(stream.read().luma, everything[1].luma)
    stream.close()
    assert stream.read() is None


def test_rare_kinds_are_left_to_opencv(tmp_path):
    path = painted_video(tmp_path / "video.mp4", kind="yuv422p")
    assert plane_video(path, 0, 1) is None
    assert isinstance(open_with_least_work(path), VideoFile)


@pytest.mark.parametrize("content", [b"", b"no video at all" * 100])
def test_what_is_no_video_is_left_to_opencv(tmp_path, content):
    path = tmp_path / "video.mp4"
    path.write_bytes(content)
    assert plane_video(path, 0, 1) is None


@pytest.mark.parametrize("start", [0, 2])
def test_a_pyav_too_old_is_not_used(tmp_path, monkeypatch, start):
    """One without `VideoFrame.rotation`; the file that it opened is closed."""
    path, opened = painted_video(tmp_path / "video.mp4", size=(64, 48)), []

    def without_rotation(image):
        raise AttributeError("rotation")

    class Watched(PlaneVideo):
        def __init__(self, container, threads, smooth):
            opened.append(container)
            super().__init__(container, threads, smooth)

    monkeypatch.setattr(module, "_known", without_rotation)
    monkeypatch.setattr(module, "PlaneVideo", Watched)
    assert isinstance(open_with_least_work(path, start), VideoFile)
    (container,) = opened
    with pytest.raises(AssertionError, match="not open"):
        next(container.demux(video=0))


def test_an_error_of_ffmpeg_alone_ends_a_video(tmp_path):
    class Damaged:
        def __init__(self, container):
            self.streams, self._container = container.streams, container

        def demux(self, video):
            yield from islice(self._container.demux(video=video), 3)
            raise av.error.ExternalError(1, "nothing of Python's")

    with av.open(str(painted_video(tmp_path / "video.mp4", size=(64, 48)))) as container:
        assert 0 < len(images_of(PlaneVideo(Damaged(container), 1, False))) <= 3


def test_without_pyav_opencv_reads(tmp_path, monkeypatch):
    folder = make_recording(tmp_path / "r")
    monkeypatch.setitem(sys.modules, "av", None)
    assert module.pyav_version() is None
    recording = open_recording(folder)
    images = next(iter(read_prepared(recording, lambda camera, frame, image: image, planes=True)))
    assert all(isinstance(image, np.ndarray) for image in images)


def test_pictures_are_made_for_what_shows_them(tmp_path):
    """And the cells are the same then."""
    recording = open_recording(make_recording(tmp_path / "r"))
    clip = Clip(recording, recording.frames, 4)
    plain = list(clip.read(clip.numbers))
    shown = list(clip.read(clip.numbers, lambda camera, frame, image: image))
    for few, more, images in zip(plain, shown, read_frames(recording), strict=True):
        assert few.pictures == [None] * len(images)
        np.testing.assert_array_equal(few.input.cells, more.input.cells)
        for picture, image in zip(more.pictures, images, strict=True):
            np.testing.assert_allclose(picture.astype(int), image.astype(int), atol=2)


def test_evened_colours_are_those_of_pictures(tmp_path):
    settings = "up: z\ncolor_gains:\n  left: [1.2, 1.0, 0.9]\n"
    recording = open_recording(make_recording(tmp_path / "r", settings=settings))
    left, right = next(iter(read_prepared(recording, lambda camera, frame, image: image, planes=True)))
    assert isinstance(left, np.ndarray)
    assert isinstance(right, YuvPicture)
    np.testing.assert_array_equal(left, next(iter(read_frames(recording)))[0])


def test_chosen_frames_have_evened_colours(tmp_path):
    settings = "up: z\ncolor_gains:\n  left: [1.2, 1.0, 0.9]\n"
    recording = open_recording(make_recording(tmp_path / "r", settings=settings))
    (_, (left, right)), *_ = read_chosen(recording, [2])
    expected, _ = next(iter(read_frames(recording, 2, 3)))
    np.testing.assert_array_equal(left, expected)
    (_, (as_filmed, _)), *_ = read_chosen(replace(recording, color_gains={}), [2])
    assert (left != as_filmed).any()
    assert isinstance(right, np.ndarray)


@pytest.mark.parametrize("gap", [4, 99])
@pytest.mark.parametrize("name", ["mp4 with B-frames", "AVI of H.264 with B-frames"])
def test_chosen_frames_are_found_by_jumps_and_without(tmp_path, monkeypatch, name, gap):
    monkeypatch.setattr("sogjax.io.video.WORTH_A_JUMP", gap)
    file, *how = VIDEOS[name]
    folder = make_recording(tmp_path / "r", cameras=(), settings="up: z\n")
    write_calibration(folder, *(toml_camera(camera, size=f"[{16 * BARS}, 32]") for camera in ("left", "right")))
    for camera in ("left", "right"):
        (folder / "videos").mkdir(exist_ok=True)
        numbered_video(folder / "videos" / f"{camera}.{file.rsplit('.')[-1]}", *how)
    chosen = [1, 3, 11, 12, 30, 55]
    shown = read_chosen(open_recording(folder), chosen)
    assert [(frame, [number_shown(image) for image in images]) for frame, images in shown] == [
        (frame, [frame, frame]) for frame in chosen
    ]


def test_a_damaged_video_ends_where_it_does_with_opencv(tmp_path):
    path = tmp_path / "video.mp4"
    write_video(path, frames=8)
    content = bytearray(path.read_bytes())
    middle = content.index(b"mdat") + 4 + (content.index(b"moov") - content.index(b"mdat")) // 2
    content[middle : middle + 40] = bytes(40)
    path.write_bytes(content)
    assert len(images_of(plane_video(path, 0, 1))) == len(images_of(VideoFile(path, 0, 1)))


def test_the_version_is_told():
    assert module.pyav_version() == av.__version__
