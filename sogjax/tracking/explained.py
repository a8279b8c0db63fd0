"""How much of what is seen a pose explains, in absolute terms."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.energy.appearance import ColorWindows
from sogjax.energy.posed import Posed
from sogjax.tracking.pose_search import Hunt, Searcher, centres_of
from sogjax.tracking.search_energy import SearchEnergy
from sogjax.tracking.seen_frame import SeenFrame

CLEARLY = 0.1
"""Log odds below which a cell counts as background."""


class Explained(eqx.Module):
    """Of each camera, areas in windows around a body."""

    foreground: Float[Array, "camera"]
    """Part of what looks like foreground, by log odds, that the body covers."""
    background: Float[Array, "camera"]
    """What the body covers that looks like background, as a part of what it covers."""
    gain: Float[Array, "camera"]
    """Mean log likelihood gained where the body covers."""


def explained(searcher: Searcher, frame: SeenFrame, pose: Float[np.ndarray, "dof"]) -> Explained:
    """What a pose explains of a frame."""
    hunt = Hunt.of_places(searcher, frame, centres_of(searcher.body, pose[None]))
    return _explained(hunt.energy, hunt.windows, jnp.asarray(pose))


@eqx.filter_jit
def _explained(energy: SearchEnergy, windows: ColorWindows, pose: Array) -> Explained:
    here = jax.tree.map(lambda leaf: leaf[0], windows)
    objective = energy.of_windows(here)
    cover, gain = energy.appearance(here).covered(Posed.from_pose(energy.body, pose), objective.frame)
    best = jnp.max(here.odds, axis=1)
    wanted, unwanted = jnp.maximum(best, 0.0), (best < -CLEARLY).astype(cover.dtype)
    total = lambda values: jnp.sum(values, axis=(1, 2))
    whole = total(cover) + 1e-6
    return Explained(
        total(wanted * cover) / (total(wanted) + 1e-6), total(unwanted * cover) / whole, total(gain) / whole
    )
