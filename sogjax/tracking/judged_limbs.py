"""The limbs of a body, of all actors, as arrays for the compiled step."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.model.body import Body
from sogjax.tracking.limbs import limb_blobs

WORST = 1.0 / 3.0
"""Part of a limb's blobs that is looked at: those that fit worst, as a limb is lost from some joint on."""


class JudgedLimbs(eqx.Module):
    """Which blobs are a limb's."""

    members: Bool[Array, "limb blob"]
    worst: Float[Array, "limb blob"]
    """What each of a limb's blobs counts, in the order of how well they fit, the worst first."""
    of_other_parts: Float[Array, "blob blob"]
    """1 for two blobs of different limbs, or of which one belongs to none; else 0."""
    actor_of_blob: tuple[int, ...] = eqx.field(static=True)

    @classmethod
    def from_body(cls, body: Body) -> "JudgedLimbs":
        """Of a body, or several beside each other."""
        members = limb_blobs(body)
        counts = np.ceil(WORST * members.sum(axis=1, keepdims=True))
        worst = (np.arange(members.shape[1]) < counts) / np.maximum(counts, 1.0)
        parts = np.where(members.any(axis=0), members.argmax(axis=0), -1) if len(members) else np.zeros(body.num_blobs)
        return cls(
            members=jnp.asarray(members),
            worst=jnp.asarray(worst, body.blob_sigmas.dtype),
            of_other_parts=jnp.asarray(parts[:, None] != parts[None, :], body.blob_sigmas.dtype),
            actor_of_blob=tuple(body.skeleton.trees[joint] for joint in body.blobs.joints),
        )

    def mean_of_worst(self, values: Float[Array, "blob"]) -> Float[Array, "limb"]:
        """The mean of the lowest third of the values of each limb's blobs."""
        ordered = jnp.sort(jnp.where(self.members, values[None, :], jnp.inf), axis=1)
        return jnp.sum(jnp.where(self.worst > 0.0, ordered, 0.0) * self.worst, axis=1)
