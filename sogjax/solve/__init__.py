"""Solvers that maximise a smooth function; they know nothing of bodies and images."""

from sogjax.solve.ascent import ConditionedAscent, gradient_ascent
from sogjax.solve.optimistix import OptimistixSolver
from sogjax.solve.solution import Scales, Solution, Solver

__all__ = ["ConditionedAscent", "OptimistixSolver", "Scales", "Solution", "Solver", "gradient_ascent"]
