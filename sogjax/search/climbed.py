"""Poses of a frame climbed with the tracker's energy, without history."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.posed import History
from sogjax.energy.views import Views
from sogjax.model.program import compiled
from sogjax.search.worth import worth
from sogjax.tracking.tracker import Tracker

FEW, MORE = 0.16, 0.64
"""Parts of the solver's most iterations that the whole body makes, from a pose that was tracked or whose limbs were
climbed already, and from others."""


@compiled
def climbed_in(
    tracker: Tracker, views: Views, start: Float[Array, "dof"], share: Float[Array, ""]
) -> tuple[Float[Array, "dof"], Float[Array, ""]]:
    """A pose climbed with the tracker's energy and a share of its solver's most iterations, and what it is worth."""
    energy = FrameEnergy(tracker.body, views, History.unknown(start), tracker.terms)
    most = jnp.ceil(share * tracker.solver.max_iterations).astype(jnp.int32)
    solver = eqx.tree_at(lambda solver: solver.max_iterations, tracker.solver, most)
    found = solver.maximize(energy, start, tracker.scales)
    return found.params, worth(energy, tracker.solid, found.params, found.value)
