"""Limbs of a body, and poses that differ in one limb."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.model.body import Body
from sogjax.model.skeleton import Skeleton

LIMB_OF_END = {
    **dict.fromkeys(("elbow", "wrist", "hand"), "arm"),
    **dict.fromkeys(("knee", "ankle", "foot", "toe", "toes", "paw"), "leg"),
    **dict.fromkeys(("top", "tip"), ""),
    "nose": "head",
}
"""What a limb is called whose end is called so."""
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


def limb_names(body: Body) -> tuple[str, ...]:
    """What to call each limb: by the landmark at its end, or else by its last joint."""
    used = np.asarray(body.skeleton.parameter_transform) != 0.0
    names = []
    for limb in limbs(body.skeleton):
        moved = used[:, limb].any(axis=1)
        last = [name for name, joint in zip(body.landmarks.names, body.landmarks.joints, strict=True) if moved[joint]]
        end = last[-1] if last else body.skeleton.names[int(np.flatnonzero(moved)[-1])]
        actor, slash, end = end.rpartition("/")
        words = [LIMB_OF_END.get(word, word) for word in end.split("_")]
        names.append(actor + slash + " ".join(word for word in words if word))
    return tuple(names)


def joint_limbs(skeleton: Skeleton) -> Int[np.ndarray, "joint"]:
    """The limb that each joint belongs to; -1 for the trunk's."""
    used = np.asarray(skeleton.parameter_transform) != 0.0
    found = np.full(skeleton.num_joints, -1)
    for k, limb in enumerate(limbs(skeleton)):
        found[used[:, limb].any(axis=1)] = k
    return found


def limb_slices(bodies: Sequence[Body]) -> list[slice]:
    """The slices of the concatenated model's limbs that are each body's."""
    ends = np.cumsum([0, *(len(limbs(body.skeleton)) for body in bodies)])
    return [slice(int(first), int(stop)) for first, stop in pairwise(ends)]


def limb_blobs(body: Body) -> Bool[np.ndarray, "limb blob"]:
    """Which blobs belong to each limb."""
    of_blob = joint_limbs(body.skeleton)[np.array(body.blobs.joints, int)]
    return np.arange(len(limbs(body.skeleton)))[:, None] == of_blob[None, :]


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
