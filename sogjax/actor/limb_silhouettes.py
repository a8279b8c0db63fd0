"""Limbs of an example pose, searched by its masks: ways to hold each are drawn, and the best compared in pairs.

Poses are compared by the edges of their silhouettes. Eq. 9 does not ask that all of a mask is covered: an arm that
hides in the trunk costs it nothing.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from sogjax.actor.coverage import Silhouettes, mismatch_of, times_cap
from sogjax.energy.part_energy import PartIndex
from sogjax.energy.priors import limit_penalty
from sogjax.model.batches import THREADS, of_each, shared_out
from sogjax.model.body import Body, concatenate
from sogjax.model.limbs import limb_blobs
from sogjax.model.program import compiled
from sogjax.model.solid import Solid, impossibilities
from sogjax.search.limb_ways import Unit, UnitArrays, drawn_ways, units_of
from sogjax.search.search_energy import from_rest
from sogjax.solve.ascent import ConditionedAscent
from sogjax.solve.solution import Scales
from sogjax.tracking.solving import pose_scales

NUM_DRAWN, NUM_KEPT = 512, 16
"""Ways to hold a limb that are drawn, and those of them that are compared together with those of its counterpart."""
APART = 0.25
"""Radians, in some joint, by which ways that are kept differ."""

ITERATIONS = 15
"""Steps by which each of them is climbed."""
AT_ONCE, CHECKED_AT_ONCE = 16, 128
"""Ways that are compared in one step, and that are checked in one step for being possible."""

LEAST_GAIN = 0.05
"""Part of its cost by which another way to hold a unit must be better: masks are not that exact."""
REST = 0.003
"""What being at the end of a joint's range costs beside the mismatch, which is 0.1 to 0.2: of two ways that cover the
masks alike, the one that twists less is more likely."""

PoseAndMiss = tuple[Float[np.ndarray, "dof"], float]
"""A pose, and its mismatch."""


@dataclass(frozen=True)
class Everybody:
    """All bodies as one, of which one after the other is searched."""

    bodies: tuple[Body, ...]
    whole: Body
    solid: Solid

    @classmethod
    def of(cls, bodies: Sequence[Body]) -> "Everybody":
        """Some bodies, or one."""
        whole = concatenate(bodies)
        return cls(tuple(bodies), whole, Solid.of(whole))

    def blobs(self, number: int) -> Int[np.ndarray, "_blob"]:
        """Those of one body among the blobs of all."""
        ends = np.cumsum([0, *(body.num_blobs for body in self.bodies)])
        return np.arange(ends[number], ends[number + 1])

    def impossibility(
        self,
        number: int,
        ways: Float[np.ndarray, "way dof"],
        poses: Sequence[Float[np.ndarray, "dof"]],
        moved: Int[np.ndarray, "_blob"],
        unsure: Int[np.ndarray, "_blob"],
    ) -> Float[np.ndarray, "way"]:
        """How impossible ways to hold some blobs of one of the bodies are, 0 to 1, given the poses of all.

        The limbs of the others, and some blobs of its own, may be anywhere.
        """
        own = self.blobs(number)
        others = np.setdiff1d(np.flatnonzero(limb_blobs(self.whole).any(axis=0)), own)
        held = [ways if k == number else np.tile(pose, (len(ways), 1)) for k, pose in enumerate(poses)]
        solid = self.solid.about(own[moved]).regardless_of(np.append(others, own[unsure]))
        return np.asarray(impossibilities(solid, self.whole, jnp.asarray(np.concatenate(held, axis=1))))


def with_limbs_found(
    everybody: Everybody, number: int, poses: Sequence[Float[np.ndarray, "dof"]], silhouettes: Silhouettes, turn: int
) -> Float[np.ndarray, "dof"]:
    """The pose of one body, its limbs held as they cover the masks best, one pair after the other.

    The `silhouettes` are what the others leave of the masks; each `turn` draws other ways.
    """
    body, pose = everybody.bodies[number], poses[number]
    units = units_of(body)
    if not units:
        return pose
    singles = [_limbs_of(unit) for unit in units]
    arrays = iter(UnitArrays.of(body, [single for of_unit in singles for single in of_unit]))
    for unit, pair, of_limbs in zip(units, UnitArrays.of(body, units), singles, strict=True):
        now = [pose if k == number else other for k, other in enumerate(poses)]
        seen = _SeenUnit(everybody, number, now, silhouettes, turn, unit)
        pose = seen.found(pair.index, [(limb, next(arrays).index) for limb in of_limbs])
    return pose


def _limbs_of(unit: Unit) -> list[Unit]:
    """Each limb of a unit alone."""
    parts = zip(unit.limbs, unit.dofs, unit.blobs, strict=True)
    return [Unit((limb,), unit.name, (dofs,), (blobs,)) for limb, dofs, blobs in parts]


@dataclass(frozen=True)
class _SeenUnit:
    """A unit of limbs that is searched in one example pose."""

    everybody: Everybody
    number: int
    poses: Sequence[Float[np.ndarray, "dof"]]
    silhouettes: Silhouettes
    turn: int
    unit: Unit

    @property
    def body(self) -> Body:
        """Whose unit it is."""
        return self.everybody.bodies[self.number]

    @property
    def pose(self) -> Float[np.ndarray, "dof"]:
        """Its pose until now."""
        return self.poses[self.number]

    def found(self, pair: PartIndex, limbs: Sequence[tuple[Unit, PartIndex]]) -> Float[np.ndarray, "dof"]:
        """The pose with the unit held as it covers the masks best."""
        rest = _rest_covered(self.body, jnp.asarray(self.pose), pair, self.silhouettes)
        ways, covered = zip(*(self._best_ways(limb, part, rest) for limb, part in limbs), strict=True)
        rows = np.indices([len(of_limb) for of_limb in ways]).reshape(len(ways), -1)
        held = np.tile(self.pose, (rows.shape[1], 1))
        for of_limb, row, (limb, _) in zip(ways, rows, limbs, strict=True):
            held[:, limb.all_dofs] = of_limb[row][:, limb.all_dofs]
        together = sum(fills[row] for fills, row in zip(covered, rows, strict=True))
        least = lambda cost: [0, int(np.argmin(cost))]
        (_, best), cost = self._chosen(held, rest, jnp.asarray(together), self.unit.all_blobs, least)
        return held[best] if cost[best] < (1.0 - LEAST_GAIN) * cost[0] else self.pose

    def _best_ways(
        self, limb: Unit, part: PartIndex, rest: Float[Array, "camera cell"]
    ) -> tuple[Float[np.ndarray, "way dof"], Float[np.ndarray, "way camera cell"]]:
        """Different ways to hold one limb, the best that are drawn, and what they cover; first as it is held.

        Its counterpart may be anywhere.
        """
        drawn = drawn_ways(self.body, limb, self.pose, self.turn, NUM_DRAWN)
        drawn[0] = self.pose
        fills = _part_covered(self.body, jnp.asarray(drawn), part, self.silhouettes)
        different = lambda cost: _different(drawn[:, limb.all_dofs], cost)
        kept, _ = self._chosen(drawn, rest, fills, limb.all_blobs, different)
        given = (self.body, part, rest, self.silhouettes, pose_scales(self.body.skeleton))
        climbed = shared_out(lambda count, poses: (_climbed(count, poses, *given),), NUM_KEPT // THREADS, drawn[kept])
        ways = np.resize(climbed[0], (NUM_KEPT, len(self.pose)))
        ways[0] = self.pose
        return ways, np.asarray(_part_covered(self.body, jnp.asarray(ways), part, self.silhouettes))

    def _chosen(
        self,
        ways: Float[np.ndarray, "way dof"],
        rest: Float[Array, "camera cell"],
        fills: Float[Array, "way camera cell"],
        moved: Int[np.ndarray, "_blob"],
        choose: Callable[[Float[np.ndarray, "way"]], list[int]],
    ) -> tuple[list[int], Float[np.ndarray, "way"]]:
        """Which ways are chosen by their costs, and these.

        A cost is the mismatch of the body held so, with `REST`, up to twice as much where that is impossible. What is
        possible is checked in steps, the first way and those that fit best before others, until none of the others can
        cost as little as those that are chosen; these cost infinity. Blobs of the unit that are not `moved` may be
        anywhere. `choose` returns 0, for the first way, and then what costs least.
        """
        unsure = np.setdiff1d(self.unit.all_blobs, moved)
        twisted = np.asarray(_from_rest(self.body, jnp.asarray(ways)))
        mismatches = np.asarray(_mismatches(rest, fills, self.silhouettes)) + REST * twisted
        coming = np.append(0, 1 + np.argsort(mismatches[1:], kind="stable"))
        costs = np.full(len(ways), np.inf)
        while True:
            these, coming = np.split(coming, [CHECKED_AT_ONCE])
            impossible = self.everybody.impossibility(self.number, ways[these], self.poses, moved, unsure)
            costs[these] = mismatches[these] * (1.0 + impossible)
            chosen = choose(costs)
            if not len(coming) or costs[chosen[1:]].max(initial=0.0) <= mismatches[coming[0]]:
                return chosen, costs


def _different(angles: Float[np.ndarray, "way param"], cost: Float[np.ndarray, "way"]) -> list[int]:
    """The first way, and the best that differ from all better ones."""
    kept = [0]
    for k in np.argsort(cost, kind="stable").tolist():
        if len(kept) == NUM_KEPT:
            break
        if np.abs(angles[kept] - angles[k]).max(axis=1).min() > APART:
            kept.append(k)
    return kept


@compiled
def _rest_covered(
    body: Body, pose: Float[Array, "dof"], part: PartIndex, silhouettes: Silhouettes
) -> Float[Array, "camera cell"]:
    """How often all but a part of the body fills the cap of each cell."""
    return times_cap(part.rest_of(body.posed_blobs(pose)), silhouettes)


@compiled
def _part_covered(
    body: Body, poses: Float[Array, "way dof"], part: PartIndex, silhouettes: Silhouettes
) -> Float[Array, "way camera cell"]:
    """How often a part of the body fills it, in each pose."""
    covered = lambda pose: times_cap(part.blobs_of(body.posed_blobs(pose)), silhouettes)
    return jax.lax.map(covered, poses, batch_size=AT_ONCE)


@compiled
def _from_rest(body: Body, poses: Float[Array, "way dof"]) -> Float[Array, "way"]:
    return jax.vmap(lambda pose: from_rest(body.skeleton, pose))(poses)


@compiled
def _climbed(
    count: Int[Array, ""],
    poses: Float[Array, "way dof"],
    body: Body,
    part: PartIndex,
    rest: Float[Array, "camera cell"],
    silhouettes: Silhouettes,
    scales: Scales,
) -> Float[Array, "way dof"]:
    """The first `count` poses, in each of which a part is climbed to where it covers the masks better."""
    lower, upper = body.skeleton.joint_limits()
    solver = ConditionedAscent(max_iterations=jnp.asarray(ITERATIONS))

    def climbed(pose: Float[Array, "dof"]) -> Float[Array, "dof"]:
        def objective(params: Float[Array, "param"]) -> Float[Array, ""]:
            held = part.put(pose, params)
            covered = times_cap(part.blobs_of(body.posed_blobs(held)), silhouettes)
            beyond = limit_penalty(body.skeleton.joint_params(held), lower, upper)
            return -mismatch_of(rest + covered, silhouettes) - REST * from_rest(body.skeleton, held) - beyond

        found = solver.maximize(objective, part.params(pose), replace(scales, kinds=scales.kinds[part.dofs]))
        return part.put(pose, found.params)

    return of_each(climbed, poses, count=count)


@compiled
def _mismatches(
    rest: Float[Array, "camera cell"], parts: Float[Array, "way camera cell"], silhouettes: Silhouettes
) -> Float[Array, "way"]:
    """The mismatch of the body, each part with the rest."""
    return jax.lax.map(lambda part: mismatch_of(rest + part, silhouettes), parts, batch_size=AT_ONCE)
