"""Solvers that maximise a smooth function; they know nothing of bodies and images."""

from sogjax.solve.ascent import ConditionedAscent, gradient_ascent
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.solve.implicit import Optimum, implicit_optimum
from sogjax.solve.optimistix import OptimistixSolver
from sogjax.solve.quadratic import QuadraticModel
from sogjax.solve.solution import CurvedObjective, Scales, Solution, Solver

__all__ = [
    "ConditionedAscent",
    "CurvedObjective",
    "GaussNewton",
    "OptimistixSolver",
    "Optimum",
    "QuadraticModel",
    "Scales",
    "Solution",
    "Solver",
    "gradient_ascent",
    "implicit_optimum",
]
