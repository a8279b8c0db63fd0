"""The gradient that tracking climbs, against the closed form written with loops and against finite differences.

Everything runs in double precision. Where the sum of Eq. 8 reaches the cap the energy has a kink, which no pose drawn
here meets to within the step of the differences.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from analytic_gradient import energy_gradient
from body_cases import posed, random_body, shipped
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_cases import ring_rig
from slow_values import fast_and_slow
from sog_cases import floats, in_float64, random_views

from sogjax.energy.frame_energy import FrameEnergy, standard_terms
from sogjax.energy.overlap import EXACT_EXPONENT, PRINTED_EXPONENT
from sogjax.energy.posed import History
from sogjax.model.body import Attachments
from sogjax.model.camera import project

CLOSED_FORM = 1e-9
DIFFERENCES = 2e-6
STEP = 1e-6
MODES = ["forward", "autodiff"]
seeds = st.integers(0, 10_000)

HUMAN = shipped("human")


def precise(body):
    """A body in float64, its axes made unit vectors again: from float32 they are so to 1e-8 only."""
    body = in_float64(body)
    axes = body.skeleton.axes
    return eqx.tree_at(lambda b: b.skeleton.axes, body, axes / jnp.linalg.norm(axes, axis=1, keepdims=True))


"""Loaded here, in single precision, since the loaded body is shared with other tests."""

value_and_gradient = eqx.filter_jit(
    lambda pose, body, views, history, terms: jax.value_and_grad(FrameEnergy(body, views, history, terms))(pose)
)
values_of = eqx.filter_jit(lambda energy, pose: energy.values(pose))
seen_by_all = jax.jit(lambda cameras, body, pose: jax.vmap(project, (0, None))(cameras, body.posed_blobs(pose)))


def small_body():
    """A forest of joints with blobs that fill the pictures; two of the blobs are one and the same."""
    body = random_body(4, joints=9, dofs=7, blobs=8)
    joints, offsets = list(body.blobs.joints), np.array(body.blobs.offsets)
    joints[1], offsets[1] = joints[0], offsets[0]
    offsets[:, 2] += 1.0
    blobs = Attachments(body.blobs.names, tuple(joints), jnp.asarray(offsets))
    return precise(eqx.tree_at(lambda b: b.blobs, body, blobs))


def case(body, seed, padding=5, count=60):
    """Views of a body near its rest pose, and a pose with its history."""
    rng = np.random.default_rng(seed)
    rest = np.asarray(body.poses["rest"], float)
    views = random_views(ring_rig(3).cameras, body, seed, count=count, padding=padding)
    pose, previous, before = (floats(rest + rng.normal(size=rest.shape) * 0.3) for _ in range(3))
    return pose, views, History(previous, before, jnp.asarray(True))


def terms(mode="forward", capped=True, exponent=EXACT_EXPONENT):
    return standard_terms(floats(0.7), floats(0.3), floats(exponent), capped=capped, gradient=mode)


def assert_gradient_is_right(body, pose, views, history, terms, differences=True):
    value, gradient = value_and_gradient(pose, body, views, history, terms)
    assert gradient.dtype == jnp.float64
    largest = float(jnp.max(jnp.abs(gradient)))
    assert largest > 0.0
    expected = energy_gradient(body, np.asarray(pose), views, history, terms)
    np.testing.assert_allclose(gradient, expected, rtol=CLOSED_FORM, atol=CLOSED_FORM * largest)
    if differences:
        at = lambda p: float(value_and_gradient(floats(p), body, views, history, terms)[0])
        base = np.asarray(pose)
        numeric = [(at(base + STEP * unit) - at(base - STEP * unit)) / (2 * STEP) for unit in np.eye(len(base))]
        np.testing.assert_allclose(gradient, numeric, rtol=DIFFERENCES, atol=DIFFERENCES * largest)
    return float(value), np.asarray(gradient)


@pytest.mark.parametrize("mode", fast_and_slow(*MODES))
@pytest.mark.parametrize("capped", [True, False])
@given(seed=seeds)
@settings(deadline=None, max_examples=6)
def test_random_poses_of_a_small_body(mode, capped, seed):
    with jax.enable_x64(True):
        body = small_body()
        assert_gradient_is_right(body, *case(body, seed), terms(mode, capped))


@pytest.mark.parametrize("mode", fast_and_slow(*MODES))
@given(seed=seeds)
@settings(deadline=None, max_examples=3)
def test_random_poses_of_the_human(mode, seed):
    with jax.enable_x64(True):
        body = precise(HUMAN)
        assert_gradient_is_right(body, *case(body, seed), terms(mode))


def test_the_human_at_rest_where_all_angles_are_zero():
    with jax.enable_x64(True):
        body = precise(HUMAN)
        _, views, history = case(body, 1)
        rest = jnp.zeros(body.skeleton.num_dofs)
        assert_gradient_is_right(body, rest, views, history, terms())


@pytest.mark.parametrize("mode", MODES)
def test_zero_pose(mode):
    with jax.enable_x64(True):
        body = small_body()
        pose, views, history = case(body, 2)
        assert_gradient_is_right(body, jnp.zeros_like(pose), views, history, terms(mode))


@pytest.mark.parametrize("mode", MODES)
def test_the_printed_exponent(mode):
    with jax.enable_x64(True):
        body = small_body()
        args = case(body, 3)
        exact = assert_gradient_is_right(body, *args, terms(mode))
        printed = assert_gradient_is_right(body, *args, terms(mode, exponent=PRINTED_EXPONENT))
        assert printed[0] < exact[0]


@pytest.mark.parametrize("mode", MODES)
def test_body_and_image_blobs_in_the_same_place(mode):
    """The distance of their centres is 0 (two blobs of `small_body` coincide as well)."""
    with jax.enable_x64(True):
        body = small_body()
        pose, views, history = case(body, 5)
        seen = seen_by_all(views.cameras, body, pose)
        means = views.images.means.at[:, : body.num_blobs].set(seen.means)
        views = eqx.tree_at(lambda v: v.images.means, views, means)
        assert_gradient_is_right(body, pose, views, history, terms(mode))


@pytest.mark.parametrize("mode", MODES)
def test_blobs_behind_a_camera(mode):
    """The first camera stands in the middle of the body."""
    with jax.enable_x64(True):
        body = small_body()
        pose, views, history = case(body, 6)
        centre = np.median(np.asarray(posed(body, pose)[0].means), axis=0)
        world = np.array(views.cameras.camera_from_world)
        world[0, :3, 3] = -world[0, :3, :3] @ centre
        views = eqx.tree_at(lambda v: v.cameras.camera_from_world, views, floats(world))
        views = eqx.tree_at(lambda v: v.images.sigmas, views, views.images.sigmas.at[0].set(80.0))
        assert 0 < int(seen_by_all(views.cameras, body, pose).mask[0].sum()) < body.num_blobs
        assert_gradient_is_right(body, pose, views, history, terms(mode))


def test_joints_beyond_their_limits():
    with jax.enable_x64(True):
        body = precise(HUMAN)
        _, views, history = case(body, 7)
        pose = floats(np.random.default_rng(7).normal(size=body.skeleton.num_dofs) * 0.9)
        values = values_of(FrameEnergy(body, views, history, terms()), pose)
        assert values["limit_penalty"] > 0.5
        assert_gradient_is_right(body, pose, views, history, terms())


def test_without_a_history_nothing_is_known_of_the_acceleration():
    with jax.enable_x64(True):
        body = small_body()
        pose, views, history = case(body, 8)
        unknown = History(history.previous, history.before_previous, jnp.asarray(False))
        value, gradient = assert_gradient_is_right(body, pose, views, unknown, terms())
        free = standard_terms(floats(0.7), floats(0.0))
        other_value, other_gradient = value_and_gradient(pose, body, views, history, free)
        np.testing.assert_allclose(value, other_value, rtol=1e-12)
        np.testing.assert_allclose(gradient, other_gradient, rtol=1e-12)


def test_padding_in_the_images_changes_nothing():
    with jax.enable_x64(True):
        body = small_body()
        pose, views, history = case(body, 9, padding=0)
        _, padded, _ = case(body, 9, padding=5)
        value, gradient = value_and_gradient(pose, body, views, history, terms())
        other_value, other_gradient = value_and_gradient(pose, body, padded, history, terms())
        np.testing.assert_allclose(other_value, value, rtol=1e-12)
        np.testing.assert_allclose(other_gradient, gradient, rtol=1e-10, atol=1e-14)


@pytest.mark.slow
def test_single_precision_is_near_enough():
    body = HUMAN
    pose, views, history = case(body, 10)
    value, gradient = value_and_gradient(pose, body, views, history, terms())
    assert gradient.dtype == jnp.float32
    expected = energy_gradient(body, np.asarray(pose), views, history, terms())
    np.testing.assert_allclose(gradient, expected, atol=1e-4 * np.abs(expected).max())
    assert np.isfinite(value)
