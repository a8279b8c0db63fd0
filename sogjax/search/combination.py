"""Which optima of several actors go together: those that explain most of one frame, none in another one's place."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.model.body import Body
from sogjax.model.limbs import joint_limbs
from sogjax.quality.fitted import fitted_numbers
from sogjax.search.placed_body import means_of

MOST_COMBINED = 100_000
"""Combinations that are weighed; with more actors, each keeps fewer of its optima."""


@dataclass(frozen=True)
class Optima:
    """The different optima of one actor in a frame, and what each is worth where another actor is found."""

    alone: Float[np.ndarray, "optimum"]
    """Energies where nobody else is found."""
    given: Mapping[int, Float[np.ndarray, "optimum other"]]
    """Energies given each optimum of another actor (its index)."""
    inside: Mapping[int, Bool[np.ndarray, "optimum other"]]
    """Whether it is in the place of that optimum of the other one."""


@dataclass(frozen=True)
class Combination:
    """One optimum of each actor."""

    chosen: tuple[int, ...]
    energy: float
    """What all explain together."""
    shares: tuple[float, ...]
    """Of each actor: what is left for it beside the others, as a part of what the best of its optima is worth alone."""
    apart: bool
    """Whether nobody is in another one's place."""
    exchange: tuple[float, ...]
    """Of each actor: how far the next combination is behind in which it is in another one's place, as a part of the
    energy; 1 where there is none."""


def best_combination(actors: Sequence[Optima]) -> Combination:
    """The combination that explains most; one with two actors in one place only where there is no other."""
    rows = _combinations([len(actor.alone) for actor in actors])
    beside = np.stack([_beside(actors, rows, k) for k in range(len(actors))], axis=1)
    alone = np.stack([actor.alone[rows[:, k]] for k, actor in enumerate(actors)], axis=1)
    energies = 0.5 * (alone + beside).sum(axis=1)  # the mean over both orders in which two actors may be found
    inside = _inside(actors, rows)
    allowed = ~inside if not inside.all() else np.ones_like(inside)
    best = int(np.argmax(np.where(allowed, energies, -np.inf)))
    tops = [max(float(actor.alone.max()), 1e-6) for actor in actors]
    return Combination(
        chosen=tuple(rows[best].tolist()),
        energy=float(energies[best]),
        shares=tuple(float(value) / top for value, top in zip(beside[best], tops, strict=True)),
        apart=not bool(inside[best]),
        exchange=tuple(
            float(_behind(energies, best, allowed & _elsewhere(actors, rows, k, best))) for k in range(len(actors))
        ),
    )


def in_one_place(
    one: Body, poses: Float[np.ndarray, "one dof"], other: Body, others: Float[np.ndarray, "other dof"]
) -> Bool[np.ndarray, "one other"]:
    """Which poses of two bodies have their trunks in each other: who embraces somebody has 0.4 m between them."""
    middles = [_trunks(body, of_body) for body, of_body in ((one, poses), (other, others))]
    apart = np.linalg.norm(middles[0][:, None] - middles[1][None], axis=-1)
    return apart < fitted_numbers().verdict.inside


def trunk_blobs(body: Body) -> Bool[np.ndarray, "blob"]:
    """Which blobs belong to no limb."""
    trunk = joint_limbs(body.skeleton)[np.array(body.blobs.joints, int)] < 0
    return trunk if trunk.any() else np.ones_like(trunk)


def _trunks(body: Body, poses: Float[np.ndarray, "pose dof"]) -> Float[np.ndarray, "pose 3"]:
    return means_of(body, poses)[:, trunk_blobs(body)].mean(axis=1)


def _combinations(counts: Sequence[int]) -> Int[np.ndarray, "combination actor"]:
    counts = list(counts)
    while np.prod(counts, dtype=float) > MOST_COMBINED:
        counts = [max(count - 1, 1) for count in counts]
    return np.array(list(itertools.product(*(range(count) for count in counts))), int)


def _beside(actors: Sequence[Optima], rows: np.ndarray, k: int) -> Float[np.ndarray, "combination"]:
    """What actor k is worth given the others: with several of them, each takes its part away."""
    own = actors[k].alone[rows[:, k]]
    return own - sum(own - given[rows[:, k], rows[:, j]] for j, given in actors[k].given.items())


def _inside(actors: Sequence[Optima], rows: np.ndarray) -> Bool[np.ndarray, "combination"]:
    """Whether two are in one place."""
    found = np.zeros(len(rows), bool)
    for k, actor in enumerate(actors):
        for j, inside in actor.inside.items():
            found |= inside[rows[:, k], rows[:, j]]
    return found


def _elsewhere(actors: Sequence[Optima], rows: np.ndarray, k: int, best: int) -> Bool[np.ndarray, "combination"]:
    """Whether actor k is in the place that another one has in the best combination."""
    found = np.zeros(len(rows), bool)
    for j, inside in actors[k].inside.items():
        found |= inside[rows[:, k], rows[best, j]]
    return found


def _behind(energies: np.ndarray, best: int, others: Bool[np.ndarray, "combination"]) -> float:
    if not others.any():
        return 1.0
    return (energies[best] - energies[others].max()) / max(abs(energies[best]), 1e-6)
