"""Skeletons of other programs become bodies that move as their files say."""

import time
import warnings

import jax.numpy as jnp
import numpy as np
import pytest
import yaml
from body_cases import reference_frames
from command_line import done, refused
from damaged import FUZZ, damaged
from hypothesis import given
from scipy.spatial.transform import Rotation
from skeleton_cases import BVH, DOF_TEXT, DOFS, JOINTS, MARKERS, MOTION, skeleton_text
from slow_values import fast_and_slow

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body, save_body
from sogjax.io.motion import load_motion
from sogjax.io.skeletons.load import read_skeleton
from sogjax.io.skeletons.skeletool import read_skeletool_motion
from sogjax.model.rotation import world_from_upright
from sogjax.model.shape import ShapeModel

with warnings.catch_warnings():
    warnings.simplefilter("ignore", PendingDeprecationWarning)  # of PyGLM, which bvhio imports by its old name
    import bvhio

METRES = 1e-5


def in_file(values):
    """The joints' places (millimetres), by the rule of the file: parent, then offset x scale, then the axis."""
    rows = {row[0]: row for row in JOINTS}
    params = dict.fromkeys(rows, 0.0)
    for (_, weights), value in zip(DOFS.values(), values, strict=True):
        for joint, weight in weights.items():
            params[joint] += weight * value

    def frame(name):
        if name == "none":
            return np.eye(4)
        _, kind, parent, offset, axis, scale = rows[name]
        axis, local = np.array(axis) / np.linalg.norm(axis), np.eye(4)
        local[:3, 3] = np.array(offset) * scale
        if kind == "revolute":
            local[:3, :3] = Rotation.from_rotvec(params[name] * axis).as_matrix()
        else:
            local[:3, 3] += params[name] * axis
        return frame(parent) @ local

    return {name: frame(name) for name in rows}


def as_in_file(body, up="y"):
    """The body in the axes of its file."""
    return body.rotated(jnp.asarray(world_from_upright(up), body.blob_sigmas.dtype))


@pytest.fixture
def skeleton(tmp_path):
    path = tmp_path / "their.skeleton"
    path.write_bytes(skeleton_text().encode())
    return path


@pytest.mark.parametrize("up", ["y", "z", "-y"])
def test_a_skeleton_moves_as_its_file_says(skeleton, up):
    body = as_in_file(read_skeleton(skeleton, up=up), up)
    assert body.skeleton.dof_names == tuple(DOFS)
    assert not body.skeleton.names.index("shoulder") > body.skeleton.names.index("elbow")
    for seed in range(3):
        values = np.random.default_rng(seed).uniform(-1.0, 1.0, 4) * [800.0, 500.0, 3.0, 1.0]
        expected = in_file(values)
        frames = reference_frames(body.skeleton, values / [1000.0, 1000.0, 1.0, 1.0])
        for name, frame in zip(body.skeleton.names, frames, strict=True):
            np.testing.assert_allclose(frame[:3, 3], expected[name][:3, 3] / 1000.0, atol=METRES)
            np.testing.assert_allclose(frame[:3, :3], expected[name][:3, :3], atol=METRES)


def test_limits_markers_and_groups(skeleton):
    body = as_in_file(read_skeleton(skeleton))
    np.testing.assert_allclose(body.skeleton.dof_lower, [-np.inf, -0.9, -np.inf, -1.5], rtol=1e-6)
    np.testing.assert_allclose(body.skeleton.dof_upper, [np.inf, 0.9, np.inf, 0.5], rtol=1e-6)
    assert body.landmarks.names == ("marker_a",)
    np.testing.assert_allclose(body.landmarks.offsets, [[0.01, 0.02, 0.03]], rtol=1e-5)
    assert body.blobs.names == ("belly", "fist")
    np.testing.assert_allclose(body.blob_sigmas, np.array([0.12, 0.054]) / 1.35, rtol=1e-5)
    np.testing.assert_allclose(body.blob_colors, [[0.5, 0.5, 0.5], [1.0, 0.5, 0.0]], rtol=1e-5)
    assert [(group.name, group.joint_offsets) for group in body.shape_groups] == [("arm", ("elbow", "hand"))]


def test_a_dof_file_replaces_the_degrees_of_freedom(skeleton, tmp_path):
    (tmp_path / "their.dof").write_text(DOF_TEXT)
    body = read_skeleton(skeleton, tmp_path / "their.dof")
    assert body.skeleton.dof_names == ("bend", "slide")
    transform = np.asarray(body.skeleton.parameter_transform)
    expected = {("shoulder", 0): 0.5, ("elbow", 0): 1.0, ("elbow", 1): 0.001, ("ty", 1): 0.002}
    for row, joint in enumerate(body.skeleton.names):
        np.testing.assert_allclose(transform[row], [expected.get((joint, k), 0.0) for k in range(2)], rtol=1e-6)
    np.testing.assert_allclose(body.skeleton.dof_upper, [1.0, np.inf])


LISTED = [
    "Hips_rz",
    "Hips_rx",
    "Hips_ry",
    "Hips_tx",
    "Hips_ty",
    "Hips_tz",
    "Spine_rz",
    "Spine_rx",
    "Spine_ry",
    "LeftArm_ry",
    "LeftArm_rz",
    "LeftArm_rx",
    "RightArm_ry",
    "RightArm_rz",
    "RightArm_rx",
    "LeftLeg_rx",
]
"""The channels in the order of the file."""


def test_a_bvh_hierarchy_moves_as_bvhio_says(tmp_path):
    path = tmp_path / "their.bvh"
    path.write_text(BVH)
    body = as_in_file(read_skeleton(path, unit="cm"))
    root = bvhio.readAsHierarchy(str(path))
    for frame, row in enumerate(BVH.splitlines()[-2:]):
        given_values = dict(zip(LISTED, map(float, row.split()), strict=True))
        pose = [given_values[d] * (0.01 if "_t" in d else np.pi / 180) for d in body.skeleton.dof_names]
        frames = reference_frames(body.skeleton, pose)
        root.loadPose(frame)
        for joint, _, _ in root.layout():
            landmark = body.landmarks.names.index(joint.Name)
            place = frames[body.landmarks.joints[landmark]][:3, 3]
            np.testing.assert_allclose(place, np.array(joint.PositionWorld) / 100.0, atol=1e-4)


def test_blobs_lie_along_the_bones_and_grow_with_them(tmp_path):
    path = tmp_path / "their.bvh"
    path.write_text(BVH.replace("Spine\n  {", "Spine {"))  # as some programs write it
    body = read_skeleton(path, unit="cm")
    along = {name: k for k, name in enumerate(body.blobs.names)}
    leg = [name for name in along if name.startswith("LeftLeg") and "_end" in name]
    assert len(leg) == 4
    places = np.asarray(body.blobs.offsets)[[along[name] for name in leg]]
    end = np.array([0.02, 0.0, -0.8])  # in the upright frame: forward, left, up
    np.testing.assert_allclose(places, np.array([[1], [3], [5], [7]]) / 8 * end, atol=METRES)
    np.testing.assert_allclose(
        np.asarray(body.blob_sigmas)[[along[n] for n in leg]], 0.52 * np.linalg.norm(end) / 4, rtol=1e-4
    )
    assert len([name for name in along if name.startswith("LeftLeg_rx_bone")]) == 2
    groups = {group.name: group for group in body.shape_groups}
    both = groups["Arm_ry_bone_length"]
    assert both.joint_offsets == ("LeftArm_ry", "RightArm_ry")
    assert {name.split("_")[0] for name in both.blob_offsets} == {"LeftArm", "RightArm"}
    model = ShapeModel.from_body(body)
    longer = model.shaped(0.1 * jnp.asarray([name == "Arm_ry_bone_length" for name in model.names], jnp.float32))
    assert longer.skeleton.offsets[body.skeleton.names.index("LeftArm_ry")][1] > 0.19


def test_without_sized_markers_blobs_go_along_the_bones_of_a_skeleton(tmp_path):
    (tmp_path / "a.skeleton").write_text(skeleton_text(MARKERS[:1]))
    body = read_skeleton(tmp_path / "a.skeleton")
    assert {name.rstrip("1234") for name in body.blobs.names} == {
        "turn_bone", "shoulder_bone", "elbow_bone", "hand_bone"
    }  # fmt: skip
    arm = next(group for group in body.shape_groups if group.name == "arm")
    assert arm.joint_offsets == ("elbow", "hand")
    assert {name.rstrip("1234") for name in arm.blob_offsets} == {"elbow_bone", "hand_bone"}


def test_bodies_survive_their_file(skeleton, tmp_path):
    (tmp_path / "their.bvh").write_text(BVH)
    for path, unit in ((skeleton, None), (tmp_path / "their.bvh", "cm")):
        body = read_skeleton(path, unit=unit)
        save_body(tmp_path / "body.yaml", body)
        again = load_body(tmp_path / "body.yaml")
        assert again.skeleton.names == body.skeleton.names
        assert again.shape_groups == body.shape_groups
        pose = np.linspace(-0.3, 0.4, body.skeleton.num_dofs)
        np.testing.assert_allclose(
            reference_frames(again.skeleton, pose), reference_frames(body.skeleton, pose), atol=1e-6
        )


def test_the_commands(skeleton, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "its name.bvh").write_text(BVH)
    out, _ = done(capsys, "body", "from=their.skeleton", "out=body.yaml")
    assert "6 joints, 4 degrees of freedom, 2 blobs" in out
    assert yaml.safe_load((tmp_path / "body.yaml").read_text())["unit"] == "m"
    done(capsys, "body", "from=its name.bvh", "unit=cm", "out=other.yaml")

    values = np.array([[0, 100.0, -200.0, 0.5, -1.0], [3, 110.0, -190.0, 0.6, 0.25]])
    rows = "\n".join(" ".join(map(str, row)) for row in values.tolist()).replace("3.0 ", "3 ", 1)
    (tmp_path / "their.motion").write_text(f"Skeletool Motion File V1.0\n{rows}\n")
    there = ("export", "motion=their.motion", "actor=body.yaml", "fps=25", "up=y", "to=ours.npz")
    done(capsys, *there)
    motion = load_motion(tmp_path / "ours.npz")
    assert (motion.fps, motion.up, motion.frame.tolist()) == (25.0, "y", [0, 3])
    for t, row in enumerate(values):
        for name, frame in in_file(row[1:]).items():
            place = motion.world_from_joint[t, motion.joint_names.tolist().index(name), :3, 3]
            np.testing.assert_allclose(place, frame[:3, 3] / 1000.0, atol=METRES)

    done(capsys, "export", "motion=ours.npz", "actor=body.yaml", "to=back.motion")
    lines = (tmp_path / "back.motion").read_text().splitlines()
    assert lines[0] == "Skeletool Motion File V1.0"
    np.testing.assert_allclose(np.array([line.split() for line in lines[1:]], float), values, rtol=1e-6)

    assert "fps=" in refused(capsys, "export", "motion=their.motion", "actor=body.yaml", "to=no.npz")
    assert "actor=" in refused(capsys, "export", "motion=their.motion", "fps=25", "to=no.npz")
    assert "actor=" in refused(capsys, "export", "motion=ours.npz", "to=no.motion")
    assert "degrees of freedom" in refused(capsys, "export", "motion=ours.npz", "actor=human", "to=no.motion")
    assert "5 degrees" not in refused(capsys, "export", "motion=their.motion", "actor=human", "fps=9", "to=no.npz")
    assert "from=" in refused(capsys, "body", "out=no.yaml")
    assert "unit" in refused(capsys, "body", "from=its name.bvh", "out=no.yaml")
    assert "mile" in refused(capsys, "body", "from=its name.bvh", "unit=mile", "out=no.yaml")
    assert "not a skeleton" in refused(capsys, "body", "from=body.yaml", "out=no.yaml")
    assert "leave it out" in refused(capsys, "body", "from=its name.bvh", "dof=a.dof", "out=no.yaml")
    assert not list(tmp_path.glob("no.*"))


WRONG = [
    ("joints: 6", "joints: 1000000000", "line 2 is 'joints: 1000000000'.*at most"),
    ("joints: 6", "joints: 5", "one of"),
    ("joints: 6", "joints: 6.5", "whole number"),
    ("joints: 6", "joints: many", "whole number"),
    ("Definition V1.0", "Definition V2.0", "not a skeleton of a known format"),
    ("revolute shoulder", "ball shoulder", r"joints\[0\]\.kind is 'ball'.*revolute"),
    ("prismatic tx", "prismatic elbo", r"parent is 'elbo'"),
    ("prismatic none", "prismatic hand", "cycle"),
    ("0.0 0.0 2.0 1.1", "0.0 0.0 0.0 1.1", r"joints\[0\]\.axis"),
    ("310.0", "nan", "line 3"),
    ("310.0", "1e300", "line 3"),
    ("310.0", "", "line 3.*a joint"),
    ("310.0", "310000.0", "unit="),
    ("turn point 10", "turn oriented 10", "a marker"),
    ("belly turn", "belly torso", r"blobs\[0\]\.joint is 'torso'"),
    ("120", "0", r"blobs\[0\]\.sigma"),
    ("255 127.5 0", "255 127.5", "a marker"),
    ("arm 2", "arm 2000", "at most"),
    ("scaling joints: 1\r\narm 2\r\nelbow", "scaling joints: 1\r\narm 2\r\nelbox", "elbox"),
    ("limits -1.5 0.5", "limits 0.5 -1.5", "lower limit before"),
    ("limits -1.5 0.5", "limit -1.5 0.5", "limits LOW HIGH"),
    ("elbow -0.5", "elbo -0.5", "elbo"),
    ("heading 1", "heading 0", "joint and its weight|limits|name and number"),
    ("dofs: 4", "dofs: 4 4", "one of"),
    ("hand 20.0\r\n", "", "ends where"),
]


@pytest.mark.parametrize(("old", "new", "message"), WRONG)
def test_what_is_wrong_in_a_skeleton_is_named(skeleton, old, new, message):
    text = skeleton_text()
    assert old in text
    skeleton.write_bytes(text.replace(old, new, 1).encode())
    begin = time.perf_counter()
    with pytest.raises(InputError, match=message) as error:
        read_skeleton(skeleton)
    assert time.perf_counter() - begin < 5.0
    assert str(skeleton) in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("dofs: 2", "dofs: 99999999", "at most"),
        ("dofs: 2", "joints: 2", "dofs: N"),
        ("bend 0.5 limits -1 1", "bend 0.5 limits -1", "name smoothness"),
        ("slide 1", "bend 1", "no degree of freedom before"),
        ("0 + 0.5 bend", "0.5 + 0.5 bend", "that is 0"),
        ("0 + 0.5 bend", "0 - 0.5 bend", "degrees of freedom that are listed"),
        ("0 + 0.5 bend", "0 + 0.5 bent", "degrees of freedom that are listed"),
        ("0 + 0.5 bend", "0 + 0.5", r"joint = 0"),
        ("ty = 0", "tz = 0", "'tz'"),
    ],
)
def test_what_is_wrong_in_a_dof_file_is_named(skeleton, tmp_path, old, new, message):
    assert old in DOF_TEXT
    (tmp_path / "a.dof").write_text(DOF_TEXT.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        read_skeleton(skeleton, tmp_path / "a.dof")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("CHANNELS 1 Xrotation", "CHANNELS 2 Xrotation", "CHANNELS, their number"),
        ("CHANNELS 1 Xrotation", "CHANNELS 1000000000 Xrotation", "CHANNELS, their number"),
        ("CHANNELS 1 Xrotation", "CHANNELS 1 Wrotation", "CHANNELS, their number"),
        ("OFFSET 9 -4 0", "OFFSET 9 -4", "OFFSET"),
        ("OFFSET 9 -4 0", "OFFSET 9 nan 0", "finite"),
        ("OFFSET 18 25 0", "OFFSET 18 25", "line 12 is"),
        ("OFFSET 9 -4 0", "", "OFFSET"),
        ("JOINT LeftLeg", "JOINT LeftArm", "LeftArm"),
        ("JOINT LeftLeg", "JOINT", "with a name"),
        ("ROOT Hips", "JOINT Hips", "ROOT or MOTION"),
        ("}\nMOTION\n", "MOTION\n", "ends where OFFSET, CHANNELS"),
    ],
)
def test_what_is_wrong_in_a_bvh_is_named(tmp_path, old, new, message):
    assert old in BVH
    path = tmp_path / "a.bvh"
    path.write_text(BVH.replace(old, new, 1))
    with pytest.raises(InputError, match=message) as error:
        read_skeleton(path, unit="cm")
    assert "\n" not in str(error.value)


def test_a_bvh_as_deep_as_a_file_can_be_is_refused_at_once(tmp_path):
    path = tmp_path / "deep.bvh"
    deep = "".join(f"JOINT j{k}\n{{\nOFFSET 0 1 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n" for k in range(50_000))
    path.write_text("HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\n" + deep)
    begin = time.perf_counter()
    with pytest.raises(InputError, match="at most 2000"):
        read_skeleton(path, unit="cm")
    assert time.perf_counter() - begin < 5.0


def only_input_errors(read, *arguments, **keywords):
    try:
        read(*arguments, **keywords)
    except InputError as error:
        message = str(error)
    else:
        message = ""
    assert "\n" not in message


@pytest.mark.parametrize("kind", fast_and_slow("skeleton", "dof", "bvh"))
def test_a_damaged_file_is_read_or_refused(skeleton, tmp_path, kind):
    text = {"skeleton": skeleton_text(), "dof": DOF_TEXT, "bvh": BVH}[kind]
    path = tmp_path / f"damaged.{kind}"

    @FUZZ
    @given(damaged(text))
    def fuzz(changed):
        path.write_bytes(changed.encode("utf-8", errors="surrogatepass"))
        if kind == "dof":
            only_input_errors(read_skeleton, skeleton, path)
        else:
            only_input_errors(read_skeleton, path, unit="cm" if kind == "bvh" else None)

    fuzz()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("V1.0", "V3.0", "the header"),
        ("3 4\n", "3\n", "line 2.*4 numbers"),
        ("8.5", "nan", "line 3.*4 numbers"),
        ("\n1 5", "\n0 5", "line 3.*increase"),
        ("\n1 5", "\n1.5 5", "line 3.*whole"),
    ],
)
def test_what_is_wrong_in_a_motion_is_named(skeleton, tmp_path, old, new, message):
    assert old in MOTION
    (tmp_path / "a.motion").write_text(MOTION.replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        read_skeletool_motion(tmp_path / "a.motion", read_skeleton(skeleton), 25.0)


def test_a_damaged_motion_is_read_or_refused(skeleton, tmp_path):
    body, path = read_skeleton(skeleton), tmp_path / "damaged.motion"

    @FUZZ
    @given(damaged(MOTION))
    def fuzz(changed):
        path.write_bytes(changed.encode("utf-8", errors="surrogatepass"))
        only_input_errors(read_skeletool_motion, path, body, 25.0)

    fuzz()
