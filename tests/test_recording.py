"""Opening a recording: what it says, and one sentence for everything that does not fit together."""

import cv2
import numpy as np
import pytest
from small_recording import (
    FPS,
    frame_image,
    make_recording,
    shared_recording,
    toml_camera,
    write_calibration,
    write_image,
    write_images,
    write_video,
)

from sogjax.actor.silhouettes import SharedFrames, load_images
from sogjax.errors import InputError
from sogjax.io.recording import open_recording


@pytest.fixture
def folder(tmp_path):
    return make_recording(tmp_path / "walk")


def refused(folder, *words):
    """The message with which a recording is refused; it holds all of `words` and is one line."""
    with pytest.raises(InputError) as error:
        open_recording(folder)
    message = str(error.value)
    assert "\n" not in message
    for word in words:
        assert word in message
    return message


def settings(folder, text):
    (folder / "recording.yaml").write_text(text)


def test_a_whole_recording(folder):
    recording = open_recording(folder)
    assert recording.name == "walk"
    assert recording.rig.names == ("left", "right")
    assert (recording.fps, recording.up, recording.first_frame, recording.num_frames) == (FPS, "z", 0, 4)
    assert recording.sources == {name: folder / "videos" / f"{name}.mp4" for name in ("left", "right")}
    assert recording.frame_offset == {"left": 0, "right": 0}
    assert recording.background == {}
    assert recording.example_poses == ()
    assert recording.initial_poses is None
    assert recording.ground_truth is None
    assert recording.warnings == ()


def test_cameras_are_matched_by_name_not_by_order(tmp_path):
    folder = make_recording(tmp_path / "r", cameras=("cam_2", "cam_10", "cam_1"))
    recording = open_recording(folder)
    assert recording.rig.names == ("cam_2", "cam_10", "cam_1")
    assert [recording.sources[name].stem for name in recording.rig.names] == ["cam_2", "cam_10", "cam_1"]


def test_without_recording_yaml_the_vertical_is_assumed_and_said(folder):
    (folder / "recording.yaml").unlink()
    recording = open_recording(folder)
    assert recording.up == "z"
    assert any("up" in warning for warning in recording.warnings)


def test_images_are_as_good_as_videos(tmp_path):
    folder = make_recording(tmp_path / "r", cameras=())
    write_calibration(folder, toml_camera("left"), toml_camera("right"))
    write_images(folder / "images" / "left", first=1)
    write_video(folder / "videos" / "right.avi")
    assert open_recording(folder).fps == FPS
    (folder / "videos" / "right.avi").unlink()
    write_images(folder / "images" / "right")
    refused(folder, str(folder), "frame rate", "`fps:`")
    settings(folder, "up: y\nfps: 50\n")
    recording = open_recording(folder)
    assert (recording.fps, recording.num_frames) == (50.0, 4)


def test_the_named_cameras_are_used_and_the_others_may_be_incomplete(folder):
    write_calibration(folder, toml_camera("right"), toml_camera("left"), toml_camera("ceiling"))
    write_video(folder / "videos" / "door.mp4")
    settings(folder, "up: z\ncameras: [left, right]\n")
    assert open_recording(folder).rig.names == ("left", "right")


def test_millimetres_are_suspected_and_converted(folder):
    tables = [toml_camera(name, translation="[0.0, 0.0, 3000.0]") for name in ("left", "right")]
    write_calibration(folder, *tables)
    assert "unit: mm" in " ".join(open_recording(folder).warnings)
    settings(folder, "up: z\nunit: mm\n")
    recording = open_recording(folder)
    assert recording.warnings == ()
    np.testing.assert_allclose(recording.rig.cameras.camera_from_world[:, 2, 3], [3.0, 3.0])


def test_the_common_part_of_videos_of_different_length_is_used_and_said(folder):
    write_video(folder / "videos" / "right.mp4", frames=7)
    recording = open_recording(folder)
    assert recording.num_frames == 4
    assert "left 4, right 7" in recording.warnings[0]


@pytest.mark.parametrize(
    ("yaml", "first", "count"),
    [
        ("frame_offset: {left: 1}", 0, 3),
        ("frame_offset: {left: -1}", 1, 3),
        ("frame_offset: {left: 1, right: -1}", 1, 2),
        ("first_frame: 1\nlast_frame: 2", 1, 2),
        ("last_frame: 0", 0, 1),
    ],
)
def test_frames_that_all_cameras_have(folder, yaml, first, count):
    settings(folder, f"up: z\n{yaml}\n")
    recording = open_recording(folder)
    assert (recording.first_frame, recording.num_frames) == (first, count)


def test_example_poses_and_backgrounds(folder):
    image, mask = frame_image(0, 0), np.zeros((48, 64), np.uint8)
    write_image(folder / "background" / "left.jpg", image)
    for pose in ("tpose", "squat"):
        write_image(folder / "example_poses" / pose / "left.jpg", image)
        write_image(folder / "example_poses" / pose / "right.png", image)
        write_image(folder / "example_poses" / pose / "right.mask.png", mask)
    recording = open_recording(folder)
    assert recording.background == {"left": folder / "background" / "left.jpg"}
    assert [pose.name for pose in recording.example_poses] == ["squat", "tpose"]
    squat = recording.example_poses[0]
    assert set(squat.images) == {"left", "right"}
    assert squat.masks == {"right": folder / "example_poses" / "squat" / "right.mask.png"}
    assert squat.actor is squat.initial_pose is None
    settings(
        folder,
        "up: z\nexample_poses:\n- name: tpose\n  actor: Ann\n  initial_pose: {pose: tpose, position: [1, 2, 3]}\n",
    )
    (pose,) = open_recording(folder).example_poses
    assert (pose.name, pose.actor) == ("tpose", "Ann")
    assert pose.initial_pose is not None
    assert pose.initial_pose.position == (1.0, 2.0, 3.0)


def test_frames_of_the_videos_are_example_poses(folder):
    settings(folder, "up: z\nfirst_frame: 1\nexample_poses: [1, {frame: 3, actor: Ann}]\n")
    recording = open_recording(folder)
    assert [(pose.name, pose.frame, pose.actor) for pose in recording.example_poses] == [
        ("frame_1", 1, None),
        ("frame_3", 3, "Ann"),
    ]
    one, other = recording.example_poses
    assert load_images(recording, other).keys() == {0, 1}
    shared = SharedFrames()
    shared.read(recording, [one, other, one])
    for example in (one, other):
        for camera, image in load_images(recording, example).items():
            np.testing.assert_array_equal(shared.images[example.frame][camera], image)


@pytest.mark.parametrize(
    ("entry", "parts"),
    [
        ("[0]", ["no frame 0", "1 to"]),
        ("[1, {frame: 1}]", ["example_poses[1]", "once"]),
        ("[{frame: 1, actor: ann}, {frame: 1}]", ["example_poses[1].frame", "once"]),
        ("[{frame: 1, actor: ann}, {frame: 1, actor: ann}]", ["example_poses[1].frame", "once"]),
        ("[1.5]", ["example_poses[0]", "frame"]),
        ("[{frame: tpose}]", ["example_poses[0].frame", "'tpose'"]),
        ("[{frame: 1, name: tpose}]", ["example_poses[0].name", "unknown"]),
    ],
)
def test_wrong_frames_as_example_poses(folder, entry, parts):
    settings(folder, f"up: z\nfirst_frame: 1\nexample_poses: {entry}\n")
    refused(folder, "recording.yaml", *parts)


def test_the_folder_and_its_parts_must_be_there(folder):
    refused(folder / "absent", str(folder / "absent"), "no such folder")
    (folder / "calibration.toml").rename(folder / "videos" / "calibration.toml")
    refused(folder, str(folder), "no calibration", "calibration.toml")


def test_no_videos_at_all(folder):
    for video in (folder / "videos").iterdir():
        video.unlink()
    refused(folder, str(folder), "no videos", "videos/")


def test_two_calibrations_need_a_name(folder):
    write_calibration(folder, toml_camera("left"), toml_camera("right")).rename(folder / "other.toml")
    write_calibration(folder, toml_camera("left"), toml_camera("right"))
    refused(folder, "calibration.toml, other.toml", "`calibration:`")
    settings(folder, "up: z\ncalibration: other.toml\n")
    open_recording(folder)
    settings(folder, "up: z\ncalibration: absent.toml\n")
    refused(folder, "recording.yaml", "absent.toml")


def test_every_camera_has_a_calibration_and_a_video(folder):
    write_video(folder / "videos" / "door.mp4")
    refused(folder, "calibration.toml", "'door'", "cameras:")
    (folder / "videos" / "door.mp4").unlink()
    (folder / "videos" / "left.mp4").unlink()
    refused(folder, str(folder), "'left'", "videos/left.mp4")


def test_one_source_a_camera(folder):
    write_images(folder / "images" / "left")
    refused(folder, "'left'", "left.mp4", "images", "remove one")
    for image in (folder / "images" / "left").iterdir():
        image.unlink()
    (folder / "images" / "left").rmdir()
    write_video(folder / "videos" / "left.avi")
    refused(folder, "left.avi", "left.mp4")


@pytest.mark.parametrize("content", [b"", b"no video", b"\0" * 5000])
def test_a_video_that_does_not_open(folder, content):
    (folder / "videos" / "left.mp4").write_bytes(content)
    refused(folder, "left.mp4", "does not open")


def test_half_a_video(folder):
    video = folder / "videos" / "left.mp4"
    video.write_bytes(video.read_bytes()[: video.stat().st_size // 2])
    refused(folder, "left.mp4")


def test_different_frame_rates(folder):
    write_video(folder / "videos" / "right.mp4", fps=30.0)
    refused(folder, str(folder), "left 25", "right 30", "`fps:`")
    settings(folder, "up: z\nfps: 30\n")
    assert open_recording(folder).fps == 30.0


@pytest.mark.parametrize(("size", "remedy"), [((128, 96), "calibrate"), ((48, 64), "turn the images by 90")])
def test_images_of_another_size_than_calibrated(folder, size, remedy):
    write_video(folder / "videos" / "right.mp4", size=size)
    refused(folder, "right.mp4", f"{size[0]}x{size[1]}", "64x48", remedy)


def test_a_wrong_calibration_is_refused_at_the_door(folder):
    write_calibration(folder, toml_camera("left", rotation="[nan, 0.0, 0.0]"), toml_camera("right"))
    refused(folder, "calibration.toml", "'left'", "nan")


@pytest.mark.parametrize(
    ("yaml", "words"),
    [
        ("fsp: 30", ("fsp", "fps", "frame_offset")),
        ("fps: .nan", ("fps", "nan")),
        ("fps: 0", ("fps", "0")),
        ("fps: fast", ("fps", "'fast'")),
        ("fps: true", ("fps", "True")),
        ("up: w", ("up", "'w'", "-y")),
        ("up: [z]", ("up", "z")),
        ("unit: cm", ("unit", "'cm'", "mm")),
        ("cameras: left", ("cameras", "'left'")),
        ("cameras: []", ("cameras", "[]")),
        ("cameras: [left, left]", ("cameras", "left")),
        ("cameras: [1]", ("cameras", "1")),
        ("cameras: [left, door]", ("'door'",)),
        ("frame_offset: {door: 2}", ("frame_offset", "'door'", "left, right")),
        ("frame_offset: {left: soon}", ("frame_offset.left", "soon")),
        ("frame_offset: 3", ("frame_offset", "3")),
        ("frame_offset: {left: 9}", ("no frame in common", "frame_offset")),
        ("first_frame: 4", ("first_frame", "4", "0 to 3")),
        ("first_frame: -1", ("first_frame", "-1", "0 to 3")),
        ("first_frame: 1.5", ("first_frame", "1.5")),
        ("last_frame: 40", ("last_frame", "40", "0 to 3")),
        ("first_frame: 2\nlast_frame: 1", ("last_frame", "1", "2")),
        ("example_poses: [tpose]", ("example_poses[0]", "tpose")),
        ("example_poses: [{name: ../x}]", ("example_poses[0].name", "../x")),
        ("example_poses: [{name: a, mask: b}]", ("mask", "initial_pose")),
        ("example_poses: [{name: a}, {name: a}]", ("example_poses", "'a'")),
        ("example_poses: [{actor: Ann}]", ("example_poses[0]", "name")),
        ("example_poses: [{name: a, initial_pose: {position: [.nan, 0, 0]}}]", ("nan",)),
        ("fps: 30\nfps: 60", ("fps", "twice")),
        ("fps: [", ("line",)),
        ("- 3", ("mapping",)),
        ("[" * 5000, ("nested",)),
        ("a: &a [1]\nb: *a", ("aliases",)),
    ],
)
def test_wrong_settings_name_the_file_the_key_and_the_value(folder, yaml, words):
    settings(folder, yaml)
    message = refused(folder, *words)
    assert str(folder) in message


@pytest.mark.parametrize("text", ["", "# nothing\n", "fps:\nup: z\n"])
def test_empty_settings_are_fine(folder, text):
    settings(folder, text)
    assert open_recording(folder).fps == FPS


def test_missing_and_empty_example_poses(folder):
    settings(folder, "up: z\nexample_poses: [{name: tpose}]\n")
    refused(folder, "example_poses", "tpose", "no such example pose")
    (folder / "example_poses" / "tpose").mkdir(parents=True)
    refused(folder, "tpose", "holds no image")


@pytest.mark.parametrize(
    ("name", "shape", "words"),
    [
        ("left.mask.png", (24, 32), ("left.mask.png", "32x24", "64x48")),
        ("left.png", (24, 32, 3), ("left.png", "32x24", "64x48")),
        ("door.png", (48, 64, 3), ("door.png", "'door'", "left, right")),
        ("right.mask.png", (48, 64), ("right.mask.png", "without its image")),
        ("left.jpg", (48, 64, 3), ("left.jpg", "left.png")),
    ],
)
def test_example_images_fit_their_cameras(folder, name, shape, words):
    pose = folder / "example_poses" / "tpose"
    write_image(pose / "left.png", frame_image(0, 0))
    write_image(pose / name, np.zeros(shape, np.uint8))
    refused(folder, *words)


def test_an_image_that_does_not_open(folder):
    (folder / "background").mkdir()
    (folder / "background" / "left.png").write_bytes(b"no image")
    refused(folder, "left.png", "cannot be read")
    (folder / "background" / "left.png").write_bytes(b"")
    refused(folder, "left.png", "cannot be read")


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (("frame.png",), ("frame.png", "number")),
        (("000000.png", "000002.png"), ("number 1 is missing",)),
        (("0.png", "00.png"), ("00.png", "0.png")),
        (("notes.txt",), ("left", "no images")),
    ],
)
def test_numbered_images_have_no_gaps(tmp_path, names, words):
    folder = make_recording(tmp_path / "r", cameras=(), settings="up: z\nfps: 25\n")
    write_calibration(folder, toml_camera("left"))
    for name in names:
        write_image(folder / "images" / "left" / "0.png", frame_image(0, 0))
        (folder / "images" / "left" / "0.png").rename(folder / "images" / "left" / name)
    if "0.png" in names:
        write_image(folder / "images" / "left" / "0.png", frame_image(0, 0))
    refused(folder, *words)


def test_initial_pose_and_ground_truth_are_checked(folder):
    (folder / "initial_pose.yaml").write_text("landmarks: {pelvis: [0, .nan, 1]}\n")
    refused(folder, "initial_pose.yaml", "landmarks.pelvis", "nan")
    (folder / "initial_pose.yaml").write_text("landmarks: {pelvis: [0, 1, 1]}\n")
    assert open_recording(folder).initial_poses == folder / "initial_pose.yaml"
    np.savez(folder / "ground_truth.npz", fps=np.nan, markers=np.zeros((4, 0, 3)), marker_names=np.array([], "U1"))
    refused(folder, "ground_truth.npz", "nan")
    np.savez(folder / "ground_truth.npz", fps=25.0, joints=np.zeros((4, 1, 3)), joint_names=["pelvis"])
    assert open_recording(folder).ground_truth == folder / "ground_truth.npz"


@pytest.mark.parametrize(
    ("name", "cameras", "frames", "fps", "size"),
    [("rendered_walk", 12, 40, 45.0, (1296, 972)), ("real_tpose", 4, 11, 60.0, (1088, 1920))],
)
def test_the_recordings_to_develop_with(name, cameras, frames, fps, size):
    folder = shared_recording(name)
    if folder is None:
        pytest.skip(f"there is no recording {name} beside the project")
    recording = open_recording(folder)
    assert (len(recording.rig), recording.num_frames, recording.fps) == (cameras, frames, fps)
    assert recording.rig.image_size(recording.rig.names[0]) == size
    assert recording.example_poses
    assert recording.warnings == ()
    mask = cv2.imread(str(next(iter(recording.example_poses[0].masks.values()))), cv2.IMREAD_GRAYSCALE)
    assert mask.shape == (size[1], size[0])


def test_a_video_under_another_name_than_its_camera(folder):
    (folder / "videos" / "right.mp4").rename(folder / "videos" / "rigth.mp4")
    refused(folder, "rigth.mp4", "calibration.toml", "'right' has no video", "rename the video to right.mp4")
    settings(folder, "up: z\ncameras: [left, right]\n")
    refused(folder, "rigth.mp4", "'right' has no video")
    settings(folder, "up: z\ncameras: [left, rigth]\n")
    refused(folder, "has no camera 'rigth'")
    write_video(folder / "videos" / "door.mp4")
    settings(folder, "up: z\n")
    refused(folder, "has no video of the camera 'right'")


@pytest.mark.parametrize("inside", ["videos", "videos/left.mp4", "calibration.toml"])
def test_something_inside_of_a_recording_in_its_place(folder, inside):
    refused(folder / inside, str(folder / inside), f"give the folder of the recording, {folder.resolve()}")
