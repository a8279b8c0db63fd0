"""What the cells around a body say for its pose, where no other actor is seen."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.energy.appearance import ColorWindows
from sogjax.energy.posed import Posed
from sogjax.energy.views import odds_on_grid
from sogjax.model.limbs import limb_blobs
from sogjax.model.program import compiled
from sogjax.search.placed_body import centres_of
from sogjax.search.pose_search import PlacedSearch, PoseSearch
from sogjax.search.search_energy import SearchEnergy
from sogjax.search.seen_frame import SeenFrame

CERTAIN = 0.1
"""Log odds below minus which a cell counts as background."""
LEAST_VISIBLE = 0.15
"""Part of a body that others leave visible in a camera, below which that camera says nothing of it."""


class CellEvidence(eqx.Module):
    """What the cells around a body say for its pose, in each camera and of each limb.

    Whether what looks like foreground is covered is asked of all actors together. Otherwise cells in which another one
    is seen say nothing: who is hidden there neither gains nor loses. A camera in which it is hidden has NaN.
    """

    foreground: Float[Array, "camera"]
    """Part of what looks like foreground, by log odds, that the body and the others cover."""
    background: Float[Array, "camera"]
    """What the body covers that looks like background, as a part of what it covers."""
    gain: Float[Array, "camera"]
    """Mean log likelihood gained where the body covers."""
    visible: Float[Array, "camera"]
    """Part of what the body covers in which no other actor is seen; never NaN."""
    limbs: Float[Array, "limb"]
    """What is lost without a limb, for its size, as a part of what the whole body gains for its own."""
    known: Float[Array, ""]
    """Part of what the body covers whose background is known."""


def cell_evidence(searcher: PoseSearch, frame: SeenFrame, pose: Float[np.ndarray, "dof"]) -> CellEvidence:
    """What the cells of a frame say for a pose."""
    placed = PlacedSearch.of_places(searcher, frame, centres_of(searcher.body, pose[None]))
    here = jax.tree.map(lambda leaf: leaf[0], placed.windows)
    known = _known(frame, here)
    return _cell_evidence(placed.energy, here, known, jnp.asarray(limb_blobs(searcher.body)), jnp.asarray(pose))


@compiled
def _known(frame: SeenFrame, windows: ColorWindows) -> Float[Array, "camera column row"]:
    """1 where the background is known, -1 where it is not, 0 outside the pictures."""
    return jax.vmap(odds_on_grid)(frame.known, frame.cell_sizes, frame.cameras, windows.x, windows.y)


@compiled
def _cell_evidence(
    energy: SearchEnergy,
    here: ColorWindows,
    known: Float[Array, "camera column row"],
    limbs: Bool[Array, "limb blob"],
    pose: Array,
) -> CellEvidence:
    objective, appearance = energy.of_windows(here), energy.appearance(here)
    posed = Posed.from_pose(energy.body, pose)
    cover, gain = appearance.covered(posed, objective.frame)

    def without(limb: Bool[Array, "blob"]) -> Float[Array, ""]:
        rest = eqx.tree_at(lambda p: p.blobs.mask, posed, posed.blobs.mask & ~limb)
        return appearance.value(rest, objective.frame)

    areas = energy.body.blob_sigmas**2
    value = appearance.value(posed, objective.frame)
    lost = value - jax.vmap(without)(limbs)
    sizes = jnp.sum(jnp.where(limbs, areas[None], 0.0), axis=1) / jnp.sum(areas)
    of_limb = lost / (jnp.maximum(jnp.abs(value), 1e-6) * sizes)
    best = jnp.max(here.odds, axis=1)
    wanted, unwanted = jnp.maximum(best, 0.0), (best < -CERTAIN).astype(cover.dtype) * here.free
    total = lambda values: jnp.sum(values, axis=(1, 2))
    whole = total(cover * here.free) + 1e-6
    visible = whole / (total(cover) + 1e-6)
    where_seen = lambda values: jnp.where(visible < LEAST_VISIBLE, jnp.nan, values)
    return CellEvidence(
        foreground=where_seen(total(wanted * (1.0 - here.free * (1.0 - cover))) / (total(wanted) + 1e-6)),
        background=where_seen(total(unwanted * cover) / whole),
        gain=where_seen(total(gain * here.free) / whole),
        visible=visible,
        limbs=of_limb,
        known=jnp.sum(cover * jnp.maximum(known, 0.0)) / (jnp.sum(cover * jnp.abs(known)) + 1e-6),
    )
