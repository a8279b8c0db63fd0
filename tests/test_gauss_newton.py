"""Gauss-Newton: the model that the energy gives of itself, and the steps made with it."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import random_body
from rig_cases import ring_rig
from sog_cases import floats, in_float64, random_views
from test_ascent import OPTIMUM, START, TWO_KINDS, quadratic

from sogjax.energy.frame_energy import FrameEnergy, standard_terms
from sogjax.energy.posed import History
from sogjax.energy.views import Views, whole_image_overlap
from sogjax.model.camera import project, project_points, projection_jacobian
from sogjax.model.sog import Sog
from sogjax.solve.ascent import ConditionedAscent
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.solve.optimistix import OptimistixSolver
from sogjax.solve.solution import CurvedObjective, QuadraticModel
from sogjax.tracking.solving import pose_scales

FLOAT32 = 1e-4
climb = eqx.filter_jit(lambda solver, objective, start, scales: solver.maximize(objective, start, scales))

near = eqx.filter_jit(FrameEnergy.near)
value_and_gradient = eqx.filter_jit(lambda energy, pose: jax.value_and_grad(lambda p: energy(p))(pose))
hessian = eqx.filter_jit(lambda energy, pose: jax.hessian(lambda p: energy(p))(pose))


def precise_body(seed=4):
    body = random_body(seed, joints=9, dofs=7, blobs=8)
    body = in_float64(eqx.tree_at(lambda b: b.blobs.offsets, body, body.blobs.offsets + jnp.array([[0.0, 0.0, 1.0]])))
    axes = body.skeleton.axes / jnp.linalg.norm(body.skeleton.axes, axis=1, keepdims=True)
    return eqx.tree_at(lambda b: b.skeleton.axes, body, axes)


def frame_energy(capped=True, sparse=False, known=True, added=()):
    body = precise_body()
    views = random_views(ring_rig(3).cameras, body, 1, count=60, padding=4)
    terms = (*standard_terms(floats(0.7), floats(0.3), floats(0.5), capped=capped), *added)
    rng = np.random.default_rng(2)
    pose, previous, before = (floats(np.asarray(body.poses["rest"]) + 0.4 * rng.normal(size=7)) for _ in range(3))
    energy = FrameEnergy(body, views, History(previous, before, jnp.asarray(known)), terms)
    return (near(energy, pose, 300)[0] if sparse else energy), pose


@pytest.mark.slow
@pytest.mark.parametrize(
    ("capped", "sparse", "known"), [(True, False, True), (False, False, False), (True, True, True)]
)
def test_the_model_has_the_value_and_gradient_of_the_energy_and_a_curvature_that_holds(capped, sparse, known):
    with jax.enable_x64(True):
        energy, pose = frame_energy(capped, sparse, known)
        model = eqx.filter_jit(energy.quadratic)(pose)
        value, gradient = value_and_gradient(energy, pose)
        np.testing.assert_allclose(model.value, value, rtol=1e-12)
        np.testing.assert_allclose(model.gradient, gradient, rtol=1e-9, atol=1e-9 * np.abs(gradient).max())
        np.testing.assert_allclose(model.curvature, model.curvature.T, atol=1e-12)
        eigenvalues = np.linalg.eigvalsh(model.curvature)
        assert eigenvalues[0] >= -1e-12
        assert eigenvalues[-1] > 1e-3


@pytest.mark.slow
def test_where_body_and_pictures_are_alike_the_curvature_is_the_true_one():
    """Every image blob lies where its body blob is seen, as large, and resembles no other one.

    Seen from far away with a long lens, so that the blobs' sizes, which Gauss-Newton holds fixed, hardly change.
    """
    with jax.enable_x64(True):
        body = precise_body()
        cameras = in_float64(ring_rig(3, size=(32000, 24000), distance=300.0).cameras)
        pose = body.poses["rest"] + 0.2
        seen = jax.vmap(project, (0, None))(cameras, body.posed_blobs(pose))
        images = Sog(seen.means, seen.sigmas, seen.colors, seen.mask)
        alike = jnp.broadcast_to(jnp.eye(body.num_blobs), (3, body.num_blobs, body.num_blobs))
        views = Views(cameras, images, alike, whole_image_overlap(cameras.image_size))
        terms = standard_terms(floats(0.0), floats(0.0), capped=False)
        energy = FrameEnergy(body, views, History.unknown(pose), terms)
        curvature = eqx.filter_jit(energy.quadratic)(pose).curvature
        expected = -hessian(energy, pose)
        np.testing.assert_allclose(curvature, expected, atol=0.01 * np.abs(expected).max())


@pytest.mark.parametrize("known", [True, False])
@pytest.mark.parametrize("place", [1, 2])
def test_the_models_of_the_priors_are_exact(place, known):
    with jax.enable_x64(True):
        energy, pose = frame_energy(known=known)
        pose = pose + 1.5  # beyond some limits
        prior = eqx.tree_at(lambda e: e.terms, energy, (energy.terms[place],))
        model = eqx.filter_jit(prior.quadratic)(pose)
        value, gradient = value_and_gradient(prior, pose)
        np.testing.assert_allclose(model.value, value, rtol=1e-12)
        np.testing.assert_allclose(model.gradient, gradient, rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(model.curvature, -hessian(prior, pose), atol=1e-12)
        assert (np.abs(model.curvature).max() > 0.1) == (known or place == 1)


@pytest.mark.slow
def test_the_jacobian_of_the_projection_is_that_of_jacfwd():
    with jax.enable_x64(True):
        camera = in_float64(ring_rig(1).camera("cam0"))
        points = floats(np.random.default_rng(0).normal(size=(5, 3)) * 0.5 + [0.0, 0.0, 1.0])
        eye = -camera.camera_from_world[:3, :3].T @ camera.camera_from_world[:3, 3]
        points = points.at[4].set(1.5 * eye)
        by_point = jax.jacfwd(lambda points: project_points(camera, points)[0])(points)
        expected = jnp.stack([by_point[k, :, k] for k in range(4)])
        found = projection_jacobian(camera, points)
        np.testing.assert_allclose(found[:4], expected, rtol=1e-10)
        assert (found[4] == 0.0).all()  # behind the camera


class Curved(eqx.Module):
    """A function with a curvature by autodiff, made positive by its absolute eigenvalues."""

    function: object = eqx.field(static=True)

    def __call__(self, params):
        return self.function(params)

    def quadratic(self, params):
        value, gradient = jax.value_and_grad(self.function)(params)
        eigenvalues, vectors = jnp.linalg.eigh(-jax.hessian(self.function)(params))
        return QuadraticModel(value, gradient, (vectors * jnp.abs(eigenvalues)[None, :]) @ vectors.T)


def valley(params):
    x, y = params[0], params[1]
    return -((1.0 - x) ** 2) - 10.0 * (y - x * x) ** 2


def test_a_quadratic_is_climbed_in_few_steps():
    start = jnp.asarray(START, jnp.float32)
    solution = climb(GaussNewton(epsilon=1e-4, smallest_damping=1e-4), Curved(quadratic), start, TWO_KINDS)
    assert solution.converged
    assert solution.iterations < 15
    np.testing.assert_allclose(solution.params, OPTIMUM, atol=1e-3)


def test_no_step_is_longer_than_its_bound_and_none_leads_downhill():
    start = jnp.asarray(START, jnp.float32)
    values = [quadratic(start)]
    bounds = np.asarray(TWO_KINDS.step_bounds)
    before = np.asarray(start)
    for iterations in range(1, 6):
        solver = GaussNewton(epsilon=0.0, max_iterations=iterations)
        solution = climb(solver, Curved(quadratic), start, TWO_KINDS)
        assert (np.abs(np.asarray(solution.params) - before) <= bounds * (1 + FLOAT32)).all()
        before = np.asarray(solution.params)
        values.append(solution.value)
        assert not solution.converged
    assert (np.diff(np.asarray(values)) >= 0.0).all()


def test_a_bent_valley_is_climbed_to_its_end():
    two = jax.tree.map(lambda leaf: leaf, TWO_KINDS)
    two = eqx.tree_at(lambda s: s.kinds, two, jnp.array([0, 0]))
    solution = climb(GaussNewton(epsilon=1e-5, max_iterations=500), Curved(valley), jnp.array([-0.5, 0.5]), two)
    np.testing.assert_allclose(solution.params, [1.0, 1.0], atol=2e-2)


@pytest.mark.parametrize("where", ["start", "later"])
def test_where_a_value_is_not_finite_it_stays_where_it_was_finite(where):
    function = lambda params: jnp.sum(jnp.log(params) - params) if where == "start" else jnp.sum(jnp.log(params))
    scales = eqx.tree_at(lambda s: s.kinds, TWO_KINDS, jnp.array([0]))
    start = jnp.array([-0.5]) if where == "start" else jnp.array([0.3])
    solution = climb(GaussNewton(max_iterations=20), Curved(function), start, scales)
    assert jnp.isfinite(solution.params).all()
    assert not solution.converged
    assert (solution.iterations == 0) == (where == "start")


def test_a_plain_function_is_refused():
    assert not isinstance(quadratic, CurvedObjective)
    with pytest.raises(TypeError, match="quadratic"):
        GaussNewton().maximize(quadratic, jnp.asarray(START, jnp.float32), TWO_KINDS)


def test_a_swept_number_does_not_compile_again():
    traces = 0

    def counted(params):
        nonlocal traces
        traces += 1
        return quadratic(params)

    objective, start = Curved(counted), jnp.asarray(START, jnp.float32)
    climb(GaussNewton(), objective, start, TWO_KINDS)
    first = traces
    for changes in ({"epsilon": 0.1}, {"first_damping": 1.0}, {"relax": 2.0}, {"max_iterations": 9}):
        climb(GaussNewton(**changes), objective, start, TWO_KINDS)
    assert traces == first


@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.slow
def test_it_climbs_the_energy_as_far_as_the_others(sparse):
    energy, _ = frame_energy(sparse=False)
    start = energy.body.poses["rest"]
    energy = jax.tree.map(lambda leaf: jnp.asarray(leaf), energy)
    if sparse:
        energy, _ = near(energy, start, 300)
    scales = pose_scales(energy.body.skeleton)
    found = climb(GaussNewton(epsilon=1e-3, max_iterations=100), energy, start, scales)
    np.testing.assert_allclose(found.value, energy(found.params), rtol=1e-4)
    for other in (ConditionedAscent(), OptimistixSolver("bfgs")):
        solution = climb(other, energy, start, scales)
        assert found.value > solution.value - 0.02 * abs(solution.value)
