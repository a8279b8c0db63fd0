"""The way of a solver through one frame: its best pose after every number of iterations."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, UInt8

from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameInput, TrackState
from sogjax.tracking.tracker import Tracker


@eqx.filter_jit
def best_after(
    tracker: Tracker,
    state: TrackState,
    cells: UInt8[Array, "camera rows columns 3"],
    capacities: Capacities,
    counts: Int[Array, "count"],
) -> tuple[Float[Array, "count dof"], Float[Array, "count"]]:
    """The best pose that the tracker's solver has seen after so many iterations of a frame, and its energy.

    The frame is solved again for every count, so no solver needs to know that it is watched.
    """
    seen = tracker.views(FrameInput(cells), state, capacities)

    def after(count: Int[Array, ""]) -> tuple[Float[Array, "dof"], Float[Array, ""]]:
        stopped = eqx.tree_at(lambda t: t.solver.max_iterations, tracker, count)
        _, result = stopped.found(state, seen, capacities)
        return result.pose, result.energy

    return jax.lax.map(after, jnp.asarray(counts))
