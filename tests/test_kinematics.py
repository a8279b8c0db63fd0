"""Derivatives of forward kinematics: the closed form against autodiff of the product of transforms."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import random_body, random_skeleton
from sog_cases import in_float64

from sogjax.model.compiled import chosen_indices
from sogjax.model.skeleton import _composed

FLOAT64 = 1e-10


def case(seed):
    """A random forest and a pose, in float64, the axes made unit vectors again."""
    skeleton = in_float64(random_skeleton(seed))
    axes = skeleton.axes / jnp.linalg.norm(skeleton.axes, axis=1, keepdims=True)
    skeleton = eqx.tree_at(lambda s: s.axes, skeleton, axes)
    return skeleton, jnp.asarray(np.random.default_rng(seed).normal(size=skeleton.num_dofs))


def by_autodiff(skeleton, pose):
    return _composed(skeleton.parents, skeleton.revolute, skeleton.offsets, skeleton.axes, skeleton.joint_params(pose))


@pytest.mark.parametrize("seed", range(3))
def test_the_derivatives_are_those_of_autodiff_in_both_directions(seed):
    with jax.enable_x64(True):
        skeleton, pose = case(seed)
        frames = lambda pose: skeleton.world_from_joint(pose)
        plain = lambda pose: by_autodiff(skeleton, pose)
        expected = jax.jit(jax.jacfwd(plain))(pose)
        np.testing.assert_allclose(jax.jit(jax.jacfwd(frames))(pose), expected, atol=FLOAT64)
        np.testing.assert_allclose(jax.jit(jax.jacrev(frames))(pose), expected, atol=FLOAT64)


@pytest.mark.slow
def test_second_derivatives_and_those_by_the_skeleton_are_right_too():
    with jax.enable_x64(True):
        skeleton, pose = case(7)
        weights = jnp.asarray(np.random.default_rng(1).normal(size=(skeleton.num_joints, 4, 4)))
        closed = lambda s, p: jnp.sum(weights * s.world_from_joint(p))
        plain = lambda s, p: jnp.sum(weights * by_autodiff(s, p))
        bend = lambda f: jax.jit(jax.hessian(lambda p: f(skeleton, p)))(pose)
        np.testing.assert_allclose(bend(closed), bend(plain), atol=FLOAT64)
        shape = lambda f: eqx.filter_jit(eqx.filter_grad(f))(skeleton, pose)
        for field in ("offsets", "axes", "parameter_transform"):
            np.testing.assert_allclose(getattr(shape(closed), field), getattr(shape(plain), field), atol=FLOAT64)


def test_the_jacobian_of_points_is_that_of_jacfwd():
    with jax.enable_x64(True):
        body = in_float64(random_body(5))
        axes = body.skeleton.axes / jnp.linalg.norm(body.skeleton.axes, axis=1, keepdims=True)
        body = eqx.tree_at(lambda b: b.skeleton.axes, body, axes)
        pose = jnp.asarray(np.random.default_rng(0).normal(size=body.skeleton.num_dofs))

        def closed(pose):
            frames = body.skeleton.world_from_joint(pose)
            return body.skeleton.point_jacobian(frames, body.blobs.joints, body.blobs.points_world(frames))

        def some(pose, blobs, dofs):
            frames = body.skeleton.world_from_joint(pose)
            joints, points = jnp.asarray(body.blobs.joints)[blobs], body.blobs.points_world(frames)[blobs]
            return body.skeleton.point_jacobian(frames, joints, points, dofs)

        expected = jax.jit(jax.jacfwd(lambda p: body.posed_blobs(p).means))(pose)
        np.testing.assert_allclose(jax.jit(closed)(pose), expected, atol=FLOAT64)
        blobs, dofs = np.array([body.num_blobs - 1, 0, 2]), np.array([3, 0])
        found = jax.jit(some)(pose, jnp.asarray(blobs), jnp.asarray(dofs))
        np.testing.assert_allclose(found, expected[np.ix_(blobs, range(3), dofs)], atol=FLOAT64)


@pytest.mark.parametrize("share", [0.0, 0.03, 0.6, 1.0])
@pytest.mark.parametrize("size", [7, 64, 1000])
def test_chosen_entries_are_those_of_nonzero(size, share):
    chosen = np.random.default_rng(size).random(size) < share
    indices, count = jax.jit(chosen_indices, static_argnums=1)(jnp.asarray(chosen), size)
    expected = np.flatnonzero(chosen)
    assert count == len(expected)
    np.testing.assert_array_equal(indices[: len(expected)], expected)
    few, same_count = jax.jit(chosen_indices, static_argnums=1)(jnp.asarray(chosen), 5)
    assert same_count == count
    np.testing.assert_array_equal(few[: min(5, len(expected))], expected[:5])
    assert ((indices >= 0) & (indices < size)).all()
