"""Bodies are solid: how deep limbs lie in each other, in the trunk, or in another actor.

A limb's bones are capsules between their first and last blob, which nothing slips through; each blob of the trunk is a
sphere. Parts that touch in a named pose may touch: the deepest of these is allowed.
"""

from itertools import combinations, groupby

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.model.body import Body
from sogjax.model.limbs import limb_blobs
from sogjax.model.program import compiled

RADIUS = 1.35
"""Of the disc that a blob of sigma 1 stands for."""
SOFT = 0.02
"""Metres by which two parts may always be in each other: clothes and flesh give way."""
DEEP = 0.04
"""Metres beyond that, and beyond all named poses, that a pose may not be deeper than one that is known."""
UNLIKELY, IMPOSSIBLE = 0.07, 0.11
"""Metres from which on a pose is the less likely the deeper it is, and from which on it is impossible: two who dance or
talk are up to 0.07 in each other, and legs of who runs for an instant; legs that were exchanged are 0.1."""
PAIRS_AT_ONCE = 256
"""Pairs are padded to a multiple of this, where only some matter."""


class Solid(eqx.Module):
    """The pairs of capsules of a body that cannot be in the same place."""

    ends: Int[Array, "capsule 2"]
    """The blobs where a capsule begins and ends; a sphere's are the same."""
    radii: Float[Array, "capsule"]
    """Metres."""
    of_limbs: Bool[Array, "capsule"]
    """Which are bones of limbs; the others are the trunk's."""
    pairs: Int[Array, "pair 2"]
    allowed: Float[Array, "pair"]
    """Metres."""

    @classmethod
    def of(cls, body: Body) -> "Solid":
        """Limbs against other limbs and the trunk, and everything against other actors, which it may only touch."""
        of_limb, actors = limb_blobs(body), body.blob_actors
        ends, owners = [], []
        for blob in np.flatnonzero(~of_limb.any(axis=0)):
            ends.append((blob, blob))
            owners.append((actors[blob], -1))
        for limb, blobs in enumerate(of_limb):
            for _, bone in groupby(np.flatnonzero(blobs), key=lambda blob: body.blobs.joints[blob]):
                members = [*bone]
                ends.append((members[0], members[-1]))
                owners.append((actors[members[0]], limb))
        differ = lambda one, two: owners[one] != owners[two]
        pairs = [pair for pair in combinations(range(len(ends)), 2) if differ(*pair)]
        sigmas = np.asarray(body.blob_sigmas)
        radii = np.array([RADIUS * sigmas[[*both]].mean() for both in ends])
        known = cls(
            jnp.asarray(np.array(ends, int).reshape(-1, 2)),
            jnp.asarray(radii.reshape(-1), sigmas.dtype),
            jnp.asarray([limb >= 0 for _, limb in owners], bool),
            jnp.asarray(np.array(pairs, int).reshape(-1, 2)),
            jnp.zeros(len(pairs), sigmas.dtype),
        )
        deepest = _deepest(known, body, jnp.stack([*body.poses.values()]))
        same = jnp.asarray([owners[one][0] == owners[two][0] for one, two in pairs], bool)
        allowed = jnp.where(same, jnp.maximum(deepest, 0.0), 0.0) + SOFT
        return eqx.tree_at(lambda solid: solid.allowed, known, allowed)

    def regardless_of(self, blobs: Int[np.ndarray, "_blob"]) -> "Solid":
        """The same, but that whatever some blobs are in does not matter."""
        of_pairs = np.asarray(self.ends)[np.asarray(self.pairs)].reshape(-1, 4)
        allowed = jnp.where(np.isin(of_pairs, blobs).any(axis=1), jnp.inf, self.allowed)
        return eqx.tree_at(lambda solid: solid.allowed, self, allowed)

    def about(self, blobs: Int[np.ndarray, "_blob"]) -> "Solid":
        """The same, but that only the pairs that some blobs belong to matter, so that others are not computed."""
        pairs = np.asarray(self.pairs)
        kept = np.flatnonzero(np.isin(np.asarray(self.ends)[pairs].reshape(-1, 4), blobs).any(axis=1))
        spare = -len(kept) % PAIRS_AT_ONCE  # few sizes, so few programs
        allowed = jnp.append(self.allowed[kept], jnp.full(spare, jnp.inf, self.allowed.dtype))
        padded = jnp.asarray(np.concatenate([pairs[kept], np.zeros((spare, 2), pairs.dtype)]))
        return eqx.tree_at(lambda solid: (solid.pairs, solid.allowed), self, (padded, allowed))

    def deeper(
        self, body: Body, known: Float[np.ndarray, "dof"], poses: Float[np.ndarray, "start dof"]
    ) -> Float[np.ndarray, "start pair"]:
        """By how much pairs that are deeper than in a known pose are deeper than is allowed (metres); 0 for others."""
        excess = np.asarray(_excess(self, body, jnp.asarray(np.concatenate([known[None], poses]))))
        return np.where(excess[1:] > excess[:1] + SOFT, excess[1:], 0.0)

    def blobs_of(self, pairs: Bool[np.ndarray, "pair"]) -> Int[np.ndarray, "_blob"]:
        """Blobs of what is too deep in something else: of limbs, or of trunks that are in each other."""
        found = [np.array(self.pairs)[k] for k in np.flatnonzero(pairs)]
        of_limbs, ends = np.asarray(self.of_limbs), np.asarray(self.ends)
        blamed = [each for pair in found for each in pair if of_limbs[each] or not of_limbs[pair].any()]
        return np.unique(ends[np.array(blamed, int)])

    def depths(self, means: Float[Array, "blob 3"]) -> Float[Array, "pair"]:
        """How deep the capsules of each pair are in each other (metres); negative where they are apart."""
        one, two = (means[self.ends[self.pairs[:, k]]] for k in (0, 1))
        apart = jax.vmap(segment_distance)(one, two)
        return self.radii[self.pairs[:, 0]] + self.radii[self.pairs[:, 1]] - apart

    def excess(self, means: Float[Array, "blob 3"]) -> Float[Array, "pair"]:
        """By how much each pair is deeper than is allowed (metres); 0 where it is not."""
        return jnp.maximum(self.depths(means) - self.allowed, 0.0)

    def impossibility(self, means: Float[Array, "blob 3"]) -> Float[Array, ""]:
        """How impossible it is that the blobs are there, 0 to 1, as the pair says that is deepest."""
        deepest = jnp.max(self.excess(means), initial=0.0)
        return jnp.clip((deepest - UNLIKELY) / (IMPOSSIBLE - UNLIKELY), 0.0, 1.0)


@compiled
def _deepest(solid: Solid, body: Body, poses: Float[Array, "start dof"]) -> Float[Array, "pair"]:
    """How deep each pair is in each other in any of some poses."""
    return jnp.max(jax.vmap(lambda pose: solid.depths(body.posed_blobs(pose).means))(poses), axis=0)


@compiled
def _excess(solid: Solid, body: Body, poses: Float[Array, "start dof"]) -> Float[Array, "start pair"]:
    return jax.vmap(lambda pose: solid.excess(body.posed_blobs(pose).means))(poses)


@compiled
def impossibilities(solid: Solid, body: Body, poses: Float[Array, "start dof"]) -> Float[Array, "start"]:
    """How impossible poses are, 0 to 1."""
    return jax.vmap(lambda pose: solid.impossibility(body.posed_blobs(pose).means))(poses)


def segment_distance(one: Float[Array, "2 3"], two: Float[Array, "2 3"]) -> Float[Array, ""]:
    """The least distance of two segments, each given by its ends."""
    dot = lambda a, b: jnp.sum(a * b)
    u, v, w = one[1] - one[0], two[1] - two[0], one[0] - two[0]
    a, b, c, d, e = dot(u, u), dot(u, v), dot(v, v), dot(u, w), dot(v, w)
    tiny = 1e-9
    share = lambda value, whole: jnp.clip(value / jnp.maximum(whole, tiny), 0.0, 1.0)
    s = share(b * e - c * d, a * c - b * b)
    t = share(b * s + e, c)
    s = share(b * t - d, a)
    t = share(b * s + e, c)
    return jnp.linalg.norm(w + s * u - t * v)
