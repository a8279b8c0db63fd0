"""What poses are worth to a search that compares them: the tracker's energy, less what bodies cannot do."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.model.solid import Solid

IMPOSSIBLE_COST = 0.02
"""Part of its energy that an impossible pose costs: where legs are hidden, the wrong one explains up to 1 % more."""


def worth(
    energy: FrameEnergy, solid: Solid | None, pose: Float[Array, "dof"], value: Float[Array, ""] | None = None
) -> Float[Array, ""]:
    """What a pose is worth; `value` is its energy, where that is known."""
    value = energy(pose) if value is None else value
    if solid is None:
        return value
    return value - IMPOSSIBLE_COST * jnp.abs(value) * solid.impossibility(energy.body.posed_blobs(pose).means)
