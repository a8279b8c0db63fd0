"""Markers and joint angles for biomechanics: names that OpenSim knows, and signs that a textbook has."""

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from command_line import done, refused
from motion_cases import walking_motion
from scipy.spatial.transform import Rotation

from sogjax.errors import InputError
from sogjax.io.export.angles import angles_not_told, joint_angles, segment_angles
from sogjax.io.export.points import marker_points
from sogjax.io.motion import motion_from_poses
from sogjax.io.motion_data import save_motion
from sogjax.model.reach import reach, told_dofs
from sogjax.model.rotation import world_from_upright
from sogjax.quality.limb_warnings import joints_at_limits, limits_of

DEGREES = 0.01


@pytest.fixture(scope="module")
def body():
    return shipped("human")


def posed(body, up="z", **values):
    """One frame of a body that stands upright in a world with the vertical `up`."""
    pose = np.zeros((1, body.skeleton.num_dofs), np.float32)
    for name, value in values.items():
        pose[0, body.skeleton.dof_names.index(name)] = value
    return motion_from_poses(body.rotated(jnp.asarray(world_from_upright(up), jnp.float32)), pose, 25.0, up=up)


def others_are_zero(angles, *known):
    return all(abs(v[0]) < DEGREES for name, v in angles.items() if name not in known and not name.startswith("pelvis"))


@pytest.mark.parametrize("up", ["z", "y", "-y"])
@pytest.mark.parametrize(
    ("dof", "angle"),
    [
        ("left_knee", {"knee_angle_l": 1}),
        ("right_hip_bend", {"hip_flexion_r": 1}),
        ("right_hip_side", {"hip_adduction_r": -1}),
        ("left_hip_side", {"hip_adduction_l": -1}),
        ("left_ankle_bend", {"ankle_angle_l": 1}),
        ("right_elbow", {"elbow_flex_r": 1}),
        ("spine_bend", {"lumbar_extension": -1}),
    ],
)
def test_each_degree_of_freedom_is_its_angle(body, up, dof, angle):
    motion = posed(body, up, **{dof: 0.4})
    angles = joint_angles(motion, up)
    for name, sign in angle.items():
        assert angles[name][0] == pytest.approx(sign * np.rad2deg(0.4), abs=0.05)
    assert others_are_zero(angles, *angle)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_leg_to_the_side_is_abduction_and_an_arm_forward_flexion(body, side):
    """Told by where the points are, not by the sign of a degree of freedom."""
    end, outward = f"_{side[0]}", 1.0 if side == "left" else -1.0
    leg = posed(body, **{f"{side}_hip_side": 0.3})
    moved = leg.joint(f"{side}_ankle")[0, 1] - posed(body).joint(f"{side}_ankle")[0, 1]
    assert np.sign(joint_angles(leg)[f"hip_adduction{end}"][0]) == -np.sign(outward * moved)
    arm = posed(body, **{f"{side}_shoulder_raise": 0.5, f"{side}_shoulder_swing": 0.5})
    assert arm.joint(f"{side}_elbow")[0, 0] > posed(body).joint(f"{side}_elbow")[0, 0] + 0.1
    assert joint_angles(arm)[f"arm_flex{end}"][0] > 20.0


def test_the_pelvis_in_the_ground_of_a_trc(body):
    angles = joint_angles(posed(body, root_x=1.0, root_y=2.0, root_z=3.0, root_yaw=0.5))
    place = [angles[name][0] for name in ("pelvis_tx", "pelvis_ty", "pelvis_tz")]
    np.testing.assert_allclose(place, [2.0, 3.0, 1.0], atol=1e-5)
    turned = angles["pelvis_rotation"][0] - joint_angles(posed(body))["pelvis_rotation"][0]
    assert turned == pytest.approx(np.rad2deg(0.5), abs=DEGREES)


def test_extremities_are_markers_and_rolling_bones_are_not(body):
    motion = posed(body, left_knee=0.5)
    names, positions = marker_points(motion, "z", "z")
    assert {"LBigToe", "RSmallToe", "LHeel", "RHand", "Head", "RKnee", "Hip"} <= set(names)
    assert not [name for name in names if "roll" in name]
    np.testing.assert_allclose(positions[:, names.index("LBigToe")], motion.joint("left_toe"), atol=1e-6)
    assert [name for name in marker_points(motion, "z", "z", "all")[0] if "roll" in name]


def test_mot_is_what_opensim_reads(capsys, tmp_path, body):
    save_motion(tmp_path / "motion.npz", posed(body, left_knee=0.5))
    done(capsys, "export", f"motion={tmp_path / 'motion.npz'}", f"to={tmp_path / 'walk.mot'}")
    lines = (tmp_path / "walk.mot").read_text().splitlines()
    end = lines.index("endheader")
    header = dict(line.split("=") for line in lines[1:end])
    names, row = lines[end + 1].split("\t"), np.array(lines[end + 2].split("\t"), float)
    assert (header["nRows"], int(header["nColumns"]), header["inDegrees"]) == ("1", len(names), "yes")
    assert names[0] == "time"
    assert "pro_sup_l" in header["not_told"].split()
    assert row[names.index("knee_angle_l")] == pytest.approx(np.rad2deg(0.5), abs=DEGREES)


def test_an_arm_that_circles_comes_back_to_its_angles(body):
    """Round the place where two of them mean nothing, and back down: no turn is left over. The pelvis counts turns."""
    names, around = body.skeleton.dof_names, np.linspace(0.0, 2.0 * np.pi, 40)
    pose = np.zeros((41, body.skeleton.num_dofs), np.float32)
    pose[1:, names.index("left_shoulder_raise")] = np.pi / 2 + 0.3 * np.cos(around)
    pose[1:, names.index("left_shoulder_swing")] = 0.3 * np.sin(around)
    pose = np.concatenate([pose, pose[:1]])
    pose[:, names.index("root_yaw")] = np.linspace(0.0, 4.0 * np.pi, len(pose))
    motion = motion_from_poses(body.rotated(jnp.asarray(world_from_upright("z"), jnp.float32)), pose, 25.0, up="z")
    angles = joint_angles(motion)
    for name in ("arm_flex_l", "arm_add_l", "arm_rot_l"):
        assert angles[name][-1] == pytest.approx(angles[name][0], abs=DEGREES)
        assert np.abs(angles[name]).max() <= 180.0
    assert abs(angles["pelvis_rotation"][-1] - angles["pelvis_rotation"][0]) == pytest.approx(720.0, abs=1.0)


def test_an_arm_swung_round_twice_has_turned_by_720_degrees():
    """By hand: two turns about Z (to the right), after which the arm is held 40 degrees off and 20 turned."""
    flexed = np.linspace(0.0, 720.0, 61)
    fixed = np.tile([40.0, 20.0], (61, 1))
    in_opensim = Rotation.from_euler("ZXY", np.column_stack([flexed, fixed]), degrees=True).as_matrix()
    body_from_opensim = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # forward, left, up
    arm = body_from_opensim @ in_opensim @ body_from_opensim.T
    angles = segment_angles({"chest": np.tile(np.eye(3), (61, 1, 1)), "right_upper_arm": arm}, "z")
    whole_turns = 360.0 * np.round((angles["arm_flex_r"] - flexed).mean() / 360.0)
    np.testing.assert_allclose(angles["arm_flex_r"] - whole_turns, flexed, atol=DEGREES)
    np.testing.assert_allclose(np.stack([angles["arm_add_r"], angles["arm_rot_r"]], axis=1), fixed, atol=DEGREES)


def test_angles_as_csv_and_what_has_none(capsys, tmp_path, body):
    save_motion(tmp_path / "motion.npz", posed(body, left_knee=0.5))
    source = f"motion={tmp_path / 'motion.npz'}"
    done(capsys, "export", source, f"to={tmp_path / 'a.csv'}", "angles=true")
    head = (tmp_path / "a.csv").read_text().splitlines()
    assert "degrees" in head[0]
    assert "pro_sup_l" in head[0].partition("not told by the body's spheres: ")[2].split()
    assert "knee_angle_l" in head[1].split(",")
    assert "only .csv and .mot" in refused(capsys, "export", source, f"to={tmp_path / 'a.bvh'}", "angles=true")
    with pytest.raises(InputError, match="default one"):
        joint_angles(walking_motion())


@pytest.mark.parametrize("up", ["z", "-y"])
def test_what_spheres_do_not_tell_is_named(body, up):
    """The turn of a forearm never, that of an upper arm only where the elbow is stretched."""
    stretched, bent = (angles_not_told(posed(body, up, **bends), up) for bends in ({}, {"left_elbow": 1.5}))
    for untold in (stretched, bent):
        assert {"pro_sup_l", "pro_sup_r", "neck_rotation", "subtalar_angle_l"} <= {*untold}
        assert not {"knee_angle_l", "elbow_flex_l", "hip_flexion_r", "ankle_angle_r", "lumbar_bending"} & {*untold}
    assert {"arm_rot_l", "arm_rot_r"} <= {*stretched}
    assert {*stretched} - {*bent} == {"arm_rot_l"}


def test_the_reach_of_a_turn_by_hand():
    moved = np.array([[[0.3, 0.0, 0.4], [0.0, 0.24, 0.0]]])  # velocities of 0.5 and 0.24 m, blobs of 10 and 2 cm
    assert reach(moved, np.array([0.1, 0.02])) == pytest.approx([np.hypot(5.0, 12.0)])


def test_a_turn_that_is_not_told_is_no_joint_at_its_limit(body):
    told = dict(zip(body.skeleton.dof_names, told_dofs(body), strict=True))
    assert not told["left_forearm_roll"]
    assert not told["right_wrist_bend"]
    assert all(told[name] for name in ("root_x", "root_yaw", "left_elbow", "left_shoulder_roll", "left_hip_twist"))
    names = [*body.skeleton.dof_names]
    pose = np.zeros((10, len(names)), np.float32)
    pose[:, names.index("left_wrist_bend")] = np.asarray(body.skeleton.dof_upper)[names.index("left_wrist_bend")]
    pose[:, names.index("left_hip_twist")] = np.asarray(body.skeleton.dof_upper)[names.index("left_hip_twist")]
    assert {*joints_at_limits(motion_from_poses(body, pose, 25.0), limits_of(body))} == {"left_hip_twist"}


def test_the_file_of_a_motion_has_points_by_plain_names(tmp_path, body):
    motion = posed(body, left_knee=0.5)
    save_motion(tmp_path / "motion.npz", motion)
    with np.load(tmp_path / "motion.npz", allow_pickle=False) as file:
        place = file["points"][:, file["point_names"].tolist().index("left_ankle")]
    np.testing.assert_allclose(place, motion.joint("left_ankle"), atol=1e-6)
