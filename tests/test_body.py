"""Bodies: blobs and landmarks in a pose, several bodies as one, another vertical."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import posed, random_body, reference_points
from scipy.spatial.transform import Rotation

from sogjax.model.body import concatenate, dof_slices
from sogjax.model.rotation import UP_AXES, axis_vector, world_from_upright

METRES = 5e-6


def pose_of(body, seed=0):
    return np.random.default_rng(seed).normal(size=body.skeleton.num_dofs).astype(np.float32)


def test_blobs_and_landmarks_follow_their_joints():
    body = random_body(1)
    pose = pose_of(body)
    blobs, landmarks = posed(body, jnp.asarray(pose))
    np.testing.assert_allclose(blobs.means, reference_points(body.skeleton, body.blobs, pose), atol=METRES)
    np.testing.assert_allclose(landmarks, reference_points(body.skeleton, body.landmarks, pose), atol=METRES)
    np.testing.assert_array_equal(blobs.sigmas, body.blob_sigmas)
    np.testing.assert_array_equal(blobs.colors, body.blob_colors)
    assert blobs.mask.all()
    assert blobs.capacity == body.num_blobs


def test_a_body_passes_through_jit_and_its_arrays_have_gradients():
    body = random_body(2)
    pose = jnp.asarray(pose_of(body))
    height = jax.jit(lambda b, p: jnp.sum(b.posed_blobs(p).means[:, 2]))
    gradient = jax.grad(lambda offsets: height(jax_replace(body, offsets), pose))(body.blobs.offsets)
    frames = np.asarray(body.skeleton.world_from_joint(pose))
    np.testing.assert_allclose(gradient, frames[np.array(body.blobs.joints), 2, :3], atol=METRES)


def jax_replace(body, offsets):
    leaves, tree = jax.tree.flatten(body)
    return jax.tree.unflatten(tree, [offsets if leaf is body.blobs.offsets else leaf for leaf in leaves])


def test_several_bodies_move_as_each_alone():
    bodies = [random_body(3, "ann"), random_body(4, "bob", joints=5, dofs=4, blobs=9), random_body(5, "cat")]
    poses = [pose_of(body, k) for k, body in enumerate(bodies)]
    together = concatenate(bodies)
    joined_pose = np.concatenate(poses)
    joined, joined_landmarks = posed(together, jnp.asarray(joined_pose))
    alone = [posed(body, jnp.asarray(pose)) for body, pose in zip(bodies, poses, strict=True)]
    np.testing.assert_allclose(joined_landmarks, np.concatenate([points for _, points in alone]), atol=METRES)
    first = 0
    for k, (body, dofs) in enumerate(zip(bodies, dof_slices(bodies), strict=True)):
        blobs = slice(first, first := first + body.num_blobs)
        np.testing.assert_allclose(np.asarray(joined.means)[blobs], alone[k][0].means, atol=METRES)
        np.testing.assert_array_equal(np.asarray(joined.sigmas)[blobs], body.blob_sigmas)
        np.testing.assert_array_equal(np.asarray(joined.colors)[blobs], body.blob_colors)
        np.testing.assert_array_equal(joined_pose[dofs], poses[k])
        np.testing.assert_array_equal(np.asarray(together.poses["rest"])[dofs], body.poses["rest"])
        np.testing.assert_array_equal(np.asarray(together.skeleton.dof_lower)[dofs], body.skeleton.dof_lower)
        np.testing.assert_array_equal(np.asarray(together.skeleton.dof_upper)[dofs], body.skeleton.dof_upper)
        assert together.blobs.names[blobs] == tuple(f"{body.name}/{name}" for name in body.blobs.names)


def test_two_actors_of_the_same_name_parts_stay_apart():
    together = concatenate([random_body(6, "ann"), random_body(6, "bob")])
    for names in (together.skeleton.names, together.skeleton.dof_names, together.blobs.names, together.landmarks.names):
        assert len(set(names)) == len(names)


def test_one_body_stays_as_it_is():
    body = random_body(6)
    assert concatenate([body]) is body


@pytest.mark.parametrize("up", UP_AXES)
def test_turned_body_is_the_body_in_a_turned_world(up):
    """Turning the rest frame turns all points, whatever the pose."""
    body, rotation = random_body(7), world_from_upright(up)
    pose = jnp.asarray(pose_of(body))
    blobs, landmarks = posed(body, pose)
    turned_blobs, turned_landmarks = posed(body.rotated(jnp.asarray(rotation)), pose)
    np.testing.assert_allclose(turned_blobs.means, np.asarray(blobs.means) @ rotation.T, atol=METRES)
    np.testing.assert_allclose(turned_landmarks, np.asarray(landmarks) @ rotation.T, atol=METRES)


def test_turning_there_and_back_changes_nothing():
    body = random_body(8)
    rotation = Rotation.from_rotvec([0.3, -0.8, 1.1]).as_matrix()
    back = body.rotated(jnp.asarray(rotation)).rotated(jnp.asarray(rotation.T))
    for one, other in zip(jax.tree.leaves(back), jax.tree.leaves(body), strict=True):
        np.testing.assert_allclose(one, other, atol=METRES)


@pytest.mark.parametrize("up", UP_AXES)
def test_upright_bodies_stand_on_the_named_axis(up):
    rotation = world_from_upright(up)
    np.testing.assert_array_equal(rotation @ [0.0, 0.0, 1.0], axis_vector(up))
    np.testing.assert_array_equal(rotation @ rotation.T, np.eye(3))
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_axis_vectors_by_hand():
    np.testing.assert_array_equal([axis_vector("x"), axis_vector("-y")], [[1, 0, 0], [0, -1, 0]])
