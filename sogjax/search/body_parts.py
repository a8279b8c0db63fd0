"""The parts of a body that can be taken from another pose (whole actors, and their limbs), and which ones are."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.part_energy import PartIndex
from sogjax.model.body import Body
from sogjax.model.limbs import limb_blobs, limb_names, limbs
from sogjax.model.program import compiled
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.metrics import stretches
from sogjax.search.best_passes import best_passes
from sogjax.search.mirrored import fitted_part, other_side

ITERATIONS = 8
"""Steps to put a limb in its place: the two poses are near each other."""


@dataclass(frozen=True)
class Part:
    """An actor, a limb, or a pair of limbs."""

    names: tuple[str, ...]
    """Of the actor, or of the limbs."""
    dofs: Int[np.ndarray, "of_part"]
    blobs: Bool[np.ndarray, "blob"]
    """The blobs that tell where it is: of an actor those of the trunk."""
    whole: int | None
    """Which part the limb's actor is; None for actors."""

    @property
    def name(self) -> str:
        """What to call it."""
        return " and ".join(self.names)


def body_parts(body: Body) -> tuple[Part, ...]:
    """The actors of a body, then their limbs, then the pairs of limbs that are each other's counterpart."""
    trees, of_blob = np.asarray(body.skeleton.trees), body.blob_actors
    in_limbs = limb_blobs(body)
    moves = np.asarray(body.skeleton.parameter_transform) != 0.0
    parts = []
    for actor in range(int(trees.max()) + 1):
        trunk = (of_blob == actor) & ~in_limbs.any(axis=0)
        blobs = trunk if trunk.any() else of_blob == actor
        root = body.skeleton.names[int(np.flatnonzero(trees == actor)[0])]
        name = "/".join([*root.split("/")[:-1], "whole body"])
        parts.append(Part((name,), np.flatnonzero(moves[trees == actor].any(axis=0)), blobs, None))
    names, every_limb = limb_names(body), limbs(body.skeleton)
    for members in limb_groups(body):
        blobs = np.logical_or.reduce(in_limbs[list(members)])
        dofs = np.concatenate([every_limb[k] for k in members])
        parts.append(Part(tuple(names[k] for k in members), dofs, blobs, int(of_blob[blobs][0])))
    return tuple(parts)


def limb_groups(body: Body) -> list[tuple[int, ...]]:
    """The limbs that have blobs, by their numbers; then the pairs of them that are each other's counterpart."""
    every_limb, blobs, others = limbs(body.skeleton), limb_blobs(body), other_side(body.skeleton.dof_names)
    known = [k for k in range(len(every_limb)) if blobs[k].any()]
    pairs = [(j, k) for j in known for k in known if j < k and np.isin(every_limb[k], others[every_limb[j]]).any()]
    return [*((k,) for k in known), *pairs]


class PartArrays(eqx.Module):
    """Parts as arrays."""

    whole: Bool[Array, "part"]
    """Which are whole actors."""
    dofs: Bool[Array, "part dof"]
    blobs: Bool[Array, "part blob"]
    in_pairs: Bool[Array, "part"]
    """Which are a limb of a pair."""
    actors: PartIndex
    """For each part, its whole actor."""

    @classmethod
    def of(cls, body: Body, parts: Sequence[Part]) -> "PartArrays":
        """The arrays of a body's parts."""
        dofs = np.zeros((len(parts), body.skeleton.num_dofs), bool)
        for k, part in enumerate(parts):
            dofs[k, part.dofs] = True
        paired = {name for part in parts if len(part.names) > 1 for name in part.names}
        in_pairs = [len(part.names) == 1 and part.names[0] in paired for part in parts]
        whole, blobs = [part.whole is None for part in parts], np.stack([part.blobs for part in parts])
        actors = [k if part.whole is None else part.whole for k, part in enumerate(parts)]
        actor_blobs = [np.flatnonzero(body.blob_actors == actor) for actor in actors]
        index = PartIndex.of([parts[actor].dofs for actor in actors], actor_blobs)
        return cls(jnp.asarray(whole), jnp.asarray(dofs), jnp.asarray(blobs), jnp.asarray(in_pairs), index)

    def mixed(self, body: Body, pose: Float[Array, "dof"], other: Float[Array, "dof"]) -> Float[Array, "part dof"]:
        """The pose with each part as it is in the other one."""
        limbs = jax.vmap(partial(with_blobs, body, pose, other))(self.blobs, self.actors)
        return jnp.where(self.whole[:, None], jnp.where(self.dofs, other, pose), limbs)


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
    poses, everybody = (jnp.asarray(base), jnp.asarray(other)), PartIndex.whole(body)
    return np.asarray(with_blobs(body, *poses, jnp.asarray(blobs), everybody))


@compiled
def with_blobs(
    body: Body, pose: Float[Array, "dof"], other: Float[Array, "dof"], blobs: Bool[Array, "blob"], moved: PartIndex
) -> Float[Array, "dof"]:
    """The pose with some blobs, of a part that may be moved, where they are in the other one.

    Angles cannot just be exchanged: where the trunk is turned a little, a limb would go elsewhere.
    """
    means, others = (body.posed_blobs(each).means for each in (pose, other))
    targets = jnp.where(blobs[:, None], others, means)
    return fitted_part(body, moved, ITERATIONS, pose, targets[moved.blobs])[0]


def select_parts(
    parts: Sequence[Part],
    apart: Float[np.ndarray, "frame part"],
    gains: Float[np.ndarray, "frame part"],
    energy: float,
    open_ends: tuple[bool, bool] = (False, False),
    doubts: Float[np.ndarray, "frame part"] | float = 0.0,
) -> Bool[np.ndarray, "frame part"]:
    """Which parts are taken from the other pass, in frames that follow each other; the pass itself holds around them.

    The choice that gains the most energy in sum, less what it costs to change from one pass to the other: the more,
    the farther apart they are there. A limb is looked at only where the trunk that it hangs on is in the same place in
    both passes; else the whole actor is taken, or left.

    Args:
        parts: of the body.
        apart: metres between the passes.
        gains: of taking each part.
        energy: of a frame, for scale.
        open_ends: whether the clip ends before the first and behind the last of the frames.
        doubts: how likely each part is lost in the known pass: the less it need gain to be taken.
    """
    costs, taken = fitted_numbers().merge_passes, np.zeros(apart.shape, bool)
    bias = costs.bias * (1.0 - np.broadcast_to(doubts, apart.shape))
    for k, part in enumerate(parts):
        whole = 0.0 if part.whole is None else apart[:, part.whole]
        alone = [
            j for j, other in enumerate(parts) if len(part.names) > 1 and other.names in [(n,) for n in part.names]
        ]
        more = gains[:, k] - np.maximum(gains[:, alone], 0.0).sum(axis=1)  # of a pair, than of its limbs by themselves
        worth = np.where(whole > costs.apart, 0.0, more / energy) - bias[:, k]
        own = [j for j, other in enumerate(parts) if other.whole == k]  # an actor moves as far as its limbs do
        changes = costs.change * changes_between(apart[:, [k, *own]].max(axis=1), open_ends)
        found, _ = best_passes(worth[:, None], changes)
        for stretch in (slice(*ends) for ends in stretches(found > 0)):
            taken[stretch, k] = apart[stretch, k].max() > costs.apart
    return taken


def changes_between(
    apart: Float[np.ndarray, "frame"], open_ends: tuple[bool, bool] = (False, False)
) -> Float[np.ndarray, "change 2 2"]:
    """How far it is from each pass to the same, or to the other one, before each frame, and behind the last.

    That is how far the passes are apart there. At an open end of the frames there is no frame beside, so that no change
    is made there.
    """
    between = 0.5 * (apart[:-1] + apart[1:])
    ends = [0.0 if is_open else cost for is_open, cost in zip(open_ends, apart[[0, -1]], strict=True)]
    return np.concatenate([ends[:1], between, ends[1:]])[:, None, None] * (1.0 - np.eye(2))
