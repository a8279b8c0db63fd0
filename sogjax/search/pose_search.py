"""The pose of a body in one frame without a hint: places, turns and named poses tried at once, the best refined."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from sogjax.energy.appearance import ColorWindows
from sogjax.energy.term import Term
from sogjax.model.body import Body
from sogjax.model.farthest import farthest
from sogjax.model.limbs import limbs, with_other_limb
from sogjax.model.program import compiled
from sogjax.model.rotation import axis_vector
from sogjax.scene.color_clusters import ColorClusters
from sogjax.search.mirrored import look_alikes
from sogjax.search.placed_body import centred, centres_of, headings, means_of, turned_to, turns_with_vertical
from sogjax.search.places import APART, Place, places
from sogjax.search.search_energy import LARGEST_ANGLE, LARGEST_TRANSLATION, SearchEnergy, climbed, scores
from sogjax.search.seen_frame import SeenFrame
from sogjax.solve.solution import Scales
from sogjax.tracking.solving import pose_scales

NUM_PLACES = 4
NUM_HEADINGS = 12
BODY_RADIUS = 1.15
"""Metres around a place at which pictures are looked at."""
UPRIGHT = 0.8
"""Cosine of the angle between a body's longest direction and the vertical above which it is not lying."""
SLENDER = 1.5
"""A body less slender says nothing of its direction."""
NUM_AT_PLACE, FIRST_ITERATIONS = (16, 8, 4, 4), 8
"""Starts that are climbed a little way: at the best place, the next and so on; actors share those of the first two."""
NUM_SECOND, SECOND_ITERATIONS = 6, 10
"""Those of them whose limbs are tried another way, and how far these are climbed."""
NUM_LAST, LAST_ITERATIONS = 4, 25
FEW_CAMERAS = 6
"""Cameras that many poses are compared in, before the best are in all."""
LIMBS_TRIED = (3, 1)
"""Ways to hold a limb that are climbed, of all that are scored: of the best pose, of each other."""
NUM_DRAWN = 16
"""Ways to hold a limb that are drawn at random, beside those of the named poses."""
LIMB_APART = 0.01
"""`DIFFERENT`, for poses that differ in one limb."""
DIFFERENT = 0.1
"""Metres, mean distance of the blobs: poses farther apart are different optima."""

Report = Callable[[float], None]
"""Called with the share of some work that is done, 0 to 1."""
Told = Callable[[Sequence[Place]], object]
"""Is told of the places that look like a body, before poses are searched for there."""


@dataclass(frozen=True)
class Optimum:
    """A pose that nothing near is better than."""

    pose: Float[np.ndarray, "dof"]
    energy: float


@dataclass(frozen=True)
class PoseSearch:
    """What a search for one body needs beside the frame."""

    body: Body
    clusters: ColorClusters
    terms: Sequence[Term]
    up: str
    among: int = 1
    """How many actors there are."""

    @classmethod
    def of_body(cls, body: Body, terms: Sequence[Term], up: str, among: int = 1) -> "PoseSearch":
        """The search for a body in its colours, which is one of so many actors."""
        return cls(body, ColorClusters.from_body(body), terms, up, among)

    @property
    def scales(self) -> Scales:
        """Bounds on the steps of climbs."""
        return pose_scales(self.body.skeleton, largest_angle=LARGEST_ANGLE, largest_translation=LARGEST_TRANSLATION)

    def energy(self, frame: SeenFrame) -> SearchEnergy:
        """The energy of poses in a frame."""
        return SearchEnergy.from_terms(self.body, frame.cameras, self.terms, self.clusters)


def unreported(share: float) -> None:
    """Nobody asks how far a search is."""


def untold(found: Sequence[Place]) -> None:
    """Nobody asks where something looks like a body."""


def search(
    searcher: PoseSearch, frame: SeenFrame, count: int = NUM_LAST, report: Report = unreported, told: Told = untold
) -> list[Optimum]:
    """The best different poses of a body in one frame, best first; none, if nothing looks like it.

    What looks like the best is among them; of several actors that is asked once it is known where the others are.
    `report` is called with the share of the work that is done.
    """
    found = places(frame, searcher.up, NUM_PLACES, searcher.among)
    if not found:
        return []
    told(found)
    placed = PlacedSearch.of_places(searcher, frame, np.stack([place.centre for place in found]))
    tried = _starts(searcher, found)
    with ThreadPoolExecutor(1) as beside:
        beside.submit(placed.climbed, tried[np.arange(1)], 0)  # what climbs is compiled meanwhile
        scored = placed.glance.scored(tried)
        tried = placed.glance.climbed(_spread_best(searcher, scored), FIRST_ITERATIONS)
    tried = _best(searcher, tried, NUM_SECOND)
    report(0.3)
    for level, share in ((placed.glance, 0.5), (placed, 0.85)):
        tried = _best(searcher, with_better_limbs(level, tried), NUM_LAST)
        report(share)
    tried = placed.climbed(tried, LAST_ITERATIONS) if searcher.among > 1 else with_look_alikes(placed, tried)
    report(1.0)
    best = _best(searcher, tried, count)
    return [Optimum(pose, float(value)) for pose, value in zip(best.poses, best.values, strict=True)]


def compile_pose_search(searcher: PoseSearch, frame: SeenFrame) -> None:
    """Compile beforehand what a search needs, while other work goes on; only shapes count of body and frame."""
    placed = PlacedSearch.of_places(searcher, frame, np.zeros((1, 3)))
    rest = Hypotheses(np.asarray(searcher.body.poses["rest"])[None], np.zeros(1, int), np.zeros(1))
    placed.scored(rest)
    placed.climbed(rest, 0)


@dataclass(frozen=True)
class Hypotheses:
    """Poses that were tried, where, and their energies."""

    poses: Float[np.ndarray, "start dof"]
    where: Int[np.ndarray, "start"]
    """The number of the place."""
    values: Float[np.ndarray, "start"]

    def __getitem__(self, chosen: np.ndarray) -> "Hypotheses":
        """The chosen ones."""
        return Hypotheses(self.poses[chosen], self.where[chosen], self.values[chosen])

    @classmethod
    def of(cls, parts: Sequence["Hypotheses"]) -> "Hypotheses":
        """The hypotheses of several sets together."""
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("poses", "where", "values")))


@dataclass(frozen=True)
class PlacedSearch:
    """A search at some places of one frame."""

    searcher: PoseSearch
    energy: SearchEnergy
    windows: ColorWindows

    @classmethod
    def of_places(cls, searcher: PoseSearch, frame: SeenFrame, centres: Float[np.ndarray, "place 3"]) -> "PlacedSearch":
        """The search at places, padded to always the same number, so that one program serves all."""
        padded = np.pad(centres, ((0, NUM_PLACES - len(centres)), (0, 0)), mode="edge")
        return cls(searcher, searcher.energy(frame), _windows(frame, jnp.asarray(padded, frame.odds.dtype)))

    @cached_property
    def glance(self) -> "PlacedSearch":
        """The same as few of the cameras see it, those farthest apart; its energies are compared with each other only.

        Of the cameras that see anything of the places, if these are enough; itself, if it has no more than those.
        Larger cells instead would lose arms, which are as thin as a cell.
        """
        cameras = np.asarray(self.energy.cameras.camera_from_world)
        if len(cameras) <= FEW_CAMERAS:
            return self
        seeing = np.flatnonzero(np.asarray(jnp.any(self.windows.odds != 0.0, axis=(0, 2, 3, 4))))
        seeing = seeing if len(seeing) >= FEW_CAMERAS else np.arange(len(cameras))
        centres = -np.einsum("cji,cj->ci", cameras[:, :3, :3], cameras[:, :3, 3])
        chosen = seeing[farthest(centres[seeing], FEW_CAMERAS)]
        counted = jnp.asarray(np.isin(np.arange(len(cameras)), chosen))
        return replace(self, energy=eqx.tree_at(lambda energy: energy.counted, self.energy, counted))

    def scored(self, tried: Hypotheses) -> Hypotheses:
        """The hypotheses with their energies."""
        return Hypotheses(tried.poses, tried.where, scores(self.energy, self.windows, tried.where, tried.poses))

    def climbed(self, tried: Hypotheses, iterations: int) -> Hypotheses:
        """The tops of the hills that they are on, as far as so many iterations lead."""
        scales = self.searcher.scales
        poses, values = climbed(self.energy, self.windows, tried.where, tried.poses, scales, iterations)
        return Hypotheses(poses, tried.where, values)


def _starts(searcher: PoseSearch, found: Sequence[Place]) -> Hypotheses:
    """Every named pose in every direction at every place."""
    body, up = searcher.body, axis_vector(searcher.up)
    named = [np.asarray(pose) for pose in body.poses.values()]
    upright = turned_to(body, named, headings(NUM_HEADINGS), searcher.up)
    parts = []
    for k, place in enumerate(found):
        directions = _other_verticals(place, up)
        lying = [turns_with_vertical(body, named, up, direction) for direction in directions]
        poses = centred(body, np.concatenate([upright, *lying]), place.centre)
        parts.append(Hypotheses(poses, np.full(len(poses), k), np.zeros(len(poses))))
    return Hypotheses.of(parts)


def _other_verticals(place: Place, up: Float[np.ndarray, "3"]) -> list[Float[np.ndarray, "3"]]:
    """In which directions the body's vertical may point there, beside upwards."""
    along = place.axis if place.axis @ up > 0.0 else -place.axis
    lying = place.slenderness > SLENDER and along @ up < UPRIGHT
    return [along, -along] if lying else [-up]


@compiled
def _windows(frame: SeenFrame, centres: Float[Array, "place 3"]) -> ColorWindows:
    radius = jnp.asarray(BODY_RADIUS, centres.dtype)
    return jax.lax.map(lambda centre: frame.windows(centre, radius), centres)


def with_better_limbs(placed: PlacedSearch, tried: Hypotheses) -> Hypotheses:
    """The poses, and each with one limb held in other ways, climbed if that looks promising."""
    body, variants, source = placed.searcher.body, [], []
    every_limb = limbs(body.skeleton)
    if not every_limb:
        return tried
    for k, pose in enumerate(tried.poses):
        for j, limb in enumerate(every_limb):
            others = np.concatenate([tried.poses, _drawn(body, limb, NUM_DRAWN)])
            variants.append(with_other_limb(body, pose, limb, others)[1:])
            source += [(k, j)] * len(variants[-1])
    of_pose, of_limb = np.array(source).T
    scored = placed.glance.scored(Hypotheses(np.concatenate(variants), tried.where[of_pose], np.zeros(len(of_pose))))
    chosen = []
    for k, j in sorted(set(source)):
        here = np.flatnonzero((of_pose == k) & (of_limb == j))
        here = here[np.argsort(-scored.values[here])]
        chosen.extend(
            here[different(body, scored.poses[here], scored.values[here], LIMBS_TRIED[min(k, 1)], LIMB_APART)]
        )
    return placed.climbed(Hypotheses.of([tried, scored[np.array(chosen)]]), SECOND_ITERATIONS)


def _drawn(body: Body, limb: Int[np.ndarray, "limb"], count: int) -> Float[np.ndarray, "start dof"]:
    """Poses with a limb held at random within its limits."""
    lower, upper = np.asarray(body.skeleton.dof_lower), np.asarray(body.skeleton.dof_upper)
    poses = np.zeros((count, len(lower)), np.float32)
    poses[:, limb] = np.random.default_rng(0).uniform(lower[limb], upper[limb], (count, len(limb)))
    return poses


def with_look_alikes(placed: PlacedSearch, tried: Hypotheses) -> Hypotheses:
    """The poses, and what looks like the best of them, climbed."""
    best = int(np.argmax(tried.values))
    others = look_alikes(placed.searcher.body, tried.poses[best])
    alike = Hypotheses(others, np.full(len(others), tried.where[best]), np.zeros(len(others)))
    return placed.climbed(Hypotheses.of([tried, alike]), LAST_ITERATIONS)


def _spread_best(searcher: PoseSearch, tried: Hypotheses) -> Hypotheses:
    """The best at each place, not too many of them nearly the same; more at the better places."""
    counts, chosen = np.array(NUM_AT_PLACE), []
    shared = min(searcher.among, len(counts))
    counts[:shared] = np.ceil(counts[:shared].mean())
    for place, count in zip(np.unique(tried.where), counts.tolist(), strict=False):
        here = tried[tried.where == place]
        likely = here[np.argsort(-here.values)[: 8 * count]]
        chosen.append(likely[different(searcher.body, likely.poses, likely.values, count)])
    return Hypotheses.of(chosen)


def _best(searcher: PoseSearch, tried: Hypotheses, count: int) -> Hypotheses:
    """The best different ones, best first.

    Of several actors each may fit best in another one's place: then no more than its share of them is in one place,
    so that what explains everybody is among them.
    """
    body, most = searcher.body, -(-count // searcher.among)
    order = different(body, tried.poses, tried.values, len(tried.values) if searcher.among > 1 else count)
    centres = centres_of(body, tried.poses[order])
    near = np.linalg.norm(centres[:, None] - centres[None], axis=-1) < APART
    kept = list[int]()
    for k in range(len(order)):
        if near[k, kept].sum() < most and len(kept) < count:
            kept.append(k)
    return tried[order[np.array(kept, int)]]


def different(
    body: Body, poses: np.ndarray, values: np.ndarray, count: int, apart: float = DIFFERENT
) -> Int[np.ndarray, "best"]:
    """Which poses are the best `count` that lie so far (metres) from each other, best first."""
    means = means_of(body, poses)
    left, best = np.argsort(-values), []
    left = left[np.isfinite(values[left])]
    while len(left) and len(best) < count:
        best.append(left[0])
        distances = np.linalg.norm(means[left] - means[left[0]], axis=-1).mean(axis=1)
        left = left[distances >= apart]
    return np.array(best, int)
