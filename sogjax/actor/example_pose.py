"""The pose of an example picture set, from the masks alone: place, heading and named pose, then refined.

Front or back: what the silhouettes of one picture set hardly tell, several of them and their colours together do.
"""

from collections.abc import Iterable, Sequence
from itertools import product
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.actor.colors import ColoredView, blob_samples
from sogjax.energy.frame_energy import still_energy
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.model.body import Body
from sogjax.model.cores import in_threads
from sogjax.model.program import compiled
from sogjax.model.rotation import world_from_upright
from sogjax.search.placed_body import centred, headings, root_rotation, turned
from sogjax.solve.ascent import ConditionedAscent
from sogjax.solve.solution import Scales
from sogjax.tracking.solving import pose_scales

NUM_HEADINGS = 16
COARSE_ITERATIONS = 20
FINE_ITERATIONS = 80
NUM_FINE = 3
"""Candidates that are climbed to the end."""


def starts_at(
    body: Body, centre: Float[np.ndarray, "3"], up: str, named: Sequence[str]
) -> Float[Array, "heading named dof"]:
    """The named poses at every heading, with the body's centre at a point (metres, world)."""
    turns = np.stack([turned(body, body.poses[name], float(h), up) for h in headings(NUM_HEADINGS) for name in named])
    return jnp.asarray(centred(body, turns, centre)).reshape(NUM_HEADINGS, len(named), -1)


class Candidate(NamedTuple):
    """A pose that fits, and how well (Eq. 9)."""

    pose: Float[Array, "dof"]
    energy: float


def poses_from_silhouettes(
    body: Body, coarse: Views, fine: Views, starts: Float[Array, "heading named dof"], terms: Terms, up: str
) -> list[Candidate]:
    """The best pose by Eq. 9, and after it the best of those that face the other way, if any was tried.

    Every named pose is climbed from the heading that suits it best and from the opposite one, since silhouettes hardly
    tell front from back; the best few of each way are climbed to the end. A single start is climbed to the end at once.
    The silhouettes are `coarse` ones until then, of half as many blobs.
    """
    scales = pose_scales(body.skeleton)

    def climbed(poses: Iterable[Float[Array, "dof"]], views: Views, iterations: int) -> list[Candidate]:
        """Each by a thread of its own, but the first one, which compiles."""

        def candidate(pose: Float[Array, "dof"]) -> Candidate:
            found, energy = _refined(body, pose, views, terms, scales, jnp.asarray(iterations))
            return Candidate(found, float(energy))

        first, *others = poses
        return [candidate(first), *in_threads(candidate, others)]

    num_headings, num_named, num_dofs = starts.shape
    if num_headings * num_named == 1:
        return climbed(starts.reshape(1, num_dofs), fine, FINE_ITERATIONS)
    promise = _energies(body, starts.reshape(-1, num_dofs), coarse, terms).reshape(num_headings, num_named)
    heading = jnp.argmax(promise, axis=0)
    opposite = (heading + num_headings // 2) % num_headings
    named = jnp.arange(num_named)
    tried = jnp.concatenate([starts[heading, named], starts[opposite, named]])
    likely = sorted(climbed(tried, coarse, COARSE_ITERATIONS), key=lambda found: -found.energy)
    like = [np.dot(forward(body, found.pose, up), forward(body, likely[0].pose, up)) > 0.0 for found in likely]
    ways = [[found for found, same in zip(likely, like, strict=True) if same == way] for way in (True, False)]
    best = [
        max(climbed((found.pose for found in way[:NUM_FINE]), fine, FINE_ITERATIONS), key=lambda found: found.energy)
        for way in ways
        if way
    ]
    return sorted(best, key=lambda found: -found.energy)


def forward(body: Body, pose: Float[Array, "dof"], up: str) -> Float[np.ndarray, "3"]:
    """Where the body's trunk faces (world); `body` stands upright in a world of vertical `up`."""
    turn = root_rotation(body, pose) @ root_rotation(body, body.poses["rest"]).T
    return turn @ world_from_upright(up)[:, 0]


@compiled
def _energies(body: Body, poses: Array, views: Views, terms: Terms) -> Float[Array, "start"]:
    return jax.lax.map(lambda pose: still_energy(body, pose, views, terms), poses)


@compiled
def _refined(
    body: Body,
    start: Float[Array, "dof"],
    views: Views,
    terms: Terms,
    scales: Scales,
    max_iterations: Array,
) -> tuple[Float[Array, "dof"], Float[Array, ""]]:
    solver = ConditionedAscent(max_iterations=max_iterations)
    objective = lambda pose: still_energy(body, pose, views, terms)
    solution = solver.maximize(objective, start, scales)
    return solution.params, solution.value


SIDES = 4
"""Sides of the body that are told apart: front, left, back and right."""
FEWEST_SAMPLES = 6
"""Samples of a blob in one picture that it takes to say what colour it has on that side."""

COLOR_WEIGHT = 2.0
"""Weight of the squared deviation of colours against a share of the fit. Somebody seen back to front in one of five
moments loses 0.3 % of the fit, and colours then deviate by 0.0015 more."""

SideColors = Float[np.ndarray, "blob side 3"]
"""Colours (sRGB, 0..1) of every blob on every side; NaN where it is not seen."""


def side_colors(body: Body, views: Sequence[ColoredView], up: str) -> SideColors:
    """What the pictures of one moment show of every side of every blob."""
    sums, counts = np.zeros((body.num_blobs, SIDES, 3)), np.zeros((body.num_blobs, SIDES, 1))
    for view in views:
        sides = _sides(body, view, up)
        for blob, samples in enumerate(blob_samples(body, view)):
            if len(samples) >= FEWEST_SAMPLES:
                sums[blob, sides[blob]] += np.median(samples, axis=0)
                counts[blob, sides[blob]] += 1
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


def _sides(body: Body, view: ColoredView, up: str) -> np.ndarray:
    """Which side of each blob a camera sees."""
    pose, rest = view.pose, body.poses["rest"]
    frames, means = zip(*(map(np.asarray, _frames_and_means(body, p)) for p in (pose, rest)), strict=True)
    turns = [frame[:, :3, :3].astype(float) for frame in frames]
    of_joint = np.einsum("jab,jcb->jac", turns[1], turns[0])  # from the pose to the rest pose, by joint
    world = np.asarray(view.camera.camera_from_world, float)
    eye = -world[:3, :3].T @ world[:3, 3]
    towards = eye - means[0].astype(float)
    at_rest = np.einsum("bac,bc->ba", of_joint[np.asarray(body.blobs.joints)], towards) @ world_from_upright(up)
    azimuth = np.arctan2(at_rest[:, 1], at_rest[:, 0])
    return np.round(azimuth / (2.0 * np.pi / SIDES)).astype(int) % SIDES


@compiled
def _frames_and_means(
    body: Body, pose: Float[Array, "dof"]
) -> tuple[Float[Array, "joint 4 4"], Float[Array, "blob 3"]]:
    frames = body.skeleton.world_from_joint(pose)
    return frames, body.blobs.points_world(frames)


def consistent_ways(fits: Sequence[Sequence[float]], colors: Sequence[Sequence[SideColors]]) -> tuple[int, ...]:
    """Which of the ways to see each moment to believe: those that fit, and show the same colours on the same sides.

    Both `fits` and `colors` (what is then seen of the sides of the body) are by moment and way; of a fit only its ratio
    to the best one of its moment counts.
    """
    best = [max(ways) for ways in fits]

    def worth(chosen: tuple[int, ...]) -> float:
        fit = np.mean([ways[k] / most for ways, most, k in zip(fits, best, chosen, strict=True)])
        return float(fit) - COLOR_WEIGHT * disagreement([ways[k] for ways, k in zip(colors, chosen, strict=True)])

    return max(product(*(range(len(ways)) for ways in fits)), key=worth)


def disagreement(colors: Sequence[SideColors]) -> float:
    """Mean squared deviation of what several moments show of the same sides, from their mean."""
    stacked = np.stack(colors)
    seen = np.isfinite(stacked[..., 0])
    counts = seen.sum(axis=0)
    mean = np.nansum(stacked, axis=0) / np.maximum(counts, 1)[..., None]
    squares = np.where(seen[..., None], (stacked - mean) ** 2, 0.0).sum()
    return float(squares / max(seen.sum(), 1))
