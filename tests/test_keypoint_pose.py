"""Poses and sizes from keypoints in space: found again from true ones, in spite of some that are far off."""

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped

from sogjax.io.keypoints.scheme import named_scheme
from sogjax.model.rotation import world_from_upright
from sogjax.search.keypoint_pose import bone_pairs, measured_lengths, pose_of_keypoints

HUMAN = shipped("human")
SCHEME = named_scheme("HALPE_26")
INDICES = SCHEME.on(HUMAN.landmarks.names)


def pose(seed, pitch=0.0):
    """A pose within the limits, anywhere and in any direction."""
    rng = np.random.default_rng(seed)
    names = HUMAN.skeleton.dof_names
    values = np.array(HUMAN.poses["rest"], float)
    for name in (
        "left_shoulder_raise",
        "right_shoulder_raise",
        "left_elbow",
        "right_elbow",
        "left_knee",
        "right_hip_bend",
    ):
        values[names.index(name)] = rng.uniform(0.1, 1.3)
    values[names.index("root_yaw")] = rng.uniform(-np.pi, np.pi)
    values[names.index("root_pitch")] = pitch
    for name in ("root_x", "root_y", "root_z"):
        values[names.index(name)] = rng.uniform(-1.0, 1.0)
    return jnp.asarray(values, HUMAN.poses["rest"].dtype)


def points_of(body, values):
    return np.asarray(body.posed_landmarks(values), float)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "pitch", "up"), [(0, 0.0, "z"), (1, 0.3, "z"), (2, 1.6, "z"), (3, 0.0, "-y")])
def test_a_pose_is_found_again(seed, pitch, up):
    body = HUMAN.rotated(jnp.asarray(world_from_upright(up), jnp.float32))
    true = points_of(body, pose(seed, pitch))
    found = pose_of_keypoints(body, up, SCHEME, true[INDICES])
    assert found is not None
    assert (found.on, found.num_points) == (1.0, 26)
    errors = np.linalg.norm(points_of(body, jnp.asarray(found.pose)) - true, axis=-1)
    assert errors.mean() < 0.01
    assert errors[INDICES].max() < 0.03


def test_points_that_are_far_off_or_missing_change_little():
    true = points_of(HUMAN, pose(4))
    points = true[INDICES].copy()
    far, missing = [SCHEME.keypoints.index(n) for n in ("LKnee", "RWrist", "Head")], [0, 3, 22]
    points[far] += np.array([[0.6, 0.2, 0.0], [0.0, -0.5, 0.4], [0.5, 0.5, -0.3]])
    points[missing] = np.nan
    found = pose_of_keypoints(HUMAN, "z", SCHEME, points)
    assert found is not None
    assert found.num_points == 23
    assert found.on == pytest.approx(20 / 23)
    errors = np.linalg.norm(points_of(HUMAN, jnp.asarray(found.pose)) - true, axis=-1)
    # A wrist of which nothing else is known may be anywhere in its reach; all others stay.
    others = [k for k, name in enumerate(HUMAN.landmarks.names) if not name.startswith(("right_wrist", "right_hand"))]
    assert errors[others].max() < 0.06


def test_too_few_points_give_no_pose():
    points = np.full((26, 3), np.nan)
    points[:3] = 1.0
    assert pose_of_keypoints(HUMAN, "z", SCHEME, points) is None


def test_bones_keep_their_length_in_every_pose():
    pairs = {(SCHEME.keypoints[a], SCHEME.keypoints[b]): length for a, b, length in bone_pairs(HUMAN, INDICES)}
    assert pairs["LHip", "LKnee"] == pytest.approx(0.43, abs=1e-3)
    assert pairs["RShoulder", "RElbow"] == pytest.approx(0.29, abs=1e-3)
    assert pairs["LHip", "RHip"] == pytest.approx(0.176, abs=1e-3)
    assert not {("LShoulder", "RShoulder"), ("LHip", "LAnkle"), ("Neck", "Hip")} & set(pairs)


def test_the_size_is_that_of_the_bones():
    points = np.stack([1.08 * points_of(HUMAN, pose(seed))[INDICES] for seed in range(5)])
    points[0, :8] += 0.5
    points[1, 10:] = np.nan
    assert measured_lengths(HUMAN, SCHEME, np.full((2, 26, 3), np.nan)) == []
    lengths = {
        SCHEME.keypoints[b]: measured for (a, b, _), measured in measured_lengths(HUMAN, SCHEME, points) if a == 11
    }
    assert lengths["LKnee"] == pytest.approx(1.08 * 0.43, abs=2e-3)
