"""Wrong input: exit status 2, one sentence that names the file or the value, and nothing left behind."""

import math

import numpy as np
import pytest
from command_line import actor_file, refused, trackable
from small_recording import toml_camera, write_calibration, write_image, write_video


@pytest.fixture
def recording(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return trackable(tmp_path / "walk")


def refused_track(capsys, recording, *arguments, words):
    """The sentence with which tracking is refused; there is no folder of results then."""
    out = recording.parent / "new" / "results"
    choice = [] if any("images.background" in argument for argument in arguments) else ["images.background=none"]
    sentence = refused(capsys, "track", f"recording={recording}", f"out={out}", *choice, *arguments)
    for word in words:
        assert str(word) in sentence
    assert not out.parent.exists()
    return sentence


def without_calibration(folder):
    (folder / "calibration.toml").unlink()
    return folder, "calibration.toml"


def camera_without_video(folder):
    write_calibration(folder, *(toml_camera(name) for name in ("left", "right", "third")))
    return "third", "videos/third.mp4"


def video_without_camera(folder):
    write_video(folder / "videos" / "third.mp4")
    return "third", "calibration.toml"


def broken_video(folder):
    (folder / "videos" / "left.mp4").write_bytes(b"no video at all" * 100)
    return (folder / "videos" / "left.mp4",)


def another_frame_rate(folder):
    write_video(folder / "videos" / "left.mp4", fps=30.0)
    return "left 30", "right 25", "fps"


def another_size(folder):
    write_video(folder / "videos" / "left.mp4", size=(96, 64))
    return "left.mp4", "96x64", "64x48"


def no_rotation(folder):
    matrix = "[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 2.0]]"
    write_calibration(folder, toml_camera("left", rotation=matrix), toml_camera("right"))
    return "calibration.toml", "left", "rotation"


def nan_in_calibration(folder):
    write_calibration(folder, toml_camera("left"), toml_camera("right", translation="[0.1, nan, 3.0]"))
    return "calibration.toml", "right", "nan"


def nan_in_initial_pose(folder):
    (folder / "initial_pose.yaml").write_text("pose: rest\nposition: [0.0, .nan, 1.0]\n")
    return "initial_pose.yaml", "position", "nan"


def unknown_landmark(folder):
    points = {name: [0.1 * k, 0.2, 0.3 + 0.1 * k] for k, name in enumerate(("pelvis", "neck", "left_elbo", "chest"))}
    (folder / "initial_pose.yaml").write_text(f"landmarks: {points}\n")
    return "initial_pose.yaml", "left_elbo"


def unknown_pose(folder):
    (folder / "initial_pose.yaml").write_text("pose: headstand\nposition: [0, 0, 1]\n")
    return "initial_pose.yaml", "headstand"


def no_initial_pose(folder):
    (folder / "initial_pose.yaml").unlink()
    return folder, "initial_pose.yaml"


def misspelt_setting(folder):
    (folder / "recording.yaml").write_text("up: z\nframerate: 25\n")
    return "recording.yaml", "framerate"


def wrong_truth(folder):
    (folder / "ground_truth.npz").write_bytes(b"nothing")
    return (folder / "ground_truth.npz",)


def no_common_frame(folder):
    (folder / "recording.yaml").write_text("up: z\nframe_offset: {left: 10}\n")
    return folder, "no frame in common"


@pytest.mark.parametrize(
    "change",
    [
        without_calibration,
        camera_without_video,
        video_without_camera,
        broken_video,
        another_frame_rate,
        another_size,
        no_rotation,
        nan_in_calibration,
        nan_in_initial_pose,
        unknown_landmark,
        unknown_pose,
        misspelt_setting,
        wrong_truth,
        no_common_frame,
    ],
)
def test_a_recording_with_something_wrong(capsys, recording, tmp_path, change):
    words = change(recording)
    refused_track(capsys, recording, f"actor={actor_file(tmp_path / 'actor.yaml')}", words=words)


@pytest.mark.slow
def test_nothing_that_looks_like_the_actor(capsys, recording, tmp_path):
    folder, remedy = no_initial_pose(recording)
    left = ["initial_pose.png"]  # the guess, to be judged by the user
    refused = refused_track_lines(capsys, folder, f"actor={actor_file(tmp_path / 'actor.yaml')}", left=left)
    assert str(folder) in refused[-1]
    assert remedy in refused[-1]


def test_no_such_folder(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused_track(capsys, tmp_path / "nowhere", words=(tmp_path / "nowhere", "no such folder"))


def test_no_example_poses(capsys, recording):
    refused_track(capsys, recording, words=(recording, "example_poses", "actor=FILE"))


def test_example_pose_without_masks(capsys, recording):
    for camera in ("left", "right"):
        write_image(recording / "example_poses" / "tpose" / f"{camera}.jpg", np.full((48, 64, 3), 90, np.uint8))
    refused = refused_track_lines(capsys, recording)
    assert "tpose" in refused[-1]
    assert "mask" in refused[-1]


def example_pose(recording, cameras=("left", "right"), masks=("left", "right")):
    """An example pose with a white square on each mask."""
    mask = np.zeros((48, 64, 3), np.uint8)
    mask[10:40, 20:40] = 255
    for camera in cameras:
        write_image(recording / "example_poses" / "tpose" / f"{camera}.jpg", np.full((48, 64, 3), 90, np.uint8))
    for camera in masks:
        write_image(recording / "example_poses" / "tpose" / f"{camera}.mask.png", mask)
    return recording / "example_poses" / "tpose"


def mask_of_another_size(recording):
    write_image(example_pose(recording) / "left.mask.png", np.zeros((24, 32), np.uint8))
    return "left.mask.png", "32x24", "64x48"


def empty_mask(recording):
    write_image(example_pose(recording) / "right.mask.png", np.zeros((48, 64), np.uint8))
    return "right.mask.png", "empty", "white"


def full_mask(recording):
    write_image(example_pose(recording) / "right.mask.png", np.full((48, 64), 255, np.uint8))
    return "right.mask.png", "full", "white"


def one_camera(recording):
    return example_pose(recording, ("left",), ("left",)), "1 of the cameras", "at least two"


def one_mask(recording):
    return example_pose(recording, masks=("left",)), "1 picture with a mask", "background", "right"


def no_mask_and_no_plate(recording):
    return example_pose(recording, masks=()), "0 pictures with a mask", "background", "left, right"


def plates_without_difference(recording):
    folder = example_pose(recording, masks=())
    for camera in ("left", "right"):
        write_image(recording / "background" / f"{camera}.jpg", np.full((48, 64, 3), 90, np.uint8))
    return folder, "left, right", "no subject", "mask.png"


@pytest.mark.parametrize("command", ["actor", "segment"])
@pytest.mark.parametrize(
    "change",
    [
        mask_of_another_size,
        empty_mask,
        full_mask,
        one_camera,
        one_mask,
        no_mask_and_no_plate,
        plates_without_difference,
    ],
)
def test_an_example_pose_with_something_wrong(capsys, recording, command, change):
    words = change(recording)
    before = sorted(recording.parent.rglob("*"))
    sentence = refused(capsys, command, f"recording={recording}", f"out={recording.parent / 'new' / 'actor.yaml'}")
    for word in words:
        assert str(word) in sentence
    assert sorted(recording.parent.rglob("*")) == before


def refused_track_lines(capsys, recording, *arguments, left=()):
    """As `refused_track`, where the work has begun to report what it does."""
    from sogjax.cli.main import main

    assert main(["track", f"recording={recording}", f"out={recording.parent / 'new'}", *arguments]) == 2
    new = recording.parent / "new"
    assert sorted(path.name for path in new.iterdir()) == [*left] if left else not new.exists()
    return capsys.readouterr().err.splitlines()


def unknown_parent(actor):
    actor["joints"][5]["parent"] = "nobody"
    return "joints[5].parent", "nobody"


def cycle(actor):
    actor["joints"][4]["parent"] = "neck"
    return "joints[4].parent", "neck", "cycle"


def weight_for_unknown_joint(actor):
    actor["dofs"][4]["joints"] = {"waste": 1.0}
    return "dofs[4].joints", "waste"


def negative_sigma(actor):
    actor["blobs"][1]["sigma"] = -0.05
    return "blobs[1].sigma", "-0.05"


def nan_sigma(actor):
    actor["blobs"][1]["sigma"] = math.nan
    return "blobs[1].sigma", "nan"


def shape_of_unknown_joint(actor):
    actor["shape"] = [{"name": "trunk", "joint_offsets": ["neck", "waste"]}]
    return "shape[0].joint_offsets[1]", "waste", "waist"


@pytest.mark.parametrize(
    "change",
    [unknown_parent, cycle, weight_for_unknown_joint, negative_sigma, nan_sigma, shape_of_unknown_joint],
)
def test_an_actor_file_with_something_wrong(capsys, recording, tmp_path, change):
    words = []
    path = actor_file(tmp_path / "actor.yaml", lambda content: words.extend(change(content)))
    refused_track(capsys, recording, f"actor={path}", words=(path, *words))


def test_a_body_to_start_from_with_something_wrong(capsys, recording, tmp_path):
    example_pose(recording)
    words = []
    path = actor_file(tmp_path / "body.yaml", lambda content: words.extend(shape_of_unknown_joint(content)))
    sentence = refused(capsys, "actor", f"recording={recording}", f"body={path}", "out=new/actor.yaml")
    for word in (path, *words):
        assert str(word) in sentence


@pytest.mark.parametrize(
    ("argument", "words"),
    [
        ("solver.method=foo", ("solver.method=foo", "conditioned_ascent", "bfgs")),
        ("solver=foo", ("solver=foo", "lbfgs")),
        ("outputs.formats=[trc,fbx]", ("outputs.formats=fbx", "bvh, c3d, csv, glb, lafan1.bvh, lengths.csv, mot, trc")),
        ("color.space=foo", ("color.space=foo", "hsv_cylinder")),
        ("color.radius=0", ("color.radius=0",)),
        ("energy.pairs=foo", ("energy.pairs=foo", "dense", "sparse")),
        ("energy.limit_weight=-1", ("energy.limit_weight=-1",)),
        ("energy.limit_weight=nan", ("energy.limit_weight=nan", "finite")),
        ("energy.limit_weight=much", ("energy.limit_weight=much", "number")),
        ("stop=soon", ("stop=soon", "whole number")),
        ("energy.limits=1", ("energy.limits", "unknown")),
        ("limit_weight=1", ("limit_weight", "energy.limit_weight")),
        ("+new=1", ("+new=1",)),
        ("--start=1", ("--start=1", "start=1")),
        ("start", ("start", "key=value")),
        ("body=[", ("body=[", "quotes")),
        ("body=lion", ("lion", "dog", "human")),
        ("cameras=[nope]", ("nope", "left, right")),
        ("cameras=left", ("cameras=left", "list")),
        ("cameras=[]", ("cameras=[]", "at least one", "left, right")),
        ("cameras=[left,left]", ("cameras=[left,left]", "once")),
        ("energy.pairs=some", ("energy.pairs=some", "sparse")),
        ("actors=0", ("actors=0", "at least 1")),
        ("actors=-2", ("actors=-2", "at least 1")),
        ("actors=1.5", ("actors=1.5", "whole number")),
        ("actors=2", ("actors=2", "actor=", "1 file", "leave actors out")),
        ("start=4", ("start=4", "0 to 3")),
        ("start=-1", ("start=-1",)),
        ("stop=5", ("stop=5", "0 to 3")),
        ("start=2 stop=2", ("start=2", "stop=2")),
        ("images.depth=0", ("images.depth=0",)),
        ("solver.max_iterations=0", ("solver.max_iterations=0",)),
        ("images.background=pictures", ("images.background", "background/", "left, right")),
        ("actor=nowhere.yaml", ("nowhere.yaml",)),
    ],
)
def test_an_option_with_something_wrong(capsys, recording, tmp_path, argument, words):
    actor = [] if argument.startswith(("actor=", "body")) else [f"actor={actor_file(tmp_path / 'actor.yaml')}"]
    refused_track(capsys, recording, *actor, *argument.split(), words=words)


def test_two_actors_of_one_name(capsys, recording, tmp_path):
    path = actor_file(tmp_path / "actor.yaml")
    (tmp_path / "other.yaml").write_text(path.read_text().replace("- 0.6\n", "- 0.5\n"))  # in other colours
    refused_track(capsys, recording, f"actor=[{path},{tmp_path / 'other.yaml'}]", words=("puppet", "name"))
    refused_track(capsys, recording, f"actor=[{path},{path}]", words=("the same actor", "each person"))


def test_a_folder_that_cannot_be_written(capsys, recording, tmp_path):
    actor = f"actor={actor_file(tmp_path / 'actor.yaml')}"
    blocked = tmp_path / "file" / "results"
    blocked.parent.write_text("in the way")
    for command in (
        ("track", f"recording={recording}", actor, f"out={blocked}"),
        ("synth", f"out={blocked}", "frames=1", "cameras=1"),
        ("demo", f"out={blocked}"),
        ("actor", f"recording={recording}", f"out={blocked / 'a.yaml'}"),
    ):
        assert str(blocked) in refused(capsys, *command)
    assert blocked.parent.read_text() == "in the way"


def test_older_results_stay_when_a_run_is_refused(capsys, recording):
    out = recording.parent / "results"
    out.mkdir()
    (out / "motion.npz").write_text("old")
    refused(capsys, "track", f"recording={recording}", f"out={out}")
    assert [path.name for path in out.iterdir()] == ["motion.npz"]


def test_paths_with_any_characters(capsys, tmp_path):
    place = tmp_path / "my recordings (2) ü"
    assert str(place) in refused(capsys, "track", f"recording={place}")


@pytest.mark.parametrize(
    "command",
    [
        ("evaluate", "motion=none.npz", "truth=none.npz"),
        ("view", "motion=none.npz", "recording=RECORDING", "out=a.rrd"),
        ("export", "motion=none.npz", "to=a.bvh"),
        ("export", "motion=none.npz", "to=a.bvh", "up=w"),
        ("synth", "out=new", "motion=swim"),
        ("synth", "out=new", "motion=pass"),
        ("synth", "out=new", "width=321"),
        ("synth", "out=new", "noise=nan"),
        ("synth", "out=RECORDING"),
        ("demo", "out=new", "cameras=0"),
        ("actor", "recording=RECORDING", "out=new/actor.yaml"),
        ("actor", "recording=RECORDING", "out=RECORDING"),
        ("segment", "recording=RECORDING", "out=new"),
        ("segment", "recording=RECORDING", "out=RECORDING/example_poses"),
        ("segment", "recording=RECORDING", "out=new", "cameras=[nope]"),
        ("evaluate",),
        ("demo", "-m", "seed=1,2"),
        ("nonsense",),
    ],
)
def test_other_commands(capsys, recording, tmp_path, command):
    before = sorted(tmp_path.rglob("*"))
    refused(capsys, *(word.replace("RECORDING", str(recording)) for word in command))
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("override", ["energy.limit_weight=0,much", "energy.limits=0,1", "color=foo,rgb", "start=["])
def test_a_sweep_with_something_wrong_makes_no_folders(capsys, recording, tmp_path, override):
    before = sorted(tmp_path.rglob("*"))
    refused(capsys, "track", "-m", f"recording={recording}", override)
    assert sorted(tmp_path.rglob("*")) == before
