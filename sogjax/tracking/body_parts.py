"""The parts of a model of several actors that can be taken from another pose: whole actors, and their limbs."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Int

from sogjax.model.body import Body
from sogjax.tracking.culling import actor_of_blobs
from sogjax.tracking.limbs import limb_blobs, limb_names, limbs


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
