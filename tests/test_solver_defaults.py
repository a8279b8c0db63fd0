"""Defaults stand in the commands' configs: what is made without arguments in Python is the same."""

import equinox as eqx
import jax
import numpy as np
import pytest

from sogjax.cli.words import composed
from sogjax.energy.frame_energy import standard_terms
from sogjax.run import build
from sogjax.solve.ascent import ConditionedAscent, gradient_ascent
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.solve.optimistix import OptimistixSolver

SOLVERS = {
    "gauss_newton": GaussNewton,
    "conditioned_ascent": ConditionedAscent,
    "gradient_ascent": gradient_ascent,
    "bfgs": lambda: OptimistixSolver("bfgs"),
    "lbfgs": lambda: OptimistixSolver("lbfgs"),
    "nonlinear_cg": lambda: OptimistixSolver("nonlinear_cg"),
}


def config(*words):
    return composed("track", ["recording=somewhere", *words])


def assert_same(made, by_command):
    assert jax.tree.structure(made) == jax.tree.structure(by_command)
    for mine, theirs in zip(jax.tree.leaves(made), jax.tree.leaves(by_command), strict=True):
        np.testing.assert_array_equal(mine, theirs)


@pytest.mark.parametrize("name", SOLVERS)
def test_a_solver_made_without_arguments_is_that_of_the_commands(name):
    assert_same(SOLVERS[name](), build.solver(config(f"solver={name}").solver))


def test_the_terms_made_without_arguments_are_those_of_the_commands():
    weight = config().energy.foreground_weight
    assert_same(standard_terms(foreground_weight=weight), build.energy_terms(config().energy))


def test_a_term_of_ones_own_is_added_by_the_configuration():
    words = "energy.terms={ground:{term:test_terms.Floor,weight:2,height:0.1}}"
    *standard, ground = build.energy_terms(config(words).energy)
    assert_same(tuple(standard), standard_terms(foreground_weight=config().energy.foreground_weight))
    assert (ground.name, float(ground.weight)) == ("ground", 2.0)
    np.testing.assert_allclose(ground.height, 0.1, rtol=1e-6)
    assert eqx.is_array(ground.height)
