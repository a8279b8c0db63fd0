"""Optimistix's minimisers behind the interface of the ascent."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import random_body
from rig_cases import ring_rig
from sog_cases import random_views

from sogjax.energy.frame_energy import standard_terms, still_energy
from sogjax.solve.optimistix import OptimistixSolver
from sogjax.solve.solution import Scales
from sogjax.tracking.solving import pose_scales

METHODS = ["bfgs", "lbfgs", "nonlinear_cg"]
SCALES = Scales(jnp.array([0, 1]), jnp.array([0.02, 0.01]), jnp.array([0.15, 0.05]))

climb = eqx.filter_jit(lambda solver, objective, start, scales: solver.maximize(objective, start, scales))


def quadratic(params):
    x, y = params
    return 3.0 - 0.5 * ((x - 0.5) ** 2 + 20.0 * (y + 0.2) ** 2 + 4.0 * (x - 0.5) * (y + 0.2))


def rosenbrock(params):
    x, y = params
    return -((1.0 - x) ** 2) - 10.0 * (y - x * x) ** 2


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("objective", "optimum", "best"), [(quadratic, [0.5, -0.2], 3.0), (rosenbrock, [1.0, 1.0], 0.0)]
)
def test_the_optimum_is_found(method, objective, optimum, best):
    solver = OptimistixSolver(method, epsilon=1e-5, max_iterations=2000)
    solution = climb(solver, objective, jnp.array([-0.3, 0.4]), SCALES)
    assert solution.converged
    np.testing.assert_allclose(solution.params, optimum, atol=1e-2)
    np.testing.assert_allclose(solution.value, best, atol=1e-4)
    np.testing.assert_allclose(solution.value, objective(solution.params), atol=1e-5)
    assert 0 < solution.iterations < solution.evaluations


@pytest.mark.parametrize("method", METHODS)
def test_at_the_cap_it_has_not_converged_and_gives_its_best(method):
    start = jnp.array([-0.3, 0.4])
    solution = climb(OptimistixSolver(method, epsilon=1e-6, max_iterations=4), rosenbrock, start, SCALES)
    assert not solution.converged
    assert solution.value >= rosenbrock(start)


@pytest.mark.parametrize("method", METHODS)
def test_where_the_start_is_not_finite_it_says_so_and_stays(method):
    solver = OptimistixSolver(method, max_iterations=10)
    solution = climb(solver, lambda params: jnp.sum(jnp.log(params)), jnp.array([-1.0, 2.0]), SCALES)
    assert not solution.converged
    assert solution.params.tolist() == [-1.0, 2.0]


@pytest.mark.parametrize("method", METHODS)
def test_many_starts_at_once_and_no_new_compilation_for_a_swept_number(method):
    traces = 0

    def counted(params):
        nonlocal traces
        traces += 1
        return quadratic(params)

    run = eqx.filter_jit(lambda solver, starts: jax.vmap(lambda s: solver.maximize(counted, s, SCALES))(starts))
    starts = jnp.array([[0.0, 0.0], [0.3, -0.4], [0.9, 0.1]])
    solutions = run(OptimistixSolver(method, epsilon=1e-4), starts)
    np.testing.assert_allclose(solutions.params, np.tile([0.5, -0.2], (3, 1)), atol=5e-3)
    first = traces
    run(OptimistixSolver(method, epsilon=1e-2), starts)
    assert traces == first


@pytest.mark.parametrize(
    ("method", "gradient"),
    [
        ("lbfgs", "forward"),
        pytest.param("bfgs", "forward", marks=pytest.mark.slow),
        pytest.param("nonlinear_cg", "forward", marks=pytest.mark.slow),
        pytest.param("bfgs", "autodiff", marks=pytest.mark.slow),
    ],
)
def test_the_energy_is_climbed_whichever_way_its_gradient_is_made(method, gradient):
    body = random_body(4, joints=5, dofs=4, blobs=6)
    body = eqx.tree_at(lambda b: b.blobs.offsets, body, body.blobs.offsets + jnp.array([[0.0, 0.0, 1.0]]))
    views = random_views(ring_rig(2).cameras, body, 0, count=40)
    start = body.poses["rest"]
    terms = standard_terms(gradient=gradient)
    objective = lambda pose: still_energy(body, pose, views, terms)
    solver = OptimistixSolver(method, max_iterations=60)
    solution = climb(solver, objective, start, pose_scales(body.skeleton))
    value_and_slope = jax.jit(jax.value_and_grad(objective))
    (before, slope), (after, slope_after) = value_and_slope(start), value_and_slope(solution.params)
    assert after > before
    np.testing.assert_allclose(after, solution.value, rtol=1e-5)
    assert solution.converged
    assert np.linalg.norm(slope_after) < 0.3 * np.linalg.norm(slope)
