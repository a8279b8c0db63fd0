"""How well a body lies on what is seen of it in a frame, in absolute terms: what a verdict on a run follows from."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.energy.foreground import cover
from sogjax.energy.posed import Posed
from sogjax.energy.windows import Windows
from sogjax.model.camera import Camera, project
from sogjax.tracking.judged_limbs import JudgedLimbs
from sogjax.tracking.limb_evidence import DENSITY, BlobEvidence

CLEARLY = 0.3
"""Log odds from which a cell is foreground, and below minus which it is background; others do not count."""


class FrameFit(eqx.Module):
    """Of each actor in a frame."""

    explained: Float[Array, "actor"]
    """Part of its visible area that shows its blobs' own colours, and no background where that is known."""
    overlap: Float[Array, "actor camera"]
    """Of its silhouette with the foreground around it (intersection over union); NaN where no background is known."""


def frame_fit(
    limbs: JudgedLimbs, evidence: BlobEvidence, posed: Posed, cameras: Camera, windows: Windows | None
) -> FrameFit:
    """Of posed bodies, from the evidence for their blobs and the foreground around each actor."""
    actors = np.array(limbs.actor_of_blob, int)
    own = jnp.asarray(actors[None, :] == np.arange(actors.max() + 1)[:, None], posed.blobs.sigmas.dtype)
    areas = own * (evidence.seen * posed.blobs.sigmas**2)[None, :]
    explained = jnp.sum(areas * evidence.explained[None, :], axis=1) / (jnp.sum(areas, axis=1) + 1e-9)
    if windows is None:
        return FrameFit(explained, jnp.full((len(own), cameras.image_size.shape[0]), jnp.nan, explained.dtype))
    seen = jax.vmap(project, in_axes=(0, None))(cameras, posed.blobs)
    covered = jax.vmap(cover, in_axes=(0, 0, None))(windows, seen, jnp.asarray(DENSITY, explained.dtype))
    shown, empty = ((odds > CLEARLY).astype(explained.dtype) for odds in (windows.odds, -windows.odds))
    total = lambda values: jnp.sum(values, axis=(2, 3))
    both, either = total(covered * shown), total(shown) + total(covered * empty)
    return FrameFit(explained, jnp.where(either > 0.0, both / jnp.maximum(either, 1e-6), jnp.nan).T)
