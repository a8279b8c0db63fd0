"""Limbs of a body, and poses that differ in one limb."""

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.model.body import Body
from sogjax.model.skeleton import Skeleton

SAME = 1e-3
"""Radians: values of a limb that differ by less are the same."""


def limbs(skeleton: Skeleton) -> list[Int[np.ndarray, "limb"]]:
    """Degrees of freedom of each limb: a chain that leaves a joint where the tree branches, and branches no more."""
    children = [[k for k, parent in enumerate(skeleton.parents) if parent == j] for j in range(len(skeleton.parents))]
    used = np.asarray(skeleton.parameter_transform) != 0.0
    found = []
    for joint, below in enumerate(children):
        if len(children[joint]) < 2:
            continue
        for first in below:
            chain = _chain(first, children)
            if chain is None:
                continue
            dofs = np.flatnonzero(used[chain].any(axis=0) & ~np.delete(used, chain, axis=0).any(axis=0))
            if len(dofs):
                found.append(dofs)
    return found


def limb_blobs(body: Body) -> Bool[np.ndarray, "limb blob"]:
    """Which blobs belong to each limb."""
    used = np.asarray(body.skeleton.parameter_transform) != 0.0
    moved = [used[:, limb].any(axis=1) for limb in limbs(body.skeleton)]
    return np.array([joints[np.asarray(body.blobs.joints)] for joints in moved], bool).reshape(-1, body.num_blobs)


def _chain(joint: int, children: list[list[int]]) -> list[int] | None:
    """The joints from one to the end of its chain; None where it branches."""
    chain = [joint]
    while len(children[chain[-1]]) == 1:
        chain.append(children[chain[-1]][0])
    return chain if not children[chain[-1]] else None


def with_other_limb(
    body: Body, pose: Float[np.ndarray, "dof"], limb: Int[np.ndarray, "limb"], others: Float[np.ndarray, "other dof"]
) -> Float[np.ndarray, "variant dof"]:
    """The pose itself, and with one limb as in every named pose and in some others, each once."""
    sources = np.concatenate([pose[None], np.stack([np.asarray(named) for named in body.poses.values()]), others])
    values = sources[:, limb]
    first = [k for k in range(len(values)) if not np.any(np.all(np.abs(values[:k] - values[k]) < SAME, axis=1))]
    variants = np.tile(pose, (len(first), 1))
    variants[:, limb] = values[first]
    return variants
