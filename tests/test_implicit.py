"""Derivatives of a found pose by what the energy is made of, against solving again (double precision)."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import random_body
from rig_cases import ring_rig
from slow_values import fast_and_slow
from sog_cases import floats, in_float64, random_views

from sogjax.energy.frame_energy import FrameEnergy, standard_terms
from sogjax.energy.posed import History
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.solve.implicit import Optimum, implicit_optimum
from sogjax.solve.solution import Scales
from sogjax.tracking.solving import pose_scales

STEP = 1e-5
TOLERANCE = 1e-5
SOLVER = GaussNewton(epsilon=1e-7, first_damping=1e-6, smallest_damping=1e-6, common_damping=0.0, max_iterations=400)


@eqx.filter_jit
def solved(energy, start, scales):
    """The optimum to the last digits: where values no longer tell poses apart, Newton's steps go on by the gradient."""
    params = SOLVER.maximize(energy, start, scales).params
    for _ in range(4):
        params = params - jnp.linalg.solve(jax.jacfwd(jax.grad(energy))(params), jax.grad(energy)(params))
    return params


@pytest.fixture(scope="module")
def optimum():
    """The energy of a small body, its scales, and its best pose, to the last digits."""
    with jax.enable_x64(True):
        body = random_body(4, joints=5, dofs=4, blobs=6)
        body = eqx.tree_at(lambda b: b.blobs.offsets, body, body.blobs.offsets + jnp.array([[0.0, 0.0, 1.0]]))
        body = in_float64(body)
        views = random_views(ring_rig(2).cameras, body, 0, count=40)
        start = floats(body.poses["rest"])
        history = History(start + 0.05, start - 0.02, jnp.asarray(True))
        energy = FrameEnergy(body, views, history, standard_terms(0.7, 0.1, capped=False))
        scales = in_float64(pose_scales(body.skeleton))
        return energy, scales, solved(energy, start, scales)


PLACES = {
    "bone lengths": (lambda e: e.body.skeleton.offsets, 0.05),
    "blob sizes": (lambda e: e.body.blob_sigmas, 0.02),
    "blob offsets": (lambda e: e.body.blobs.offsets, 0.02),
    "colours": (lambda e: e.body.blob_colors, 0.1),
    "weight of smooth motion": (lambda e: e.terms[2].weight, 0.1),
    "weight of the similarity": (lambda e: e.terms[0].weight, 0.5),
    "camera poses": (lambda e: e.views.cameras.camera_from_world, 0.02),
    "focal lengths": (lambda e: e.views.cameras.intrinsics, 10.0),
    "image blobs": (lambda e: e.views.images.means, 3.0),
    "the pose before": (lambda e: e.history.previous, 0.1),
}


def changes(place, size, energy):
    """A random direction in one of the energy's arrays; of cameras only what is a pose or a focal length."""
    leaf = place(energy)
    direction = np.random.default_rng(3).normal(size=leaf.shape) * size
    if leaf.shape[-2:] == (4, 4):
        direction[:, :, :3] = 0.0
        direction[:, 3] = 0.0
    if leaf.shape[-2:] == (3, 3):
        direction *= np.diag([1.0, 1.0, 0.0])
    return floats(direction)


def remade(energy):
    """The same with similarities by the colours that it has now."""
    body, views = energy.body, energy.views
    blobs = body.posed_blobs(body.poses["rest"])
    anew = type(views).from_images(views.cameras, views.images, blobs, views.normalizers, "rgb", views.coloring.radius)
    return eqx.tree_at(lambda e: e.views, energy, anew)


@pytest.mark.slow
@pytest.mark.parametrize("name", fast_and_slow(*PLACES))
def test_the_derivative_of_the_pose_is_that_of_solving_again(optimum, name):
    """In both directions of differentiation."""
    with jax.enable_x64(True):
        energy, scales, pose = optimum
        place, size = PLACES[name]
        leaf, direction = place(energy), changes(place, size, energy)
        again = lambda step: solved(remade(eqx.tree_at(place, energy, leaf + step * direction)), pose, scales)
        expected = (again(STEP) - again(-STEP)) / (2.0 * STEP)
        of_leaf = lambda leaf: implicit_optimum(eqx.tree_at(place, energy, leaf), pose, scales)
        found, rate = jax.jit(lambda leaf: jax.jvp(of_leaf, (leaf,), (direction,)))(leaf)
        np.testing.assert_array_equal(found, pose)
        largest = np.abs(expected).max()
        assert largest > 1e-3
        np.testing.assert_allclose(rate, expected, atol=TOLERANCE * largest)
        jacobian = jax.jit(jax.jacrev(of_leaf))(leaf)
        np.testing.assert_allclose(
            jnp.tensordot(jacobian, direction, axes=direction.ndim), expected, atol=TOLERANCE * largest
        )


@pytest.mark.slow
def test_the_account_says_that_it_is_an_optimum_and_all_is_determined(optimum):
    with jax.enable_x64(True):
        energy, scales, pose = optimum
        account = eqx.filter_jit(Optimum.at)(energy, pose, scales)
        assert account.slope < 1e-12
        assert account.determined.all()
        moved = eqx.filter_jit(Optimum.at)(energy, pose + 0.05, scales)
        assert moved.slope > 1e-5


class Bowl(eqx.Module):
    """Bends along the sum of two parameters only; its optimum is a line."""

    height: jax.Array

    def __call__(self, params):
        return -((params[0] + params[1] - self.height) ** 2)


@pytest.mark.slow
def test_along_a_direction_that_nothing_determines_the_derivative_is_0():
    """Of the points of the line the nearest one is taken: both parameters share the change."""
    with jax.enable_x64(True):
        scales = Scales(jnp.array([0, 0]), jnp.array([0.1]), jnp.array([1.0]))
        params = jnp.array([0.7, 0.3])
        account = Optimum.at(Bowl(jnp.asarray(1.0)), params, scales)
        assert account.determined.tolist() == [False, True]
        by_height = jax.jacfwd(lambda height: implicit_optimum(Bowl(height), params, scales))(jnp.asarray(1.0))
        np.testing.assert_allclose(by_height, [0.5, 0.5], rtol=1e-12)


def test_a_minimum_has_no_direction_in_which_the_optimum_is_determined():
    with jax.enable_x64(True):
        scales = Scales(jnp.array([0]), jnp.array([0.1]), jnp.array([1.0]))
        account = Optimum.at(lambda params: jnp.sum(params**2), jnp.zeros(1), scales)
        assert not account.determined.any()
