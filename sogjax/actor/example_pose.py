"""The pose of an example picture set, from the masks alone: place, heading and named pose, then refined."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.actor.facing import forward
from sogjax.energy.frame_energy import still_energy
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.model.body import Body
from sogjax.model.cores import in_threads
from sogjax.model.program import compiled
from sogjax.search.placed_body import centred, headings, turned
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
    facing = forward(body, [found.pose for found in likely], up)
    like = (facing @ facing[0] > 0.0).tolist()
    ways = [[found for found, same in zip(likely, like, strict=True) if same == way] for way in (True, False)]
    best = [
        max(climbed((found.pose for found in way[:NUM_FINE]), fine, FINE_ITERATIONS), key=lambda found: found.energy)
        for way in ways
        if way
    ]
    return sorted(best, key=lambda found: -found.energy)


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
