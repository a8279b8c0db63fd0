"""What another library reads from a BVH file is the motion."""

import dataclasses
import warnings

import numpy as np
import pytest
from tiny_body import make_body, random_poses

from sogjax.errors import InputError
from sogjax.io.export.bvh import write_bvh
from sogjax.io.export.write import export_motion
from sogjax.io.motion import load_motion, motion_from_poses

with warnings.catch_warnings():
    warnings.simplefilter("ignore", PendingDeprecationWarning)  # of PyGLM, which bvhio imports by its old name
    import bvhio

BODY = make_body()
METRES = 1e-4

BONES = {
    "root": "root_rx",
    "spine": "spine_twist",
    "left_shoulder": "left_shoulder_roll",
    "left_elbow": "left_elbow",
    "neck": "neck",
    "telescope": "telescope",
    "head": "head",
    "left_hip": "left_hip",
}
"""The BVH joints of the body, and the one-axis joint in which each chain of one origin ends."""


@pytest.fixture(scope="module")
def motion():
    return motion_from_poses(BODY, random_poses(BODY, 6, seed=3), 25.0, frame=np.arange(6) * 2)


def joints_read(path):
    """By name the world positions of the joints in every frame, and the file's frame time."""
    container = bvhio.readAsBvh(str(path))
    root = bvhio.readAsHierarchy(str(path))
    names = [joint.Name for joint, _, _ in root.layout()]
    positions = {name: [] for name in names}
    for frame in range(container.FrameCount):
        root.loadPose(frame)
        for joint, _, _ in root.layout():
            positions[joint.Name].append(list(joint.PositionWorld))
    return {name: np.array(values) for name, values in positions.items()}, container


def y_up(points, up):
    """Points of a world with the vertical `up`, in the axes of BVH: y up, z forward; written out by hand."""
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack({"z": (y, z, x), "y": (x, y, z), "-y": (-x, -y, z)}[up], -1)


@pytest.mark.parametrize("up", ["z", "y", "-y"])
def test_all_joints_are_where_they_were_in_every_frame(motion, tmp_path, up):
    path = tmp_path / "walk.bvh"
    write_bvh(path, motion, up)
    read, container = joints_read(path)
    assert set(read) == set(BONES)
    for name, joint in BONES.items():
        index = motion.joint_names.tolist().index(joint)
        expected = y_up(motion.world_from_joint[:, index, :3, 3], up)
        np.testing.assert_allclose(read[name], expected, atol=METRES)
    assert container.FrameCount == 6
    np.testing.assert_allclose(container.FrameTime, 2 / 25.0)


def test_the_rest_pose_stands_upright_and_looks_along_z(tmp_path):
    """With all channels zero, BVH shows the offsets: the left shoulder to +x, the head to +y."""
    motion = motion_from_poses(BODY, np.zeros((1, BODY.skeleton.num_dofs)), 25.0)
    write_bvh(tmp_path / "rest.bvh", motion)
    read, container = joints_read(tmp_path / "rest.bvh")
    np.testing.assert_allclose(read["left_shoulder"], [[0.2, 0.5, 0.0]], atol=METRES)
    np.testing.assert_allclose(read["head"], [[0.0, 0.35, 0.0]], atol=METRES)
    ends = {}
    stack = [container.Root]
    while stack:
        joint = stack.pop()
        stack += joint.Children
        if not joint.Children:
            ends[joint.Name] = list(joint.EndSite)
    np.testing.assert_allclose(ends["head"], [0.0, 0.1, 0.1], atol=METRES)
    np.testing.assert_allclose(ends["left_elbow"], [0.25, 0.0, 0.0], atol=METRES)
    assert np.linalg.norm(ends["left_hip"]) > 0.01


def test_only_the_root_and_what_slides_have_position_channels(motion, tmp_path):
    write_bvh(tmp_path / "walk.bvh", motion)
    lines = [line.split() for line in (tmp_path / "walk.bvh").read_text().splitlines()]
    names = [line[1] for line in lines if line[0] in ("ROOT", "JOINT")]
    channels = [int(line[1]) for line in lines if line[0] == "CHANNELS"]
    assert {name for name, count in zip(names, channels, strict=True) if count == 6} == {"root", "telescope"}
    assert set(channels) == {3, 6}


def test_angles_do_not_jump_while_a_joint_turns_around(tmp_path):
    poses = np.zeros((80, BODY.skeleton.num_dofs))
    poses[:, BODY.skeleton.dof_names.index("root_rz")] = np.linspace(0.0, 4.0 * np.pi, 80)
    write_bvh(tmp_path / "turn.bvh", motion_from_poses(BODY, poses, 25.0))
    rows = (tmp_path / "turn.bvh").read_text().split("Frame Time:")[1].splitlines()[1:]
    steps = np.abs(np.diff(np.array([row.split() for row in rows], float)[:, 3:], axis=0))
    assert steps.max() < 10.0


def test_a_joint_at_the_singularity_of_its_angles(tmp_path):
    poses = np.zeros((2, BODY.skeleton.num_dofs))
    poses[:, BODY.skeleton.dof_names.index("root_ry")] = [np.pi / 2, -np.pi / 2]
    motion = motion_from_poses(BODY, poses, 25.0)
    write_bvh(tmp_path / "a.bvh", motion)
    read, _ = joints_read(tmp_path / "a.bvh")
    elbow = motion.joint_names.tolist().index("left_elbow")
    expected = y_up(motion.world_from_joint[:, elbow, :3, 3], "z")
    np.testing.assert_allclose(read["left_elbow"], expected, atol=METRES)


def test_two_roots_hang_from_one(motion, tmp_path):
    """A person with a prop: the hip becomes a root of its own, in the same place."""
    parents = motion.joint_parents.copy()
    hip = motion.joint_names.tolist().index("left_hip")
    parents[hip] = -1
    write_bvh(tmp_path / "two.bvh", dataclasses.replace(motion, joint_parents=parents))
    read, _ = joints_read(tmp_path / "two.bvh")
    expected = y_up(motion.world_from_joint[:, hip, :3, 3], "z")
    np.testing.assert_allclose(read["left_hip"], expected, atol=METRES)
    np.testing.assert_allclose(read["world"], np.zeros((6, 3)), atol=METRES)


def test_the_ending_chooses_the_format(motion, tmp_path):
    export_motion(motion, tmp_path / "walk.BVH", "z")
    assert (tmp_path / "walk.BVH").read_text().startswith("HIERARCHY")
    export_motion(motion, tmp_path / "walk.npz")
    np.testing.assert_array_equal(load_motion(tmp_path / "walk.npz").pose, motion.pose)
    with pytest.raises(InputError, match=r"walk\.xyz.*'\.xyz'.*\.bvh"):
        export_motion(motion, tmp_path / "walk.xyz")


def test_what_bvh_cannot_hold_is_refused(motion, tmp_path):
    uneven = dataclasses.replace(motion, frame=np.array([0, 1, 2, 3, 4, 9]))
    with pytest.raises(InputError, match=r"a\.bvh.*1 to 5 apart"):
        write_bvh(tmp_path / "a.bvh", uneven)
    empty = motion_from_poses(BODY, np.zeros((0, BODY.skeleton.num_dofs)), 25.0)
    with pytest.raises(InputError, match="no frames"):
        write_bvh(tmp_path / "a.bvh", empty)
    assert list(tmp_path.iterdir()) == []
