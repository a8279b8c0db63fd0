"""The parts of a model of several actors that can be taken from another pose: whole actors, and their limbs."""

from collections.abc import Sequence
from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.model.body import Body
from sogjax.model.limbs import limb_blobs, limb_names, limbs
from sogjax.search.mirrored import fitted_to_blobs
from sogjax.tracking.culling import actor_of_blobs

ITERATIONS = 8
"""Of putting a limb in its place: the two poses are near each other."""


@dataclass(frozen=True)
class Part:
    """An actor, or a limb."""

    name: str
    dofs: Int[np.ndarray, "of_part"]
    blobs: Bool[np.ndarray, "blob"]
    """That tell where it is: of an actor those of the trunk."""
    whole: int | None
    """Which part the limb's actor is; None for actors."""


def body_parts(body: Body) -> tuple[Part, ...]:
    """The actors of a body, then their limbs."""
    trees, of_blob = np.asarray(body.skeleton.trees), actor_of_blobs(body.skeleton, body.blobs.joints)
    in_limbs = limb_blobs(body)
    moves = np.asarray(body.skeleton.parameter_transform) != 0.0
    parts = []
    for actor in range(int(trees.max()) + 1):
        trunk = (of_blob == actor) & ~in_limbs.any(axis=0)
        blobs = trunk if trunk.any() else of_blob == actor
        root = body.skeleton.names[int(np.flatnonzero(trees == actor)[0])]
        name = "/".join([*root.split("/")[:-1], "whole body"])
        parts.append(Part(name, np.flatnonzero(moves[trees == actor].any(axis=0)), blobs, None))
    for name, dofs, blobs in zip(limb_names(body), limbs(body.skeleton), in_limbs, strict=True):
        if blobs.any():
            parts.append(Part(name, dofs, blobs, int(of_blob[blobs][0])))
    return tuple(parts)


class PartArrays(eqx.Module):
    """The parts as arrays: whole actors first, then limbs."""

    dofs: Bool[Array, "whole dof"]
    blobs: Bool[Array, "part blob"]

    @classmethod
    def of(cls, body: Body, parts: Sequence[Part]) -> "PartArrays":
        """Of the parts of a body, which are in that order."""
        whole = [part for part in parts if part.whole is None]
        dofs = np.zeros((len(whole), body.skeleton.num_dofs), bool)
        for k, part in enumerate(whole):
            dofs[k, part.dofs] = True
        return cls(jnp.asarray(dofs), jnp.asarray(np.stack([part.blobs for part in parts])))

    def mixed(self, body: Body, pose: Float[Array, "dof"], other: Float[Array, "dof"]) -> Float[Array, "part dof"]:
        """The pose with each part as it is in the other one."""
        limbs = with_blobs(body, pose, other, self.blobs[len(self.dofs) :])
        return jnp.concatenate([jnp.where(self.dofs, other, pose), limbs])


def merged_pose(
    body: Body,
    parts: Sequence[Part],
    pose: Float[np.ndarray, "dof"],
    other: Float[np.ndarray, "dof"],
    taken: Bool[np.ndarray, "part"],
) -> Float[np.ndarray, "dof"]:
    """A pose with the parts that are taken from another one: whole actors as they are there, limbs in their places."""
    base, blobs = pose.copy(), np.zeros(body.num_blobs, bool)
    for part, is_taken in zip(parts, taken, strict=True):
        if is_taken and part.whole is None:
            base[part.dofs] = other[part.dofs]
        elif is_taken:
            blobs |= part.blobs
    if not blobs.any():
        return base
    return np.asarray(with_blobs(body, jnp.asarray(base), jnp.asarray(other), jnp.asarray(blobs[None]))[0])


@eqx.filter_jit
def with_blobs(
    body: Body, pose: Float[Array, "dof"], other: Float[Array, "dof"], blobs: Bool[Array, "choice blob"]
) -> Float[Array, "choice dof"]:
    """The pose with some blobs where they are in the other one, for each choice of blobs.

    Angles cannot just be exchanged: where the trunk is turned a little, a limb would go elsewhere.
    """
    means, others = (body.posed_blobs(each).means for each in (pose, other))
    targets = jnp.where(blobs[..., None], others, means)
    return fitted_to_blobs(body, jnp.broadcast_to(pose, (len(blobs), len(pose))), targets, ITERATIONS)[0]
