"""Cameras that start late, end early or are left out for a while; videos that are turned or come unevenly."""

import struct

import jax.numpy as jnp
import numpy as np
import pytest
import yaml
from body_cases import shipped
from command_line import actor_file, done, trackable
from drawn_scene import cells_of, draw, in_colors, make_tracker, moved, standing
from rendered_person import rendered_person
from rig_cases import ring_rig
from small_recording import SIZE, frame_of, make_recording, toml_camera, write_calibration, write_video

from sogjax.check.pictures import read_clip
from sogjax.cli.main import main
from sogjax.errors import InputError
from sogjax.io import video
from sogjax.io.motion import load_motion
from sogjax.io.recording import open_recording
from sogjax.io.source import look_at_source
from sogjax.io.video import read_frames
from sogjax.run import clip
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.tracking.frame import FrameInput
from sogjax.tracking.frame_by_frame import track

LIGHT = ("outputs.overlay=false", "outputs.rerun=false", "outputs.page=false", "outputs.bvh=false")


def frames_seen(recording, *span):
    """By time step and camera the number of the frame in the picture."""
    numbers = lambda images: [None if image is None else frame_of(image) for image in images]
    return [numbers(images) for images in read_frames(recording, *span)]


def test_a_camera_that_starts_late_and_one_that_ends_early(tmp_path):
    settings = "up: z\nfewest_cameras: 1\nframe_offset: {left: -2}\n"
    folder = make_recording(tmp_path / "r", settings=settings, frames=5)  # left: 2 to 6, right: 0 to 4
    recording = open_recording(folder)
    assert (recording.first_frame, recording.num_frames) == (0, 7)
    late, both, early = [[None, k] for k in (0, 1)], [[k - 2, k] for k in (2, 3, 4)], [[3, None], [4, None]]
    assert frames_seen(recording) == late + both + early
    assert frames_seen(recording, 4, 6) == (late + both + early)[4:6]
    assert any("left 2 to 6" in warning and "right 0 to 4" in warning for warning in recording.warnings)


def test_as_many_cameras_as_asked_for_have_every_frame(tmp_path):
    settings = "up: z\nfewest_cameras: 2\nframe_offset: {a: -2, b: 1}\n"
    recording = open_recording(make_recording(tmp_path / "r", ("a", "b", "c"), settings, frames=6))
    assert (recording.first_frame, recording.num_frames) == (0, 6)  # a: 2 to 7, b: 0 to 4, c: 0 to 5
    assert all(sum(number is not None for number in numbers) >= 2 for numbers in frames_seen(recording))


def test_a_camera_that_is_left_out_for_a_while(tmp_path):
    folder = make_recording(tmp_path / "r", settings="up: z\nmissing: {right: [[1, 2]]}\n")
    expected = [[0, 0], [1, None], [2, None], [3, 3]]
    assert frames_seen(open_recording(folder)) == expected


def test_a_video_that_breaks_off_is_missing_from_there_on(tmp_path, monkeypatch):
    """It is an error where every camera is needed."""
    folder = make_recording(tmp_path / "r", settings="up: z\nfewest_cameras: 1\n")
    opened = video.open_source

    def breaking(path, *rest):
        source = opened(path, *rest)
        if path.stem == "right":
            pictures = iter([source.read(), source.read(), None, source.read()])
            source.read = lambda: next(pictures)
        return source

    monkeypatch.setattr(video, "open_source", breaking)
    assert frames_seen(open_recording(folder)) == [[0, 0], [1, 1], [2, None], [3, None]]
    (folder / "recording.yaml").write_text("up: z\n")
    with pytest.raises(InputError, match="ends before frame 2"):
        frames_seen(open_recording(folder))


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ("missing: {third: [[0, 1]]}", ("missing", "third", "left, right")),
        ("missing: {left: [[2, 1]]}", ("missing.left[0]", "[2, 1]")),
        ("missing: {left: [1, 2]}", ("missing.left[0]",)),
        ("fewest_cameras: 0", ("fewest_cameras", "0")),
    ],
)
def test_settings_with_something_wrong(tmp_path, settings, words):
    folder = make_recording(tmp_path / "r", settings=f"up: z\n{settings}\n")
    with pytest.raises(InputError) as error:
        open_recording(folder)
    assert all(word in str(error.value) for word in words)


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    """A rendered person, four cameras; its rough pose has the landmarks of the small actor."""
    folder = tmp_path_factory.mktemp("rendered") / "person"
    return rendered_person(folder, cameras=4, frames=4, width=160, height=120)


def tracked(capsys, rendered, tmp_path, name, *words):
    actor = f"actor={actor_file(tmp_path / 'a.yaml')}"
    words = (*words, "images.depth=5", "solver.max_iterations=20", *LIGHT)
    _, err = done(capsys, "track", f"recording={rendered}", actor, f"out={tmp_path / name}", *words)
    return load_motion(tmp_path / name / "motion.npz"), err


@pytest.mark.slow
def test_a_missing_camera_is_as_good_as_none():
    """Poses and energies are those without that camera, whose share of the mean goes to the others."""
    body, rig = in_colors(shipped("dog")), ring_rig(4, (160, 120), distance=1.6)
    poses = [moved(body, standing(body, 1.1), {"root_x": 0.01 * k, "root_yaw": 0.03 * k}) for k in range(3)]
    frames = [cells_of(rig, draw(body, pose, rig), 6) for pose in poses]
    present = np.array([True, False, True, True])
    partly = [FrameInput(np.where(present[:, None, None, None], cells, 0), present) for cells in frames]
    others = rig.select(tuple(name for name, here in zip(rig.names, present, strict=True) if here))
    results = lambda rig, frames: [
        tracked.result for tracked in track(make_tracker(body, rig, 6, GaussNewton()), jnp.asarray(poses[0]), frames)
    ]
    for missing, without in zip(results(rig, partly), results(others, [f[present] for f in frames]), strict=True):
        assert missing.terms["similarity"] > 0.01
        np.testing.assert_allclose(missing.terms["similarity"], without.terms["similarity"], rtol=1e-4)
        np.testing.assert_allclose(missing.pose, without.pose, atol=1e-3)
        assert missing.num_near[1] == 0


@pytest.mark.slow
def test_a_camera_that_is_missing_for_a_while_is_told(capsys, tmp_path, rendered):
    """Until then everything is to the bit as with all cameras."""
    settings = yaml.safe_load((rendered / "recording.yaml").read_text())
    camera = open_recording(rendered).rig.names[1]
    every, _ = tracked(capsys, rendered, tmp_path, "every")
    (rendered / "recording.yaml").write_text(yaml.safe_dump(settings | {"missing": {camera: [[2, 3]]}}))
    partly, err = tracked(capsys, rendered, tmp_path, "partly")
    assert f"{camera} had no picture in 2 of 4 frames" in err
    np.testing.assert_array_equal(partly.pose[:2], every.pose[:2])
    assert not np.array_equal(partly.pose[2], every.pose[2])


@pytest.mark.parametrize("light", [(), LIGHT])
@pytest.mark.slow
def test_a_run_with_missing_cameras_goes_on(capsys, tmp_path, monkeypatch, light):
    """And says of how many frames they were missing: of all, not only of those that were left to do."""
    monkeypatch.chdir(tmp_path)
    recording = trackable(tmp_path / "walk", frames=20)
    (recording / "recording.yaml").write_text("up: z\nmissing: {left: [[3, 5], [9, 12]]}\n")
    words = [f"recording={recording}", f"actor={actor_file(tmp_path / 'a.yaml')}", "images.depth=4", *light]
    words += ["outputs.overlay_width=128", "solver.max_iterations=3", "solver.min_iterations=1"]
    done(capsys, "track", *words, "out=whole")
    whole, calls = clip.padded_cells, []

    def padded_cells(*arguments):
        calls.append(1)
        if len(calls) > 28:
            raise InputError("right.mp4: ends early")
        return whole(*arguments)

    with monkeypatch.context() as context:
        context.setattr(clip, "padded_cells", padded_cells)
        assert main(["track", *words, "out=run"]) == 2
    for _ in range(2):  # at last the run has ended already
        _, err = done(capsys, "track", *words, "out=run", "resume=true")
        assert "left had no picture in 7 of 20 frames" in err
    one, two = (load_motion(tmp_path / name / "motion.npz") for name in ("run", "whole"))
    np.testing.assert_array_equal(one.pose, two.pose)
    assert light or look_at_source(tmp_path / "run" / "overlay.mp4").num_frames == 20


@pytest.mark.slow
def test_pictures_of_several_sizes_on_their_sides_and_upright(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recording = trackable(tmp_path / "walk")
    upright = SIZE[::-1]
    write_calibration(recording, toml_camera("left"), toml_camera("right", size=str(list(upright))))
    write_video(recording / "videos" / "right.mp4", 1, size=upright)
    words = (f"recording={recording}", f"actor={actor_file(tmp_path / 'a.yaml')}", "images.depth=4", "out=run")
    done(capsys, "track", *words, "outputs.overlay_width=128")
    assert load_motion(tmp_path / "run" / "motion.npz").num_frames == 4


def boxes(content, begin, end):
    """Name, begin and end of the boxes of an mp4 file between two places."""
    while begin < end:
        size, name = struct.unpack(">I4s", content[begin : begin + 8])
        yield name.decode("latin-1"), begin, begin + size
        begin += size


def box(content, *names):
    """Begins and end of nested boxes, outermost first."""
    begins, begin, end = [], 0, len(content)
    for name in names:
        begin, end = next((b, e) for n, b, e in boxes(content, begin + (8 if begins else 0), end) if n == name)
        begins.append(begin)
    return begins, end


def test_a_video_that_says_it_is_turned(tmp_path):
    """As telephones write them: the pictures come upright, and the calibration is held against that."""
    folder = make_recording(tmp_path / "r")
    path = folder / "videos" / "right.mp4"
    content = bytearray(path.read_bytes())
    _, end = box(content, "moov", "trak", "tkhd")
    quarter = struct.pack(">9i", 0, 1 << 16, 0, -(1 << 16), 0, 0, SIZE[1] << 16, 0, 1 << 30)
    content[end - 44 : end - 8] = quarter  # the matrix stands before width and height
    path.write_bytes(content)
    assert look_at_source(path).size == SIZE[::-1]
    with pytest.raises(InputError, match="turn the images by 90 degrees"):
        open_recording(folder)
    write_calibration(folder, toml_camera("left"), toml_camera("right", size=str(list(SIZE[::-1]))))
    assert next(iter(read_frames(open_recording(folder))))[1].shape == (SIZE[0], SIZE[1], 3)


def come_at(path, durations):
    """Write into an mp4 how many frames long each of its images is shown, all but the last."""
    content = bytearray(path.read_bytes())
    begins, end = box(content, "moov", "trak", "mdia", "minf", "stbl", "stts")
    count, delta = struct.unpack(">II", content[end - 8 : end])
    assert count == len(durations) + 1
    for begin in begins:
        (size,) = struct.unpack(">I", content[begin : begin + 4])
        content[begin : begin + 4] = struct.pack(">I", size + 8 * (count - 1))
    entries = [number for duration in (*durations, 1) for number in (1, int(duration * delta))]
    content[begins[-1] + 12 : end] = struct.pack(f">{1 + 2 * count}I", count, *entries)
    path.write_bytes(content.replace(b"edts", b"free"))  # the list of edits would end it at its former length


def test_a_video_whose_frames_do_not_come_evenly(tmp_path):
    folder = make_recording(tmp_path / "r", settings="up: z\nfps: 25\n", frames=8)
    assert not any("evenly" in warning for warning in open_recording(folder).warnings)
    come_at(folder / "videos" / "right.mp4", (1, 1, 1, 1, 3, 1, 1))
    (warning,) = (text for text in open_recording(folder).warnings if "evenly" in text)
    assert "right.mp4" in warning
    assert "up to 3.0 times" in warning
    assert frames_seen(open_recording(folder)) == [[k, k] for k in range(8)]


@pytest.mark.parametrize(
    ("fewest", "right", "says"),
    [
        ("", [0, 1, 2, 3, 4, 4, 5, 5], "the nearest one is taken"),
        ("fewest_cameras: 1\n", [0, 1, 2, 3, 4, None, None, 5, 6, 7], "the camera is missing there"),
    ],
)
def test_time_stamps_are_gone_by_where_asked_for(tmp_path, fewest, right, says):
    """Two images of the right camera were lost after its fifth; the left one has no image after its eighth."""
    folder = make_recording(tmp_path / "r", settings=f"up: z\nfps: 25\ntime_stamps: true\n{fewest}", frames=8)
    come_at(folder / "videos" / "right.mp4", (1, 1, 1, 1, 3, 1, 1))
    recording = open_recording(folder)
    left = [*range(8), None, None][: len(right)]
    assert frames_seen(recording) == [list(pair) for pair in zip(left, right, strict=True)]
    assert frames_seen(recording, 5) == frames_seen(recording)[5:]
    assert any("no image for 2 of its 10 frames" in warning and says in warning for warning in recording.warnings)


def test_time_stamps_of_another_rate(tmp_path):
    """A camera of half the rate shows each image twice, and an offset counts frames of the common rate."""
    folder = make_recording(tmp_path / "r", settings="up: z\nfps: 25\ntime_stamps: true\n", frames=4)
    come_at(folder / "videos" / "right.mp4", (2, 2, 2))
    recording = open_recording(folder)
    assert [pair[0] for pair in frames_seen(recording)] == [0, 1, 2, 3]
    assert [pair[1] for pair in frames_seen(recording)] in ([0, 0, 1, 1], [0, 1, 1, 2])
    (folder / "recording.yaml").write_text("up: z\nfps: 25\ntime_stamps: true\nframe_offset: {right: 2}\n")
    assert [pair[1] for pair in frames_seen(open_recording(folder))][::2] == [1, 2]


def test_checks_know_where_a_camera_is_missing(tmp_path):
    recording = open_recording(make_recording(tmp_path / "r", settings="up: z\nmissing: {right: [[1, 2]]}\n"))
    clip = read_clip(recording, 0, 4, lambda items, count, label: iter(items))
    assert clip.present.tolist() == [[True] * 4, [True, False, False, True]]
    for pictures, present in zip(clip.grey, clip.present, strict=True):
        assert [bool(picture.any()) for picture in pictures] == present.tolist()
    assert {index: list(pictures) for index, pictures in clip.stills.items()} == {1: [0], 2: [0]}


def test_times_that_jump_or_a_rate_that_cannot_be_are_refused_at_once(tmp_path):
    folder = make_recording(tmp_path / "r", settings="up: z\nfps: 25\ntime_stamps: true\n", frames=4)
    come_at(folder / "videos" / "right.mp4", (1, 100000, 1))
    with pytest.raises(InputError, match=r"right.mp4: 4 images do not make .* after image 1"):
        open_recording(folder)
    (folder / "recording.yaml").write_text("up: z\nfps: 1.0e+15\ntime_stamps: true\n")
    with pytest.raises(InputError, match="at most 10000"):
        open_recording(folder)
