"""BVH for robots: another library reads the motion by LAFAN1's joints; feet that stand keep their places."""

import dataclasses
import warnings

import numpy as np
import pytest
from body_cases import shipped
from command_line import done, refused
from scipy.spatial.transform import Rotation

from sogjax.errors import InputError
from sogjax.io.export.bones import world_turn
from sogjax.io.export.feet import contacts, middle_joint, shortest_turns, standing_feet
from sogjax.io.export.lafan1 import NAMES, figure_of, write_lafan1
from sogjax.io.export.write import export_motion
from sogjax.io.motion import motion_from_poses
from sogjax.io.motion_data import save_motion
from sogjax.io.reference.load import load_reference
from sogjax.quality.reference.evaluation import evaluate_against_reference
from sogjax.run.run_files import MOTIONS
from sogjax.run.write import check_formats
from sogjax.settings.run import OutputsConfig

with warnings.catch_warnings():
    warnings.simplefilter("ignore", PendingDeprecationWarning)  # of PyGLM, which bvhio imports by its old name
    import bvhio

METRES, FPS = 1e-4, 50.0
SAME = {
    **{"Hips": "pelvis", "Neck": "neck", "Spine": "spine1_bend", "Spine2": "spine5_bend", "LeftUpLeg": "left_hip"},
    **{"LeftArm": "left_shoulder", "RightForeArm": "right_elbow", "RightHand": "right_wrist"},
    "LeftShoulder": "left_clavicle_raise",
}
LEGS = {"LeftLeg": "left_knee", "LeftFoot": "left_ankle", "RightToe": "right_toe"}


@pytest.fixture(scope="module")
def body():
    return shipped("human")


def posed(body, frames=1, **angles):
    pose = np.zeros((frames, body.skeleton.num_dofs), np.float32)
    for name, values in angles.items():
        pose[:, body.skeleton.dof_names.index(name)] = values
    return motion_from_poses(body, pose, FPS)


@pytest.fixture(scope="module")
def dancing(body):
    """Everything turns; nothing rests."""
    t = np.arange(40) / FPS
    swing = {"spine_bend": 0.5, "spine_lean": 0.3, "spine_twist": 0.4, "left_shoulder_raise": 1.0, "right_elbow": 1.0}
    swing |= {"left_hip_bend": 0.6, "right_forearm_roll": 0.7, "right_hip_side": 0.3, "neck_bend": 0.3}
    angles = {name: size * np.sin(9.0 * t + k) for k, (name, size) in enumerate(swing.items())}
    return posed(
        body, 40, root_x=3.0 * t, root_z=1.0 + t, root_yaw=2.0 * t, left_knee=1.0 + 0.5 * np.sin(5 * t), **angles
    )


def read(path):
    """By name the places of the joints in metres in every frame, and the file's container."""
    container, root = bvhio.readAsBvh(str(path)), bvhio.readAsHierarchy(str(path))
    places = {joint.Name: [] for joint, _, _ in root.layout()}
    for frame in range(container.FrameCount):
        root.loadPose(frame)
        for joint, _, _ in root.layout():
            places[joint.Name].append(list(joint.PositionWorld))
    return {name: np.array(values) / 100.0 for name, values in places.items()}, container


def y_up(motion, name):
    return motion.joint(name) @ world_turn(motion.up, "y").T


def test_the_joints_are_where_they_were_under_lafan1s_names(dancing, tmp_path):
    said = write_lafan1(tmp_path / "a.bvh", dancing)
    assert "no foot stands" in said
    places, container = read(tmp_path / "a.bvh")
    assert tuple(places) == NAMES
    assert container.FrameTime == pytest.approx(1.0 / FPS)
    for name, ours in (SAME | LEGS).items():
        np.testing.assert_allclose(places[name], y_up(dancing, ours), atol=METRES, err_msg=name)


def test_channels_are_as_lafan1_has_them(dancing, tmp_path):
    export_motion(dancing, tmp_path / "a.lafan1.bvh")
    words = [line.split() for line in (tmp_path / "a.lafan1.bvh").read_text().splitlines()]
    channels = [line[1:] for line in words if line[0] == "CHANNELS"]
    turns = ["Zrotation", "Yrotation", "Xrotation"]
    assert channels[0] == ["6", "Xposition", "Yposition", "Zposition", *turns]
    assert all(each == ["3", *turns] for each in channels[1:])
    offsets = np.array([line[1:] for line in words if line[0] == "OFFSET"], float)
    np.testing.assert_allclose(offsets[2], [43.0, 0.0, 0.0], atol=0.01)  # the thigh lies along its own X


def test_bones_have_the_axes_that_retargeting_to_robots_expects(body):
    """Rotations, from a published retargeting, after which a standing person's bones look forward, left and up."""
    figure = figure_of("a.bvh", posed(body, right_elbow=np.pi / 2), "z")
    forward_left_up = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    half = np.sqrt(0.5)
    for name, (w, x, y, z) in {
        **{"Hips": (0.5, 0.5, 0.5, 0.5), "Spine2": (0.5, 0.5, 0.5, 0.5), "RightUpLeg": (-0.5, 0.5, 0.5, -0.5)},
        **{"LeftLeg": (-0.5, 0.5, 0.5, -0.5), "LeftToe": (-half, half, 0.0, 0.0), "LeftArm": (0.5, 0.5, -0.5, -0.5)},
        **{"RightArm": (0.5, 0.5, -0.5, -0.5), "RightForeArm": (half, half, 0.0, 0.0)},
    }.items():
        turned = figure.rotations[0, NAMES.index(name)] @ Rotation.from_quat([x, y, z, w]).as_matrix()
        np.testing.assert_allclose(turned, forward_left_up, atol=0.03, err_msg=name)


def with_spine(motion, kept):
    """The motion of a body that has only some bones of the spine."""
    gone = [f"spine{k}_{way}" for k in range(1, 6) if k not in kept for way in ("bend", "lean", "twist")]
    names, parents = motion.joint_names.tolist(), motion.joint_parents.tolist()
    left = [index for index, name in enumerate(names) if name not in gone]
    above = lambda joint: joint if joint < 0 or joint in left else above(parents[joint])
    return dataclasses.replace(
        motion,
        joint_names=motion.joint_names[left],
        joint_parents=np.array([above(parents[j]) if parents[j] < 0 else left.index(above(parents[j])) for j in left]),
        world_from_joint=motion.world_from_joint[:, left],
        blob_joint=np.zeros_like(motion.blob_joint),
        landmark_joint=np.array([left.index(above(j)) for j in motion.landmark_joint]),
    )


@pytest.mark.parametrize(
    ("kept", "divided"),
    [
        ((1, 5), {"Spine1": ("Spine", "Spine2", 1 / 2)}),
        ((5,), {"Spine": ("Hips", "Spine2", 1 / 3), "Spine1": ("Hips", "Spine2", 2 / 3)}),
    ],
)
def test_a_shorter_spine_is_divided(dancing, tmp_path, kept, divided):
    still = dataclasses.replace(dancing, world_from_joint=dancing.world_from_joint[:1].repeat(40, axis=0))
    write_lafan1(tmp_path / "a.bvh", with_spine(still, kept))
    places, _ = read(tmp_path / "a.bvh")
    np.testing.assert_allclose(places["Spine2"], y_up(still, "spine5_bend"), atol=METRES)
    for name, (low, high, part) in divided.items():
        np.testing.assert_allclose(places[name], (1 - part) * places[low] + part * places[high], atol=METRES)


def test_a_bone_that_changes_its_length_is_refused(dancing, tmp_path):
    with pytest.raises(InputError, match="constant length"):
        write_lafan1(tmp_path / "a.bvh", with_spine(dancing, (5,)))
    assert not (tmp_path / "a.bvh").exists()


def standing(body):
    """Someone who rocks on unsteady feet for two seconds."""
    t = np.arange(100) / FPS
    rock = 0.01 * np.sin(3.0 * t)
    return posed(body, 100, root_x=rock, root_y=rock, left_knee=0.4, left_hip_bend=0.2, right_knee=0.3 + rock)


def test_feet_that_stand_do_not_slide(body, tmp_path):
    motion = standing(body)
    said = write_lafan1(tmp_path / "a.bvh", motion)
    places, _ = read(tmp_path / "a.bvh")
    slides = lambda points: np.linalg.norm(np.diff(points, axis=0), axis=-1)
    feet = {"LeftFoot": "left_ankle", "LeftToe": "left_toe", "RightFoot": "right_ankle", "RightToe": "right_toe"}
    before = 1000.0 * np.mean([slides(motion.joint(ours)).mean() for ours in feet.values()])
    assert float(said.split("slid ")[1].split()[0]) == pytest.approx(before, abs=0.06)
    assert max(slides(places[name]).max() for name in feet) < METRES
    for name, ours in SAME.items():
        np.testing.assert_allclose(places[name], y_up(motion, ours), atol=METRES)
    np.testing.assert_allclose(np.linalg.norm(places["LeftLeg"] - places["LeftUpLeg"], axis=-1), 0.43, atol=METRES)


def test_a_step_is_taken_between_two_places_without_a_jump(body):
    """The left foot stands, is lifted 0.2 m high and 0.4 m on, and stands again, a little unsteady each time."""
    t = np.arange(120)
    lifted = np.clip((t - 50) / 20.0, 0.0, 1.0)
    swing = np.sin(np.pi * lifted)
    motion = posed(body, 120, root_x=0.004 * np.sin(0.3 * t), left_hip_bend=0.7 * swing + 0.2 * lifted, left_knee=swing)
    before = figure_of("a.bvh", motion, "z")
    after, said = standing_feet(before, 1.0 / FPS)
    foot = NAMES.index("LeftFoot")
    steps = [np.linalg.norm(np.diff(each.positions[:, foot], axis=0), axis=-1) for each in (before, after)]
    assert "standing feet slid" in said
    assert steps[1][5:45].max() < 1e-5
    assert np.abs(steps[1] - steps[0]).max() < 0.008
    np.testing.assert_allclose(after.positions[58:62, foot], before.positions[58:62, foot], atol=1e-6)


def test_a_contact_begins_low_and_slow_and_ends_later():
    height = np.array([0.2, 0.04, 0.01, 0.01, 0.04, 0.2, 0.04, 0.2])
    speed = np.array([1.0, 0.2, 0.1, 0.1, 0.2, 1.0, 0.2, 1.0])
    assert contacts(height, speed).tolist() == [False, True, True, True, True, False, False, False]


def test_the_joint_between_two_bones_by_hand():
    """Bones of 3 and 4 with ends 5 apart meet at a right angle; out of reach they are straight."""
    start, near = np.zeros((2, 3)), np.array([[1.0, 1.0, 0.0]] * 2)
    end = np.array([[5.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    met = middle_joint(start, near, end, (3.0, 4.0))
    np.testing.assert_allclose(met, [[1.8, 2.4, 0.0], [3.0, 0.0, 0.0]], atol=1e-9)
    turned = shortest_turns(np.array([[1.0, 0.0, 0.0]]), np.array([[0.0, 2.0, 0.0]]))
    np.testing.assert_allclose(turned[0], Rotation.from_euler("z", 90, degrees=True).as_matrix(), atol=1e-9)


def test_a_dog_and_what_is_no_dialect_are_refused(capsys, body, tmp_path):
    dog = shipped("dog")
    motion = motion_from_poses(dog, np.zeros((3, dog.skeleton.num_dofs), np.float32), FPS)
    save_motion(tmp_path / "motion.npz", motion)
    source = f"motion={tmp_path / 'motion.npz'}"
    assert "that of a person" in refused(capsys, "export", source, f"to={tmp_path / 'a.bvh'}", "dialect=lafan1")
    assert "lafan1" in refused(capsys, "export", source, f"to={tmp_path / 'a.bvh'}", "dialect=smpl")
    assert "leave it out" in refused(capsys, "export", source, f"to={tmp_path / 'a.trc'}", "dialect=lafan1")
    assert [path.name for path in tmp_path.iterdir()] == ["motion.npz"]
    with pytest.raises(InputError, match="that of a person"):
        check_formats(OutputsConfig(formats=["lafan1.bvh"]), [dog])
    check_formats(OutputsConfig(formats=["lafan1.bvh", "mot"]), [body])


def test_the_command_and_the_names_of_a_runs_files(capsys, body, tmp_path):
    save_motion(tmp_path / "motion.npz", standing(body))
    out, _ = done(capsys, "export", f"motion={tmp_path / 'motion.npz'}", f"to={tmp_path / 'a.bvh'}", "dialect=lafan1")
    assert "standing feet slid" in out
    assert "ROOT Hips" in (tmp_path / "a.bvh").read_text()
    kind = MOTIONS[".lafan1.bvh"]
    assert kind.of(tmp_path, "anna", 2).name == "motion_anna.lafan1.bvh"
    assert kind.matches("motion_anna.lafan1.bvh")


def test_the_angles_of_the_file_are_those_of_the_motion(dancing, tmp_path):
    """Read as another system's motion: its bones' axes differ, its angles do not."""
    write_lafan1(tmp_path / "a.bvh", dancing)
    found = evaluate_against_reference(dancing, load_reference(tmp_path / "a.bvh"), offset=0.0)
    assert {"knee_angle_l", "hip_flexion_r", "arm_add_l", "lumbar_bending"} <= {each.name for each in found.angles}
    assert max(each.mean_abs for each in found.angles) < 0.2
    assert np.nanmax(found.joints.errors) < METRES
    assert any("Spine1" in note for note in found.notes)
