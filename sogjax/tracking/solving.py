"""Solving a frame with lists of near pairs, which are rebuilt when the pose has left the place they are valid for.

How far the degrees of freedom of a body may move in one step of a solver.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.neighbours import displacement
from sogjax.model.skeleton import Skeleton
from sogjax.solve.solution import Scales, Solution, Solver, bounded

MAX_ROUNDS = 6


class RoundsState(eqx.Module):
    """State after some rounds: the solution of the last one, and where its lists were made."""

    solution: Solution
    round: Int[Array, ""]
    num_blocks: Int[Array, ""]
    """The most blocks of near pairs that a round needed."""
    settled: Bool[Array, ""]
    """The solution lies where the lists of its round hold."""


def solve_near(
    solver: Solver,
    objective: FrameEnergy,
    start: Float[Array, "dof"],
    scales: Scales,
    capacity: int,
    most: Int[Array, ""] | None = None,
) -> tuple[Solution, Int[Array, ""]]:
    """The solution with only the pairs that matter, and how many blocks of them there were at most.

    A round makes the lists at the pose that it starts from. Where it ends too far from there, the next round starts at
    its end; a solution is converged only if it lies where its own lists hold. A count above `capacity` means that
    blocks were cut off. All rounds together make at most `most` iterations, of which a last one may make none: it
    values the end by lists that hold there. None: each round makes as many as the solver may.
    """
    posed = objective.body.posed_blobs
    left = lambda made: bounded(solver, None if most is None else most - made)

    def one_round(state: RoundsState) -> RoundsState:
        start = state.solution.params
        near, num_blocks = objective.near(start, capacity)
        solution = left(state.solution.iterations).maximize(near, start, scales)
        moved = displacement(objective.views.cameras, posed(start), posed(solution.params))
        return RoundsState(
            solution=Solution(
                params=solution.params,
                value=solution.value,
                iterations=state.solution.iterations + solution.iterations,
                evaluations=state.solution.evaluations + solution.evaluations,
                converged=solution.converged,
            ),
            round=state.round + 1,
            num_blocks=jnp.maximum(state.num_blocks, num_blocks),
            settled=moved <= 1.0,
        )

    none = jnp.asarray(0)
    nothing = Solution(start, jnp.zeros((), start.dtype), none, none, jnp.asarray(False))
    state = RoundsState(nothing, none, none, jnp.asarray(False))
    end = jax.lax.while_loop(lambda state: ~state.settled & (state.round < MAX_ROUNDS), one_round, state)
    solution = eqx.tree_at(lambda s: s.converged, end.solution, end.solution.converged & end.settled)
    return solution, end.num_blocks


def pose_scales(
    skeleton: Skeleton,
    first_angle: float = 0.02,
    first_translation: float = 0.01,
    largest_angle: float = 0.15,
    largest_translation: float = 0.05,
) -> Scales:
    """Step lengths (radians, metres) for every degree of freedom; angles and translations of each actor are a kind."""
    kinds = _dof_kinds(skeleton)
    num_actors = int(kinds.max()) // 2 + 1
    return Scales(
        kinds=jnp.asarray(kinds),
        first_steps=jnp.tile(jnp.array([first_angle, first_translation]), num_actors),
        largest_steps=jnp.tile(jnp.array([largest_angle, largest_translation]), num_actors),
    )


def _dof_kinds(skeleton: Skeleton) -> Int[np.ndarray, "dof"]:
    """2 x the number of the tree a degree of freedom moves, + 1 for translations."""
    first_joint = np.argmax(np.asarray(skeleton.parameter_transform) != 0.0, axis=0)
    slides = ~np.asarray(skeleton.revolute)[first_joint]
    return (2 * np.array(skeleton.trees)[first_joint] + slides).astype(np.int32)
