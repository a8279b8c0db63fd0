"""Poses of a frame climbed with the tracker's energy, without history."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.posed import History
from sogjax.energy.views import Views
from sogjax.model.program import compiled
from sogjax.search.worth import worth
from sogjax.tracking.capacity import Needed, with_room
from sogjax.tracking.culling import Capacities
from sogjax.tracking.tracker import Tracker

FEW, MORE = 0.16, 0.64
"""Parts of the solver's most iterations that the whole body makes, from a pose that was tracked or whose limbs were
climbed already, and from others."""


Climbed = tuple[Float[Array, "dof"], Float[Array, ""]]
"""A pose, and what it is worth."""


def climbed_in(
    tracker: Tracker,
    views: Views,
    start: Float[np.ndarray | Array, "dof"],
    share: float,
    capacities: Capacities,
) -> Climbed:
    """A pose climbed with the tracker's energy and a share of its solver's most iterations, and what it is worth.

    There is room for the near pairs of `capacities`, and for more where that needs them.
    """
    start = jnp.asarray(start)
    part = jnp.asarray(share, start.dtype)

    def climb(room: Capacities) -> tuple[Climbed, Needed]:
        only_blocks = Capacities(0, 0, room.blocks)  # one program, whatever room the views have for image blobs
        pose, value, blocks = _climbed_in(tracker, views, start, part, only_blocks)
        return (pose, value), (0, 0, blocks)

    return with_room(climb, capacities)


@compiled
def _climbed_in(
    tracker: Tracker, views: Views, start: Float[Array, "dof"], share: Float[Array, ""], room: Capacities
) -> tuple[Float[Array, "dof"], Float[Array, ""], Int[Array, ""]]:
    energy = FrameEnergy(tracker.body, views, History.unknown(start), tracker.terms)
    most = jnp.ceil(share * tracker.solver.max_iterations).astype(jnp.int32)
    found, blocks = tracker.solved(energy, start, room, most)
    return found.params, worth(energy, tracker.solid, found.params, found.value), blocks
