"""The bodies that come with the package: counts, anatomy, symmetry, poses, shape parameters."""

import itertools

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import landmarks, posed, shipped

STANDING = 0.92
"""Metres from the floor to the root of the standing human."""

BODIES = ("human", "dog")
UP, FORWARD, LEFT = 2, 0, 1


def swapped(name):
    pairs = {"left_": "right_", "right_": "left_"}
    return next((new + name[len(old) :] for old, new in pairs.items() if name.startswith(old)), name)


def test_the_papers_counts():
    """58 joints that turn and 3 that slide, 43 pose parameters, 63 blobs, 44 shape parameters (216 - 4 x 43)."""
    human = shipped("human")
    assert human.skeleton.num_joints == 61
    assert int(human.skeleton.revolute.sum()) == 58
    assert human.skeleton.num_dofs == 43
    assert human.num_blobs == 63
    assert len(human.shape_groups) == 216 - 4 * 43


def test_landmarks_of_the_file_format():
    sides = ("shoulder", "elbow", "wrist", "hand", "hip", "knee", "ankle", "heel", "small_toe", "toe", "eye", "ear")
    expected = {"pelvis", "chest", "neck", "nose", "head_top", *(f"{s}_{n}" for s in ("left", "right") for n in sides)}
    assert set(shipped("human").landmarks.names) == expected


@pytest.mark.parametrize("name", BODIES)
def test_every_joint_is_driven_and_every_dof_drives(name):
    used = np.asarray(shipped(name).skeleton.parameter_transform) != 0.0
    assert used.any(axis=1).all()
    assert used.any(axis=0).all()


@pytest.mark.parametrize("name", BODIES)
def test_the_root_stands_first_and_is_the_origin(name):
    body = shipped(name)
    assert body.skeleton.dof_names[:6] == tuple(f"root_{dof}" for dof in ("x", "y", "z", "yaw", "pitch", "roll"))
    moved = landmarks(body, {"root_x": 1.0, "root_y": 2.0, "root_z": 3.0})["pelvis"]
    np.testing.assert_allclose(moved, [1.0, 2.0, 3.0], atol=1e-6)
    np.testing.assert_array_equal(body.poses["rest"], 0.0)
    turned = landmarks(body, {"root_yaw": np.pi / 2})
    np.testing.assert_allclose(turned["left_hip"][:2], [-landmarks(body, "rest")["left_hip"][LEFT], 0.0], atol=1e-6)


@pytest.mark.parametrize("name", BODIES)
def test_left_and_right_mirror_each_other(name):
    """The same value of left_X and right_X gives the mirrored points, in a random pose off the midline DoFs."""
    body = shipped(name)
    rng = np.random.default_rng(1)
    values = {dof: rng.uniform(-0.6, 0.6) for dof in body.skeleton.dof_names if dof.startswith(("left", "right"))}
    pose = np.array([values.get(dof, 0.0) for dof in body.skeleton.dof_names], np.float32)
    mirrored = np.array([values.get(swapped(dof), 0.0) for dof in body.skeleton.dof_names], np.float32)
    means = dict(zip(body.blobs.names, np.asarray(posed(body, jnp.asarray(pose))[0].means), strict=True))
    others = dict(zip(body.blobs.names, np.asarray(posed(body, jnp.asarray(mirrored))[0].means), strict=True))
    for blob, mean in means.items():
        np.testing.assert_allclose(others[swapped(blob)], mean * [1.0, -1.0, 1.0], atol=2e-6)
    sigmas = dict(zip(body.blobs.names, np.asarray(body.blob_sigmas), strict=True))
    assert all(sigmas[swapped(blob)] == sigma for blob, sigma in sigmas.items())
    lower, upper = (dict(zip(body.skeleton.dof_names, np.asarray(limit), strict=True)) for limit in limits_of(body))
    assert all(lower[swapped(dof)] == low for dof, low in lower.items())
    assert all(upper[swapped(dof)] == high for dof, high in upper.items())


def limits_of(body):
    return body.skeleton.dof_lower, body.skeleton.dof_upper


@pytest.mark.parametrize("name", BODIES)
def test_named_poses_keep_the_limits(name):
    body = shipped(name)
    lower, upper = (np.asarray(limit) for limit in limits_of(body))
    for pose in body.poses.values():
        assert (np.asarray(pose) >= lower).all()
        assert (np.asarray(pose) <= upper).all()


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("field", ["joint_offsets", "blob_offsets", "blob_sigmas", "landmark_offsets"])
def test_each_length_has_one_shape_parameter_tied_left_and_right(name, field):
    body = shipped(name)
    points, offsets = {
        "joint_offsets": (body.skeleton.names, body.skeleton.offsets),
        "blob_offsets": (body.blobs.names, body.blobs.offsets),
        "blob_sigmas": (body.blobs.names, body.blob_sigmas[:, None]),
        "landmark_offsets": (body.landmarks.names, body.landmarks.offsets),
    }[field]
    lengths = {point for point, offset in zip(points, np.asarray(offsets), strict=True) if offset.any()}
    scaled = [member for group in body.shape_groups for member in getattr(group, field)]
    assert len(scaled) == len(set(scaled))
    assert set(scaled) == lengths
    for group in body.shape_groups:
        assert {swapped(member) for member in getattr(group, field)} == set(getattr(group, field))


def test_proportions_of_the_human():
    """Stature 1.75 m; heights within 2 cm of the usual fractions of it (Drillis and Contini's segments)."""
    rest = landmarks(shipped("human"), "rest")
    heights = {"head_top": 1.75, "neck": 1.49, "left_shoulder": 1.42, "left_hip": 0.92, "left_knee": 0.49}
    for name, height in heights.items():
        assert rest[name][UP] + STANDING == pytest.approx(height, abs=0.02), name
    length = lambda a, b: np.linalg.norm(rest[a] - rest[b])
    assert length("left_shoulder", "left_elbow") == pytest.approx(0.29, abs=1e-6)
    assert length("left_elbow", "left_wrist") == pytest.approx(0.25, abs=1e-6)
    assert length("left_hip", "left_knee") == pytest.approx(0.43, abs=1e-6)
    assert length("left_knee", "left_ankle") == pytest.approx(0.41, abs=1e-6)


def test_named_poses_of_the_human_are_what_they_are_called():
    human = shipped("human")
    pose = {name: landmarks(human, name) for name in human.poses}
    bone = lambda name, a, b: (pose[name][b] - pose[name][a]) / np.linalg.norm(pose[name][b] - pose[name][a])
    upper, fore = ("left_shoulder", "left_elbow"), ("left_elbow", "left_wrist")
    np.testing.assert_allclose([bone("tpose", *upper), bone("tpose", *fore)], [[0, 1, 0]] * 2, atol=2e-3)
    np.testing.assert_allclose([bone("arms_forward", *upper), bone("arms_forward", *fore)], [[1, 0, 0]] * 2, atol=2e-3)
    np.testing.assert_allclose([bone("squat", *upper), bone("squat", *fore)], [[1, 0, 0]] * 2, atol=2e-3)
    np.testing.assert_allclose(bone("elbows", *upper), [0, 1, 0], atol=2e-3)
    np.testing.assert_allclose(bone("elbows", *fore), [0, 0, 1], atol=2e-3)
    np.testing.assert_allclose(bone("arms_up", *upper), [0, 0.5, 0.866], atol=2e-3)
    np.testing.assert_allclose(bone("apose", *upper), np.array([0, 1, -1]) / np.sqrt(2.0), atol=2e-3)
    np.testing.assert_allclose(bone("sit", "left_hip", "left_knee"), [1, 0, 0], atol=0.15)
    np.testing.assert_allclose(bone("sit", "left_knee", "left_ankle"), [0, 0, -1], atol=0.15)
    assert pose["walk_left"]["left_ankle"][FORWARD] > pose["walk_left"]["right_ankle"][FORWARD] + 0.4
    assert pose["walk_left"]["right_wrist"][FORWARD] > pose["walk_left"]["left_wrist"][FORWARD] + 0.2
    for name in ("left_knee", "left_wrist", "right_toe", "head_top"):
        np.testing.assert_allclose(pose["walk_right"][swapped(name)], pose["walk_left"][name] * [1, -1, 1], atol=2e-3)
    assert np.linalg.norm(pose["hands_on_hips"]["left_hand"] - pose["rest"]["left_hip"]) < 0.2


POSITIVE = {
    "spine_bend": ("head_top", FORWARD, 1), "spine_lean": ("head_top", LEFT, 1),
    "spine_twist": ("left_elbow", FORWARD, -1),
    "neck_bend": ("head_top", FORWARD, 1), "head_bend": ("head_top", FORWARD, 1), "neck_lean": ("head_top", LEFT, 1),
    "left_clavicle_raise": ("left_shoulder", UP, 1), "left_clavicle_forward": ("left_shoulder", FORWARD, 1),
    "left_shoulder_raise": ("left_elbow", UP, 1), "left_shoulder_swing": ("left_elbow", FORWARD, 1),
    "left_elbow": ("left_wrist", FORWARD, 1), "left_wrist_bend": ("left_hand", LEFT, -1),
    "left_wrist_side": ("left_hand", FORWARD, 1), "left_hip_bend": ("left_knee", FORWARD, 1),
    "left_hip_side": ("left_knee", LEFT, 1), "right_hip_side": ("right_knee", LEFT, -1),
    "left_hip_twist": ("left_toe", LEFT, -1),
    "left_knee": ("left_ankle", FORWARD, -1), "left_ankle_bend": ("left_toe", UP, 1),
}  # fmt: skip


@pytest.mark.parametrize("dof", POSITIVE)
def test_signs_of_the_humans_degrees_of_freedom(dof):
    landmark, axis, sign = POSITIVE[dof]
    human = shipped("human")
    moved = landmarks(human, {dof: 0.4})[landmark] - landmarks(human, "rest")[landmark]
    assert sign * moved[axis] > 0.01


def test_the_shoulder_rises_with_the_arm():
    """By about 5 cm with the arm overhead; pulled to rest, an arm overhead bent at the elbow instead."""
    human = shipped("human")
    rest, overhead = (
        landmarks(human, values) for values in ({}, {"left_shoulder_raise": 2.89, "left_shoulder_swing": -0.24})
    )
    upper_arm = overhead["left_elbow"] - overhead["left_shoulder"]
    np.testing.assert_allclose(upper_arm / np.linalg.norm(upper_arm), [0, 0, 1], atol=5e-3)
    assert overhead["left_shoulder"][UP] - rest["left_shoulder"][UP] == pytest.approx(0.05, abs=0.01)
    np.testing.assert_allclose(overhead["right_shoulder"], rest["right_shoulder"], atol=1e-6)


@pytest.mark.parametrize(
    "arm",
    [{}, {"raise": 1.345, "swing": -0.772}, {"raise": 1.57, "swing": 0.785}, {"raise": 2.89}, {"raise": 2.4}],
    ids=["hanging", "sideways", "forward", "overhead", "raised"],
)
def test_the_shoulder_is_far_from_singular_where_arms_are(arm):
    """Raising and swinging move the elbow in two directions, each by over 0.7 of the arm's length a radian."""
    human = shipped("human")
    values = {f"left_shoulder_{dof}": value for dof, value in arm.items()}
    step = 1e-3
    elbow = lambda **change: landmarks(
        human, values | {f"left_shoulder_{d}": values.get(f"left_shoulder_{d}", 0.0) + v for d, v in change.items()}
    )["left_elbow"]
    at = elbow()
    jacobian = np.stack([(elbow(**{dof: step}) - at) / step for dof in ("raise", "swing")])
    assert np.linalg.svd(jacobian)[1].min() > 0.7 * 0.29 - 1e-3


@pytest.mark.parametrize("pose", ["rest", "tpose", "arms_up", "squat", "walk_left"])
def test_the_silhouette_has_no_gaps_along_the_bones(pose):
    """Seen from the front or the side, the sum of the projected blobs is over 0.5 all along every limb."""
    human = shipped("human")
    blobs, _ = posed(human, human.poses[pose])
    points = landmarks(human, pose)
    bones = [("pelvis", "neck"), ("neck", "head_top")]
    bones += [(f"{s}_{a}", f"{s}_{b}") for s in ("left", "right") for a, b in itertools.pairwise(CHAIN) if a != "hand"]
    steps = np.linspace(0.0, 0.97, 30)[:, None]
    along = np.concatenate([points[a] + steps * (points[b] - points[a]) for a, b in bones])
    for view in ([LEFT, UP], [FORWARD, UP]):
        squared = ((along[:, None, view] - np.asarray(blobs.means)[None, :, view]) ** 2).sum(-1)
        assert (np.exp(-squared / (2.0 * np.asarray(blobs.sigmas) ** 2)).sum(-1) > 0.5).all()


CHAIN = ("shoulder", "elbow", "wrist", "hand", "hip", "knee", "ankle")


@pytest.mark.parametrize("name", BODIES)
def test_poses_of_the_dog_and_the_human_keep_feet_below_the_head(name):
    body = shipped(name)
    head, foot = ("head_top", "left_toe") if name == "human" else ("head", "left_front_paw")
    for pose in body.poses:
        points = landmarks(body, pose)
        assert points[head][UP] > points[foot][UP] + 0.2 * (name == "human")


def test_the_dog_stands_half_a_metre_high():
    rest = landmarks(shipped("dog"), "rest")
    assert rest["withers"][UP] - rest["left_front_paw"][UP] == pytest.approx(0.55, abs=0.04)
    assert rest["left_hind_paw"][UP] == pytest.approx(rest["left_front_paw"][UP], abs=0.02)
