"""Standard deviations: against a dense inverse, finite differences of the joints, and on what they must not depend."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sogjax.data.actor_file import load_body, named_body
from sogjax.tracking.confidence import Laplace, range_precision


@pytest.fixture(scope="module")
def body():
    return load_body(named_body("human"))


def random_curvature(size, seed=0):
    factors = np.random.default_rng(seed).normal(size=(size, size))
    return jnp.asarray(0.01 * factors @ factors.T, jnp.float32)


def test_covariance_is_the_inverse_of_curvature_over_temperature_and_range(body):
    curvature = random_curvature(body.skeleton.num_dofs)
    found = np.asarray(Laplace(1e-3).covariance(curvature, body.skeleton), float)
    precision = np.asarray(curvature, float) / 1e-3 + np.diag(np.asarray(range_precision(body.skeleton), float))
    expected = np.linalg.inv(precision)
    np.testing.assert_allclose(found, expected, atol=2e-3 * np.abs(expected).max())


def test_without_any_curvature_the_ranges_are_left(body):
    none = jnp.zeros((body.skeleton.num_dofs,) * 2, jnp.float32)
    deviations = Laplace(1e-3).deviations(body.skeleton, none, body.poses["rest"])
    knee = body.skeleton.dof_names.index("left_knee")
    width = float(body.skeleton.dof_upper[knee] - body.skeleton.dof_lower[knee])
    assert float(deviations.pose[knee]) == pytest.approx(width / 12.0**0.5, rel=1e-4)
    assert np.isfinite(np.asarray(deviations.joints)).all()


@pytest.mark.slow
def test_joints_spread_as_drawn_poses_do(body):
    curvature = random_curvature(body.skeleton.num_dofs, seed=1) + jnp.eye(body.skeleton.num_dofs)
    laplace, pose = Laplace(1e-5), body.poses["rest"]
    said = np.asarray(laplace.deviations(body.skeleton, curvature, pose).joints)
    covariance = np.asarray(laplace.covariance(curvature, body.skeleton), float)
    drawn = np.random.default_rng(2).multivariate_normal(np.asarray(pose, float), covariance, 4000)
    frames = jax.vmap(body.skeleton.world_from_joint)(jnp.asarray(drawn, jnp.float32))
    places = np.asarray(frames[:, :, :3, 3], float)
    spread = np.sqrt(np.mean(np.sum((places - places.mean(axis=0)) ** 2, axis=-1), axis=0))
    np.testing.assert_allclose(said, spread, rtol=0.06, atol=2e-5)


def test_deviations_grow_with_the_root_of_the_temperature_where_pictures_decide(body):
    curvature = 10.0 * jnp.eye(body.skeleton.num_dofs)
    at = lambda temperature: Laplace(temperature).deviations(body.skeleton, curvature, body.poses["rest"]).pose
    np.testing.assert_allclose(at(4e-6), 2.0 * at(1e-6), rtol=1e-3)
