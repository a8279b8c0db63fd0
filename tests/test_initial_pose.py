"""The initial pose from a rough description: its landmarks and place are known by forward kinematics written twice."""

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import posed, reference_frames, reference_points, shipped
from slow_values import fast_and_slow

from sogjax.errors import InputError
from sogjax.io.pose_description import PoseDescription
from sogjax.model.rotation import UP_AXES, axis_vector, world_from_upright
from sogjax.search.described_pose import described_pose

HUMAN, DOG = shipped("human"), shipped("dog")
FITTED = 0.02
"""Metres: the fit is held back a little by the start pose and the limits."""


def describe(pose=None, position=None, heading=None, landmarks=None):
    return PoseDescription(pose=pose, position=position, heading=heading, landmarks=landmarks or {})


def upright(body, up):
    return body.rotated(jnp.asarray(world_from_upright(up), jnp.float32))


def heading_rotation(up, degrees):
    """Turning about the vertical of a world."""
    axis, angle = axis_vector(up), np.radians(degrees)
    cross = np.array([np.cross(axis, unit) for unit in np.eye(3)]).T
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def points_of(body, pose, up, position, degrees):
    """Landmarks of a named pose, placed and turned by hand: the root's angles are 0 in the named poses used."""
    values = np.array(body.poses[pose], float)
    values[:6] = 0.0
    points = reference_points(body.skeleton, body.landmarks, values)
    turn = heading_rotation(up, degrees) @ world_from_upright(up)
    return points @ turn.T + np.array(position)


@pytest.mark.parametrize("up", UP_AXES)
@pytest.mark.parametrize("heading", [0.0, 75.0, -170.0])
def test_a_named_pose_is_placed_and_turned_about_the_vertical(up, heading):
    body, position = upright(HUMAN, up), (0.3, -1.2, 0.8)
    pose = described_pose(body, describe("rest", position, heading), up)
    found = posed(body, pose)[1]
    np.testing.assert_allclose(found, points_of(HUMAN, "rest", up, position, heading), atol=1e-5)


def test_the_position_is_that_of_the_root_and_values_of_single_dofs_are_taken():
    pose = described_pose(DOG, describe({"neck_bend": 0.2, "root_pitch": 0.1}, (1.0, 2.0, 0.4)), "z")
    assert pose[DOG.skeleton.dof_names.index("neck_bend")] == np.float32(0.2)
    frames = reference_frames(DOG.skeleton, pose)
    np.testing.assert_allclose(frames[DOG.skeleton.names.index("root_roll"), :3, 3], [1.0, 2.0, 0.4], atol=1e-6)


@pytest.mark.parametrize(
    "case",
    fast_and_slow(
        ("z", 0.0, "walk_left"),
        ("z", 100.0, "tpose"),
        ("y", 100.0, "walk_left"),
        ("y", -150.0, "tpose"),
        ("-x", -150.0, "walk_left"),
        ("-x", 0.0, "tpose"),
    ),
)
def test_landmarks_give_the_pose_back_from_any_heading(case):
    up, heading, pose = case
    body = upright(HUMAN, up)
    points = points_of(HUMAN, pose, up, (0.5, -0.4, 1.0), heading)
    landmarks = {name: tuple(point) for name, point in zip(body.landmarks.names, points, strict=True)}
    found = described_pose(body, describe("rest", landmarks=landmarks), up)
    errors = np.linalg.norm(np.asarray(posed(body, found)[1], float) - points, axis=1)
    assert errors.mean() < FITTED
    assert errors.max() < 3.0 * FITTED


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_rough_landmarks_give_a_rough_pose(seed):
    """Three centimetres off: the body's own lengths correct a part of it."""
    rng = np.random.default_rng(seed)
    points = points_of(HUMAN, "walk_right", "z", (0.0, 0.0, 0.9), 40.0)
    noisy = points + rng.normal(size=points.shape) * 0.03 / np.sqrt(3.0)
    landmarks = {name: tuple(point) for name, point in zip(HUMAN.landmarks.names, noisy, strict=True)}
    found = described_pose(HUMAN, describe(landmarks=landmarks), "z")
    errors = np.linalg.norm(np.asarray(posed(HUMAN, found)[1], float) - points, axis=1)
    assert errors.mean() < 0.035
    lower, upper = (np.asarray(limit) for limit in HUMAN.skeleton.joint_limits())
    params = np.asarray(HUMAN.skeleton.parameter_transform) @ np.asarray(found)
    assert (params > lower - 0.1).all()
    assert (params < upper + 0.1).all()


@pytest.mark.slow
def test_four_landmarks_are_enough_for_place_and_heading():
    names = ("head_top", "left_hand", "right_hand", "left_toe")
    points = points_of(HUMAN, "apose", "z", (1.0, 0.5, 0.95), 120.0)
    landmarks = {name: tuple(points[HUMAN.landmarks.names.index(name)]) for name in names}
    found = described_pose(HUMAN, describe("apose", landmarks=landmarks), "z")
    errors = np.linalg.norm(np.asarray(posed(HUMAN, found)[1], float) - points, axis=1)
    assert errors.mean() < 0.05


@pytest.mark.slow
def test_a_given_heading_is_where_the_fit_starts():
    points = points_of(DOG, "rest", "z", (0.0, 0.3, 0.45), -60.0)
    landmarks = {name: tuple(point) for name, point in zip(DOG.landmarks.names, points, strict=True)}
    found = described_pose(DOG, describe("rest", heading=-50.0, landmarks=landmarks), "z")
    np.testing.assert_allclose(posed(DOG, found)[1], points, atol=FITTED)


THREE = {"pelvis": (0.0, 0.0, 1.0), "neck": (0.0, 0.0, 1.5), "head_top": (0.0, 0.0, 1.8)}


@pytest.mark.parametrize(
    ("description", "message"),
    [
        (describe("sprint", (0.0, 0.0, 1.0)), "unknown pose 'sprint'.*tpose"),
        (describe({"left_wing": 0.1}, (0.0, 0.0, 1.0)), "unknown degree of freedom 'left_wing'.*left_elbow"),
        (describe(landmarks=THREE | {"left_antenna": (0.0, 0.0, 2.0)}), "unknown landmark left_antenna.*left_elbow"),
        (describe(landmarks=THREE), "3 landmarks cannot fit.*at least 4"),
        (describe("rest"), "neither `position` nor `landmarks`"),
    ],
)
def test_mistakes_are_named_with_their_remedy(description, message):
    with pytest.raises(InputError, match=message):
        described_pose(HUMAN, description, "z")
