"""Lengths of bones from keypoints: a person of other proportions is found again, others stay plausible."""

import jax.numpy as jnp
import numpy as np
from body_cases import shipped
from test_keypoint_pose import INDICES, SCHEME, pose

from sogjax.model.shape import ShapeModel
from sogjax.search.keypoint_pose import shape_of_keypoints

HUMAN = shipped("human")
MODEL = ShapeModel.from_body(HUMAN)


def person(**factors):
    """Keypoints in a few poses of a person whose groups have other sizes, and the person."""
    shape_params = np.zeros(MODEL.num_shape_params)
    for name, factor in factors.items():
        shape_params[MODEL.names.index(name)] = np.log(factor)
    body = MODEL.shaped(jnp.asarray(shape_params, MODEL.spread.dtype))
    return np.stack([np.asarray(body.posed_landmarks(pose(seed)), float)[INDICES] for seed in range(4)]), body


def length(body, a, b):
    rest = np.asarray(body.posed_landmarks(body.poses["rest"]), float)
    names = body.landmarks.names
    return np.linalg.norm(rest[names.index(a)] - rest[names.index(b)])


BONES = (
    ("left_hip", "left_knee"),
    ("right_knee", "right_ankle"),
    ("left_shoulder", "left_elbow"),
    ("left_hip", "right_hip"),
)


def test_a_larger_person_is_larger_in_everything():
    points, _ = person(whole_body=1.09)
    found = MODEL.shaped(jnp.asarray(shape_of_keypoints(MODEL, SCHEME, points)))
    np.testing.assert_allclose(found.blob_sigmas, 1.09 * np.asarray(HUMAN.blob_sigmas), rtol=0.01)
    np.testing.assert_allclose(found.skeleton.offsets, 1.09 * np.asarray(HUMAN.skeleton.offsets), atol=0.003)


def test_long_legs_are_long():
    points, true = person(thigh_length=1.08, shank_length=1.05, upper_arm_length=0.95)
    points[0, :, 2] += np.random.default_rng(0).normal(0.0, 0.3, 26)
    points[1, 5:] = np.nan
    found = MODEL.shaped(jnp.asarray(shape_of_keypoints(MODEL, SCHEME, points)))
    for bone in BONES:
        assert abs(length(found, *bone) / length(true, *bone) - 1.0) < 0.025, bone


def test_without_keypoints_there_is_no_shape():
    assert shape_of_keypoints(MODEL, SCHEME, np.full((3, 26, 3), np.nan)) is None
