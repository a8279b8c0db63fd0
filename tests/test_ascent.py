"""Conditioned gradient ascent (Eq. 11, 12) against the paper's rule followed by hand."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sogjax.solve.ascent import ConditionedAscent, gradient_ascent
from sogjax.solve.solution import Scales

FLOAT32 = 1e-5
CURVATURES = np.array([1.0, 30.0, 4.0, 0.5])
OPTIMUM = np.array([0.4, -0.2, 0.1, 0.0])
START = np.array([0.0, 0.3, -0.3, 0.0])
"""The last parameter starts at its optimum: its gradient is 0 all the time."""


def quadratic(params):
    return -0.5 * jnp.sum(jnp.asarray(CURVATURES, jnp.float32) * (params - jnp.asarray(OPTIMUM, jnp.float32)) ** 2)


def scales(num_params=4, first=0.02, largest=0.15):
    return Scales(jnp.zeros(num_params, int), jnp.array([first]), jnp.array([largest]))


TWO_KINDS = Scales(jnp.array([0, 0, 1, 1]), jnp.array([0.02, 0.01]), jnp.array([0.15, 0.05]))

climb = eqx.filter_jit(lambda solver, objective, start, scales: solver.maximize(objective, start, scales))


def maximum(solver, start=START, scales=TWO_KINDS, objective=quadratic):
    return climb(solver, objective, jnp.asarray(start, jnp.float32), scales)


def by_hand(solver, start, kinds, first_steps, largest_steps, gradient, iterations):
    """All poses and step sizes of the first iterations: Eq. 11 and 12 in numpy, one parameter after the other."""
    params, slope = start.copy(), gradient(start)
    largest = [max(abs(g) for g, other in zip(slope, kinds, strict=True) if other == kind) for kind in kinds]
    first = np.array(
        [first_steps[k] / size if size > 0.0 else first_steps[k] for k, size in zip(kinds, largest, strict=True)]
    )
    sizes = first.copy()
    history = []
    for _ in range(iterations):
        step = np.array(
            [max(-largest_steps[k], min(largest_steps[k], s * g)) for k, s, g in zip(kinds, sizes, slope, strict=True)]
        )
        params = params + step
        new_slope = gradient(params)
        for n in range(len(params)):
            factor = float(solver.grow) if slope[n] * new_slope[n] > 0.0 else float(solver.shrink)
            sizes[n] = max(sizes[n] * factor, float(solver.smallest_step_size) * first[n])
        slope = new_slope
        history.append((params.copy(), step))
    return history


@pytest.mark.parametrize("iterations", [1, 2, 5, 9])
def test_every_pose_is_that_of_the_papers_rule(iterations):
    """Two kinds of parameters, each with a first step and a bound of its own, one gradient always 0."""
    solver = ConditionedAscent(epsilon=0.0, max_iterations=iterations)
    gradient = lambda params: -CURVATURES * (params - OPTIMUM)
    history = by_hand(solver, START, [0, 0, 1, 1], [0.02, 0.01], [0.15, 0.05], gradient, iterations)
    values = [-0.5 * np.sum(CURVATURES * (params - OPTIMUM) ** 2) for params, _ in history]
    solution = maximum(solver)
    assert solution.iterations == iterations
    assert solution.evaluations == iterations + 1
    np.testing.assert_allclose(solution.params, history[int(np.argmax(values))][0], atol=FLOAT32)
    np.testing.assert_allclose(solution.value, max(values), atol=FLOAT32)


def test_it_stops_where_the_step_is_shorter_than_epsilon_but_not_before_n_iter():
    epsilon = 0.004
    gradient = lambda params: -CURVATURES * (params - OPTIMUM)
    for min_iterations in (1, 40):
        solver = ConditionedAscent(epsilon=epsilon, min_iterations=min_iterations)
        history = by_hand(solver, START, [0, 0, 1, 1], [0.02, 0.01], [0.15, 0.05], gradient, 100)
        short = [np.linalg.norm(step) < epsilon for _, step in history]
        expected = next(n for n, small in enumerate(short, 1) if small and n >= min_iterations)
        solution = maximum(solver)
        assert solution.iterations == expected
        assert solution.converged


def test_at_the_cap_it_has_not_converged():
    solution = maximum(ConditionedAscent(epsilon=0.0, max_iterations=7))
    assert solution.iterations == 7
    assert not solution.converged


def test_the_optimum_is_found():
    solution = maximum(ConditionedAscent(epsilon=1e-5, max_iterations=400))
    assert solution.converged
    np.testing.assert_allclose(solution.params, OPTIMUM, atol=1e-4)


def test_no_step_is_longer_than_its_bound():
    """On a slope that never ends every step grows until it meets the bound of its kind."""
    slope = lambda params: 1e4 * jnp.sum(params)
    bounds = np.array([0.15, 0.15, 0.05, 0.05])
    before = START
    for iterations in range(1, 24, 11):
        solution = maximum(ConditionedAscent(max_iterations=iterations), objective=slope)
        np.testing.assert_array_less(solution.params - START, iterations * bounds + 1e-4)
        before = np.asarray(solution.params)
    last = maximum(ConditionedAscent(max_iterations=24), objective=slope).params - before
    np.testing.assert_allclose(last, bounds, rtol=1e-3)


def test_the_first_step_has_its_stated_length_whatever_the_unit_of_the_objective():
    for factor in (1e-6, 1.0, 1e6):
        objective = lambda params, factor=factor: factor * quadratic(params)
        solution = maximum(ConditionedAscent(max_iterations=1), objective=objective)
        moved = np.abs(solution.params - START)
        np.testing.assert_allclose([moved[:2].max(), moved[2:].max()], [0.02, 0.01], rtol=1e-3)


def test_the_best_pose_is_kept_where_the_last_one_overshoots():
    """A needle that a step of 0.15 jumps over: the ascent ends beyond it, the start was better."""
    objective = lambda params: -jnp.abs(params[0] - 0.001) * 100.0
    wild = scales(1, first=0.15)
    solution = maximum(ConditionedAscent(max_iterations=1), np.zeros(1), wild, objective)
    assert solution.params[0] == 0.0
    np.testing.assert_allclose(solution.value, -0.1, rtol=FLOAT32)


@pytest.mark.parametrize("where", ["start", "later"])
def test_where_a_value_is_not_finite_it_gives_up_and_says_so(where):
    """log is NaN below 0, and its slope leads there."""
    start = -0.5 if where == "start" else 0.05
    objective = lambda params: -jnp.sum(jnp.log(params)) if where == "later" else jnp.sum(jnp.log(params))
    solver = ConditionedAscent(epsilon=1.0, min_iterations=1, max_iterations=50)
    solution = maximum(solver, np.array([start]), scales(1, first=0.1), objective)
    assert not solution.converged
    assert solution.iterations == (0 if where == "start" else 1)
    np.testing.assert_allclose(solution.params, [start])


def test_plain_ascent_keeps_its_step_sizes():
    """On a quadratic a constant step size lets the error shrink by the same factor in each iteration."""
    size = 0.02 / np.abs(CURVATURES * (START - OPTIMUM)).max()
    for iterations in (1, 4, 20):
        solution = maximum(gradient_ascent(epsilon=0.0, max_iterations=iterations), scales=scales())
        expected = OPTIMUM + (START - OPTIMUM) * (1.0 - size * CURVATURES) ** iterations
        np.testing.assert_allclose(solution.params, expected, atol=FLOAT32)


def test_conditioning_needs_fewer_iterations_in_a_narrow_valley():
    valley = lambda params: -0.5 * jnp.sum(jnp.array([1.0, 100.0]) * params**2)
    start = np.array([1.0, 0.05])
    conditioned, plain = (
        maximum(solver(epsilon=1e-5, max_iterations=5000), start, scales(2), valley)
        for solver in (ConditionedAscent, gradient_ascent)
    )
    for solution in (conditioned, plain):
        assert solution.converged
        np.testing.assert_allclose(solution.params, 0.0, atol=5e-3)
    assert 2 * conditioned.iterations < plain.iterations


def test_many_starts_at_once_give_what_single_ones_do():
    starts = jnp.asarray(START + np.linspace(-0.2, 0.3, 4)[:, None], jnp.float32)
    solver = ConditionedAscent()
    many = jax.jit(jax.vmap(lambda start: solver.maximize(quadratic, start, TWO_KINDS)))(starts)
    for k, start in enumerate(starts):
        one = maximum(solver, start)
        np.testing.assert_allclose(many.params[k], one.params, atol=FLOAT32)
        assert many.iterations[k] == one.iterations
        assert many.converged[k] == one.converged


def test_a_swept_number_does_not_compile_again():
    traces = 0

    def counted(params):
        nonlocal traces
        traces += 1
        return quadratic(params)

    run = eqx.filter_jit(lambda solver, start, scales: solver.maximize(counted, start, scales))
    start = jnp.asarray(START, jnp.float32)
    run(ConditionedAscent(), start, TWO_KINDS)
    first = traces
    for changes in ({"epsilon": 0.01}, {"grow": 1.5}, {"shrink": 0.3}, {"min_iterations": 3}, {"max_iterations": 9}):
        run(ConditionedAscent(**changes), start, TWO_KINDS)
    run(gradient_ascent(), start, scales=Scales(TWO_KINDS.kinds, jnp.array([0.1, 0.2]), jnp.array([0.3, 0.4])))
    assert traces == first


def test_double_precision_stays_double():
    with jax.enable_x64(True):
        objective = lambda params: -jnp.sum((params - jnp.asarray(OPTIMUM)) ** 2)
        two_kinds = Scales(TWO_KINDS.kinds, jnp.array([0.02, 0.01]), jnp.array([0.15, 0.05]))
        solver = ConditionedAscent(epsilon=1e-9, max_iterations=400)
        solution = climb(solver, objective, jnp.asarray(START), two_kinds)
        assert solution.params.dtype == jnp.float64
        np.testing.assert_allclose(solution.params, OPTIMUM, atol=1e-7)
