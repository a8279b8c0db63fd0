"""Forward kinematics, M and limits against numpy, scipy and hand cases."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import random_skeleton, reference_frames
from hypothesis import given, settings
from hypothesis import strategies as st

from sogjax.model.skeleton import Skeleton

METRES = 5e-6
"""Tolerance of float32 for chains of a metre or two."""

X64 = 1e-12


def chain(parents, offsets, axes, revolute, transform, lower, upper):
    return Skeleton(
        names=tuple(f"joint{k}" for k in range(len(parents))),
        parents=tuple(parents),
        dof_names=tuple(f"dof{k}" for k in range(len(lower))),
        offsets=jnp.asarray(np.array(offsets, float)),
        axes=jnp.asarray(np.array(axes, float)),
        revolute=jnp.asarray(np.array(revolute)),
        parameter_transform=jnp.asarray(np.array(transform, float)),
        dof_lower=jnp.asarray(np.array(lower, float)),
        dof_upper=jnp.asarray(np.array(upper, float)),
    )


frames_of = jax.jit(lambda skeleton, pose: skeleton.world_from_joint(pose))


@pytest.mark.parametrize("seed", range(2))
def test_frames_equal_the_recursive_reference(seed):
    skeleton = random_skeleton(seed)
    pose = np.random.default_rng(seed + 100).normal(size=skeleton.num_dofs)
    np.testing.assert_allclose(frames_of(skeleton, jnp.asarray(pose)), reference_frames(skeleton, pose), atol=METRES)


@given(st.integers(0, 2**31), st.floats(0.0, 3.0))
@settings(max_examples=20, deadline=None)
def test_frames_equal_the_reference_in_double_precision(seed, scale):
    with jax.enable_x64(True):
        skeleton = random_skeleton(7)
        pose = scale * np.random.default_rng(seed).normal(size=skeleton.num_dofs)
        frames = frames_of(skeleton, jnp.asarray(pose))
        assert frames.dtype == jnp.float64
        np.testing.assert_allclose(frames, reference_frames(skeleton, pose), atol=X64)


@pytest.mark.parametrize("depth", [1, 8, 9, 61])
def test_chain_of_any_depth_adds_up(depth):
    """A chain of unit bones, all turned by the same angle about z, is an arc with a closed form."""
    angle = 0.05
    skeleton = chain(
        range(-1, depth - 1), [[1, 0, 0]] * depth, [[0, 0, 1]] * depth, [True] * depth, np.ones((depth, 1)), [-1], [1]
    )
    frames = np.asarray(frames_of(skeleton, jnp.array([angle])))
    headings = angle * np.arange(depth)
    np.testing.assert_allclose(frames[:, 0, 3], np.cumsum(np.cos(headings)), rtol=1e-5)
    np.testing.assert_allclose(frames[:, 1, 3], np.cumsum(np.sin(headings)), rtol=1e-5, atol=1e-6)


def test_hand_case_slide_then_turn():
    """Slide 2 m along y, then turn a quarter about z: the child's offset (1, 0, 0) points along y."""
    skeleton = chain(
        [-1, 0, 1], [[0, 0, 0], [0, 0, 0], [1, 0, 0]], [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
        [False, True, True], np.eye(3), [-9] * 3, [9] * 3,
    )  # fmt: skip
    frames = frames_of(skeleton, jnp.array([2.0, np.pi / 2, 0.0]))
    np.testing.assert_allclose(frames[2, :3, 3], [0.0, 3.0, 0.0], atol=METRES)


def test_frames_are_rigid():
    skeleton = random_skeleton(3)
    rotations = np.asarray(frames_of(skeleton, jnp.ones(skeleton.num_dofs)))[:, :3, :3]
    np.testing.assert_allclose(np.einsum("kij,klj->kil", rotations, rotations), [np.eye(3)] * 12, atol=METRES)
    np.testing.assert_allclose(np.linalg.det(rotations), 1.0, atol=METRES)


@pytest.mark.parametrize("scale", [0.0, 0.7])
def test_gradient_equals_finite_differences(scale):
    """At the pose zero too, where a rotation's axis-angle form is often singular."""
    with jax.enable_x64(True):
        skeleton = random_skeleton(11)
        rng = np.random.default_rng(0)
        pose = jnp.asarray(scale * rng.normal(size=skeleton.num_dofs))
        weights = jnp.asarray(rng.normal(size=(skeleton.num_joints, 4, 4)))
        gradient = jax.jit(jax.grad(lambda p: jnp.sum(weights * skeleton.world_from_joint(p))))(pose)
        value = lambda p: np.sum(np.asarray(weights) * reference_frames(skeleton, p))
        steps = 1e-6 * np.eye(skeleton.num_dofs)
        differences = [(value(pose + step) - value(pose - step)) / 2e-6 for step in steps]
        assert np.isfinite(gradient).all()
        np.testing.assert_allclose(gradient, differences, atol=1e-7)


def test_joint_params_are_the_matrix_product():
    skeleton = random_skeleton(5)
    pose = np.random.default_rng(5).normal(size=skeleton.num_dofs).astype(np.float32)
    expected = np.asarray(skeleton.parameter_transform, float) @ pose
    np.testing.assert_allclose(skeleton.joint_params(jnp.asarray(pose)), expected, atol=METRES)


def test_joint_limits_by_hand():
    """A negative weight swaps the limits; a joint without limits, even by one DoF of two, has none on that side."""
    inf = np.inf
    skeleton = chain(
        [-1] * 6, np.zeros((6, 3)), [[1, 0, 0]] * 6, [True] * 6,
        [[1, 0, 0], [-2, 0, 0], [0.5, 0, 1], [0, 1, 0], [0, 0, 0], [0, 0, -1]],
        [-0.5, -inf, -1.0], [2.0, inf, inf],
    )  # fmt: skip
    lower, upper = skeleton.joint_limits()
    np.testing.assert_allclose(lower, [-0.5, -4.0, -1.25, -inf, 0.0, -inf])
    np.testing.assert_allclose(upper, [2.0, 1.0, inf, inf, 0.0, 1.0])


@given(st.integers(0, 2**31))
@settings(max_examples=25, deadline=None)
def test_poses_within_the_limits_give_joint_params_within_theirs(seed):
    skeleton = random_skeleton(2)
    fractions = np.random.default_rng(seed).random(skeleton.num_dofs).round()
    low, high = np.asarray(skeleton.dof_lower), np.asarray(skeleton.dof_upper)
    params = np.asarray(skeleton.joint_params(jnp.asarray(low + fractions * (high - low))))
    lower, upper = (np.asarray(limit) for limit in skeleton.joint_limits())
    assert (params >= lower - METRES).all()
    assert (params <= upper + METRES).all()
