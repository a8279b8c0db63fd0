"""Limbs that are searched together, and ways to hold them: what looks like the tracked one, and what is drawn.

A unit is a pair of limbs that are each other's counterpart, since what one of them explains is often the other one's.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.part_energy import PartIndex
from sogjax.model.body import Body
from sogjax.model.limbs import limb_blobs, limb_names, limbs
from sogjax.search.body_parts import limb_groups
from sogjax.search.mirrored import fitted_part, other_side

NUM_DRAWN = 100
"""Ways to hold a unit that are drawn in a frame; another frame draws others."""
FIT_ITERATIONS = 5
SMALL_RANGE = 0.9
"""Radians: a degree of freedom of less range is not drawn."""
NEARBY = 1.2
"""Radians around the tracked pose, within which every second way is drawn."""


@dataclass(frozen=True)
class Unit:
    """Limbs that are searched together."""

    limbs: tuple[int, ...]
    """One, or two that are each other's counterpart; their numbers among those of the body."""
    name: str
    dofs: tuple[Int[np.ndarray, "_dof"], ...]
    """Of each limb."""
    blobs: tuple[Int[np.ndarray, "_blob"], ...]
    """Of each limb, from its root to its end."""

    @property
    def all_dofs(self) -> Int[np.ndarray, "_dof"]:
        """Of all its limbs."""
        return np.concatenate(self.dofs)

    @property
    def all_blobs(self) -> Int[np.ndarray, "_blob"]:
        """Of all its limbs."""
        return np.concatenate(self.blobs)


def units_of(body: Body) -> tuple[Unit, ...]:
    """The pairs of limbs of a body; where it has no sides, its limbs."""
    names, every_limb, blobs, groups = limb_names(body), limbs(body.skeleton), limb_blobs(body), limb_groups(body)
    pairs = [members for members in groups if len(members) == 2]
    return tuple(
        Unit(
            members,
            " and ".join(names[j] for j in members),
            tuple(every_limb[j] for j in members),
            tuple(np.flatnonzero(blobs[j]) for j in members),
        )
        for members in pairs or groups
    )


class UnitArrays(eqx.Module):
    """A unit as arrays, which have the shape of those of the body's other units."""

    index: PartIndex
    limbs: Bool[Array, "limb slot"]
    """Which of the unit's blobs are those of each limb; none where there is no second one."""
    ends: Int[Array, "limb 2"]
    """The first and the last blob of each limb."""
    outer: Float[Array, "slot"]
    """How far beyond the middle of its limb a blob is: 0 up to there, 1 at the end."""
    counterparts: Int[Array, "blob"]
    """The blob of the other side, or the same."""

    @classmethod
    def of(cls, body: Body, units: Sequence[Unit]) -> "list[UnitArrays]":
        """Each unit, padded to the largest."""
        parts = PartIndex.of([unit.all_dofs for unit in units], [unit.all_blobs for unit in units])
        counterparts, found = jnp.asarray(other_side(body.blobs.names)), []
        for k, unit in enumerate(units):
            index = jax.tree.map(lambda leaf, k=k: leaf[k], parts)
            slots, has_blob = np.asarray(index.blobs), np.asarray(index.blob_mask)
            of_limb, outer_part = np.zeros((2, len(slots)), bool), np.zeros(len(slots))
            for j, each in enumerate(unit.blobs):
                of_limb[j] = np.isin(slots, each) & has_blob
            ends = [[each[0], each[-1]] for each in (unit.blobs[0], unit.blobs[-1])]
            outer_part[: len(unit.all_blobs)] = np.concatenate([outer(len(each)) for each in unit.blobs])
            arrays = jnp.asarray(of_limb), jnp.asarray(ends), jnp.asarray(outer_part, body.blob_sigmas.dtype)
            found.append(cls(index, *arrays, counterparts))
        return found


def outer(count: int) -> Float[np.ndarray, "blob"]:
    """How far beyond the middle of a limb each of its blobs is, from root to end: 0 up to there, 1 at the end."""
    return np.maximum(np.linspace(-1.0, 1.0, count), 0.0) if count > 1 else np.ones(count)


CROSSED = 2
"""Where the way with exchanged ends is among those compared: the tracked one, then what looks like it."""


def look_alikes(body: Body, pose: Float[Array, "dof"], unit: UnitArrays) -> Float[Array, "5 dof"]:
    """What looks like a unit as it is held.

    Its limbs exchanged; their ends exchanged, with knees and elbows about where they are; each of them turned by a half
    from root to end; both turned.
    """
    means, index = body.posed_blobs(pose).means, unit.index
    here = means[index.blobs]
    turned = jax.vmap(lambda two: _half_turned(here, means[two[0]], means[two[1]]))(unit.ends)
    first, second = (jnp.where(each[:, None], moved, here) for each, moved in zip(unit.limbs, turned, strict=True))
    both = jnp.where(unit.limbs[1][:, None], second, first)
    exchanged = means[unit.counterparts[index.blobs]]
    crossed = here + unit.outer[:, None] * (exchanged - here)
    targets = jnp.stack([exchanged, crossed, first, second, both])
    return jax.vmap(lambda target: fitted_part(body, index, FIT_ITERATIONS, pose, target)[0])(targets)


def _half_turned(
    points: Float[Array, "point 3"], root: Float[Array, "3"], end: Float[Array, "3"]
) -> Float[Array, "point 3"]:
    """Points turned by a half about the line from a root to an end: a knee or elbow on the other side of it."""
    along = (end - root) / jnp.maximum(jnp.linalg.norm(end - root), 1e-6)
    off = points - root[None]
    return root[None] + 2.0 * jnp.sum(off * along[None], axis=-1, keepdims=True) * along[None] - off


def drawn_ways(
    body: Body, unit: Unit, pose: Float[np.ndarray, "dof"], turn: int, count: int = NUM_DRAWN
) -> Float[np.ndarray, "drawn dof"]:
    """Quasi-random ways to hold a unit: its first limb, its second, or both; within their limits, or nearby.

    Each `turn` draws others.
    """
    lower, upper = np.asarray(body.skeleton.dof_lower), np.asarray(body.skeleton.dof_upper)
    free = [dofs[(upper - lower)[dofs] > SMALL_RANGE] for dofs in unit.dofs]
    dofs = np.concatenate(free)
    shares = _quasi_random(count, turn, len(dofs))
    whole = lower[dofs] + shares * (upper - lower)[dofs]
    low, high = np.maximum(lower[dofs], pose[dofs] - NEARBY), np.minimum(upper[dofs], pose[dofs] + NEARBY)
    values = np.where(np.arange(count)[:, None] % 2 == 0, whole, low + shares * (high - low))
    found = np.tile(pose, (count, 1))
    which = (np.arange(count) // 2) % (2 ** len(unit.limbs) - 1)
    for k, of_limb in enumerate(free):
        rows = np.flatnonzero((which == k) | (which == 2))
        found[np.ix_(rows, of_limb)] = values[rows][:, np.isin(dofs, of_limb)]
    return found.astype(pose.dtype)


def _quasi_random(count: int, turn: int, dims: int) -> Float[np.ndarray, "count dims"]:
    """Points that fill a cube evenly (Roberts' R sequence); later turns fill its gaps."""
    root = 2.0
    for _ in range(30):
        root = (1.0 + root) ** (1.0 / (dims + 1))
    steps = (1.0 / root) ** np.arange(1, dims + 1)
    return np.mod(0.5 + (np.arange(count) + 1 + turn * count)[:, None] * steps[None], 1.0)
