"""Pose2Sim projects and FreeMoCap recordings are recordings as they are."""

import re

import numpy as np
import pytest
from command_line import actor_file, done, refused, trackable
from project_cases import CAMERAS, freemocap, pose2sim
from small_recording import FPS, SIZE

from sogjax.check.examination import opening_problems
from sogjax.errors import InputError
from sogjax.io.actor_file import load_body, named_body, save_body
from sogjax.io.keypoints.load import load_keypoints
from sogjax.io.recording import open_recording


def test_a_pose2sim_project_is_a_recording(tmp_path):
    folder, written = pose2sim(tmp_path / "trial")
    recording = open_recording(folder)
    assert recording.rig.names == CAMERAS
    assert (recording.up, recording.fps, recording.num_frames, recording.warnings) == ("z", FPS, 4, ())
    np.testing.assert_allclose(np.asarray(recording.rig.cameras.camera_from_world)[:, :3, 3], [[0.1, 0.2, 3.0]] * 2)
    found = load_keypoints(recording)
    assert found is not None
    assert (found.scheme.name, found.warnings) == ("HALPE_26", ())
    np.testing.assert_allclose(found.points[1], written, atol=1e-3)


def test_the_calibration_may_stand_in_the_session(tmp_path):
    folder, _ = pose2sim(tmp_path / "session/participant/trial")
    for around in (tmp_path / "session", tmp_path / "session/participant"):
        (around / "Config.toml").write_text("[project]\n")
    (folder / "calibration").rename(tmp_path / "session/Calibration")
    assert open_recording(folder).rig.names == CAMERAS


def test_the_calibration_of_a_project_may_be_of_any_format(tmp_path):
    """Qualisys' in millimetres, as the format has it, whose unit nobody is asked for."""
    folder, _ = pose2sim(tmp_path / "trial")
    (folder / "calibration/Calib_scene.toml").unlink()
    (folder / "calibration/Calib.qca.txt").write_text(qualisys(CAMERAS, SIZE, centre=(300.0, -4000.0, 1200.0)))
    recording = open_recording(folder)
    assert recording.rig.names == CAMERAS
    assert recording.warnings == ()
    pose = np.asarray(recording.rig.cameras.camera_from_world)[0]
    np.testing.assert_allclose(-pose[:3, :3].T @ pose[:3, 3], [0.3, -4.0, 1.2], atol=1e-5)


def qualisys(names, size, centre):
    """The text of a calibration by Qualisys."""
    width, height = size
    camera = lambda name: (
        f'<camera serial="{name}"><fov_video left="0" top="0" right="{width - 1}" bottom="{height - 1}"/>'
        '<transform x="{}" y="{}" z="{}" '.format(*centre)
        + 'r11="1" r12="0" r13="0" r21="0" r22="0" r23="1" r31="0" r32="-1" r33="0"/>'
        f'<intrinsic focalLengthU="{64 * 60}" focalLengthV="{64 * 60}" centerPointU="{32 * width}" '
        f'centerPointV="{32 * height}" skew="0"/></camera>'
    )
    return "<calibration><cameras>" + "".join(map(camera, names)) + "</cameras></calibration>"


def test_recording_yaml_completes_a_project(tmp_path):
    folder, _ = pose2sim(tmp_path / "trial", "[project]\nframe_rate = 50\n")
    assert open_recording(folder).fps == 50.0
    (folder / "recording.yaml").write_text("up: y\nfps: 60\ncameras: [cam02]\nkeypoint_scheme: COCO_17\n")
    recording = open_recording(folder)
    assert (recording.up, recording.fps, recording.rig.names) == ("y", 60.0, ("cam02",))
    with pytest.raises(InputError, match="26 keypoints, those of COCO_17 have 17"):
        load_keypoints(recording)
    other = folder / "calibration/Calib_other.toml"
    other.write_text((folder / "calibration/Calib_scene.toml").read_text())
    with pytest.raises(InputError, match=r"several calibrations \(Calib_other\.toml, Calib_scene\.toml\)"):
        open_recording(folder)
    (folder / "recording.yaml").write_text("calibration: Calib_other.toml\n")
    assert open_recording(folder).rig.names == CAMERAS


@pytest.mark.parametrize(
    ("asked", "frames"),
    [("[1, 3]", (1, 2)), ("[2, 90]", (2, 2)), ("[]", (0, 4)), ("'all'", (0, 4)), ("[50, 90]", (0, 4))],
)
def test_the_frames_of_a_project_are_used(tmp_path, asked, frames):
    folder, written = pose2sim(tmp_path / "trial", f"[project]\nframe_range = {asked}\n")
    recording = open_recording(folder)
    assert (recording.first_frame, recording.num_frames) == frames
    found = load_keypoints(recording)
    assert found is not None
    np.testing.assert_allclose(found.points[0], written[frames[0] : frames[0] + frames[1]], atol=1e-3)
    (folder / "recording.yaml").write_text("first_frame: 3\n")
    assert open_recording(folder).first_frame == 3


@pytest.mark.slow
def test_points_are_written_where_the_next_steps_look(tmp_path, capsys):
    """Read back by hand: names, rate, numbers of frames and points."""
    folder, _ = pose2sim(tmp_path / "trial")
    (folder / "initial_pose.yaml").write_text("pose: rest\nposition: [0.0, 0.0, 1.0]\nheading: 0.0\n")
    command = ["track", f"recording={folder}", "actor=human", f"out={tmp_path / 'out'}", "outputs.pose2sim=true"]
    command += [
        "images.depth=4",
        "solver.max_iterations=1",
        "tracking.both_ways=false",
        "outputs.overlay=false",
        "outputs.rerun=false",
        "outputs.page=false",
    ]
    body = tmp_path / "human.yaml"
    save_body(body, load_body(named_body("human")))
    command[2] = f"actor={body}"
    done(capsys, *command)
    lines = (folder / "pose-3d" / "trial_0-3.trc").read_text().splitlines()
    assert lines[2].split("\t")[2:5] == ["4", "26", "m"]
    assert {"LHeel", "RBigToe", "Nose"} <= set(lines[3].split("\t"))
    numbers = np.array([line.split("\t") for line in lines[6:]], float)
    assert numbers.shape == (4, 2 + 3 * 26)
    assert np.isfinite(numbers).all()
    assert "already exists" in refused(capsys, *command[:3], f"out={tmp_path / 'other'}", *command[4:])


def test_points_are_written_into_projects_only(tmp_path, capsys):
    recording = trackable(tmp_path / "walk")
    command = ["track", f"recording={recording}", f"actor={actor_file(tmp_path / 'a.yaml')}", "outputs.pose2sim=true"]
    assert "is no Pose2Sim project" in refused(capsys, *command, f"out={tmp_path / 'out'}")
    folder, _ = pose2sim(tmp_path / "trial")
    (folder / "initial_pose.yaml").write_text("pose: rest\nposition: [0.0, 0.0, 1.0]\nheading: 0.0\n")
    command[1] = f"recording={folder}"
    assert "has no landmark" in refused(capsys, *command, f"out={tmp_path / 'out'}")


@pytest.mark.parametrize(
    ("config", "said"),
    [
        ("[project", "TOML"),
        ("[project]\nframe_rate = -1\n", "frame_rate = -1"),
        ("\0", "TOML"),
        ("[project]\nframe_range = [3, 1]\n", "frame_range"),
    ],
)
def test_a_configuration_that_is_none_is_refused(tmp_path, config, said):
    folder, _ = pose2sim(tmp_path / "trial", config)
    with pytest.raises(InputError, match=said) as error:
        open_recording(folder)
    assert "Config.toml" in str(error.value)
    assert [finding.severity for finding in opening_problems(folder, error.value)] == ["error"]


def test_projects_that_lack_something_are_refused(capsys, tmp_path):
    folder, _ = pose2sim(tmp_path / "trial")
    (folder / "videos/cam02.mp4").rename(folder / "videos/front.mp4")
    for word in ("front", "int_cam02_img"):
        assert word in refused(capsys, "check", f"recording={folder}", f"out={tmp_path / 'out'}")
    (folder / "calibration/Calib_scene.toml").unlink()
    assert "no calibration" in refused(capsys, "check", f"recording={folder}", f"out={tmp_path / 'out'}")


def test_a_freemocap_recording_is_a_recording(tmp_path):
    recording = open_recording(freemocap(tmp_path / "walk"))
    assert recording.rig.names == ("Camera_000_synchronized", "Camera_001_synchronized")
    assert (recording.up, recording.warnings) == ("z", ())
    np.testing.assert_allclose(np.asarray(recording.rig.cameras.camera_from_world)[0, :3, 3], [0.1, 0.2, 3.0])
    found = load_keypoints(recording)
    assert found is not None
    assert (found.scheme.name, found.seeing) == ("MEDIAPIPE_33", recording.rig.names)


def test_without_a_ground_plane_the_vertical_is_the_first_cameras(tmp_path):
    folder = freemocap(tmp_path / "walk", "false")
    recording = open_recording(folder)
    assert recording.up == "-y"
    assert len(recording.warnings) == 1
    assert "ground plane" in recording.warnings[0]
    (folder / "recording.yaml").write_text("up: -y\n")
    assert open_recording(folder).warnings == ()


def synchronised(folder, shifts):
    """What Pose2Sim's synchronisation leaves: the files of `pose/` under numbers less by a shift."""
    for name, shift in shifts.items():
        (source,) = (folder / "pose").glob(f"*{name}*")
        target = folder / "pose-sync" / source.name
        target.mkdir(parents=True)
        for file in source.iterdir():
            stem, number, rest = re.fullmatch(r"(.*?)([0-9]+)(\D*)", file.name).groups()
            if int(number) - shift >= 0:
                (target / f"{stem}{int(number) - shift:06d}{rest}").write_bytes(file.read_bytes())


def test_frames_are_shifted_as_pose2sim_shifted_its_files(tmp_path):
    folder, written = pose2sim(tmp_path / "trial")
    synchronised(folder, {"cam01": 0, "cam02": 1})
    recording = open_recording(folder)
    assert recording.frame_offset == {"cam01": 0, "cam02": 1}
    assert recording.num_frames == 3
    assert any("cam02 by +1" in warning for warning in recording.warnings)
    found = load_keypoints(recording)
    np.testing.assert_allclose(found.points[0], written[:3], atol=1e-3)
    np.testing.assert_allclose(found.points[1], written[1:], atol=1e-3)


def test_offsets_in_the_settings_count_more_than_pose2sims(tmp_path):
    folder, _ = pose2sim(tmp_path / "trial")
    synchronised(folder, {"cam01": 1, "cam02": 1})
    (folder / "recording.yaml").write_text("frame_offset: {cam01: 0}\n")
    recording = open_recording(folder)
    assert recording.frame_offset == {"cam01": 0, "cam02": 1}
    assert any("(cam02 by +1)" in warning for warning in recording.warnings)


def test_a_camera_whose_shift_cannot_be_told_is_named(tmp_path):
    folder, _ = pose2sim(tmp_path / "trial")
    synchronised(folder, {"cam01": 1, "cam02": 1})
    for file in (folder / "pose-sync").glob("*cam02*/*"):
        file.write_text('{"people": []}')
    recording = open_recording(folder)
    assert recording.frame_offset == {"cam01": 1, "cam02": 0}
    assert any("of cam02 are shifted" in warning and "`frame_offset`" in warning for warning in recording.warnings)
    (folder / "recording.yaml").write_text("frame_offset: {cam01: 0, cam02: 0}\n")
    assert not any("pose-sync" in warning for warning in open_recording(folder).warnings)
