"""The pose of an example picture set, from the masks alone: place, heading and named pose, then refined."""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.energy.frame_energy import still_energy
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.model.body import Body
from sogjax.model.frames import world_from_upright
from sogjax.solve import ConditionedAscent, Scales
from sogjax.tracking.initial_pose import centred, root_rotation, turned
from sogjax.tracking.scales import pose_scales

NUM_HEADINGS = 16
COARSE_ITERATIONS = 40
FINE_ITERATIONS = 80
NUM_FINE = 3
"""Candidates that are climbed to the end."""


def starts_at(
    body: Body, centre: Float[np.ndarray, "3"], up: str, named: Sequence[str]
) -> Float[Array, "heading named dof"]:
    """The named poses at every heading, with the body's centre at a point (metres, world)."""
    headings = np.arange(NUM_HEADINGS) * 2.0 * np.pi / NUM_HEADINGS - np.pi
    return jnp.stack(
        [
            jnp.stack([centred(body, turned(body, body.poses[name], float(h), up), centre) for name in named])
            for h in headings
        ]
    )


class Candidate(NamedTuple):
    """A pose that fits, and how well (Eq. 9)."""

    pose: Float[Array, "dof"]
    energy: float


def poses_from_silhouettes(
    body: Body, views: Views, starts: Float[Array, "heading named dof"], terms: Terms, up: str
) -> list[Candidate]:
    """The best pose by Eq. 9, and after it the best of those that face the other way, if any was tried.

    Every named pose is climbed from the heading that suits it best and from the opposite one, since silhouettes hardly
    tell front from back; the best few of each way are climbed to the end. A single start is climbed to the end at once.
    """
    scales = pose_scales(body.skeleton)
    refined = lambda pose, iterations: _refined(body, pose, views, terms, scales, jnp.asarray(iterations))
    candidate = lambda pose, iterations: Candidate((found := refined(pose, iterations))[0], float(found[1]))
    num_headings, num_named, num_dofs = starts.shape
    if num_headings * num_named == 1:
        return [candidate(starts.reshape(num_dofs), FINE_ITERATIONS)]
    promise = _energies(body, starts.reshape(-1, num_dofs), views, terms).reshape(num_headings, num_named)
    heading = jnp.argmax(promise, axis=0)
    opposite = (heading + num_headings // 2) % num_headings
    named = jnp.arange(num_named)
    tried = jnp.concatenate([starts[heading, named], starts[opposite, named]])
    coarse = sorted((candidate(pose, COARSE_ITERATIONS) for pose in tried), key=lambda found: -found.energy)
    like = [np.dot(forward(body, found.pose, up), forward(body, coarse[0].pose, up)) > 0.0 for found in coarse]
    ways = [[found for found, same in zip(coarse, like, strict=True) if same == way] for way in (True, False)]
    best = [
        max((candidate(found.pose, FINE_ITERATIONS) for found in way[:NUM_FINE]), key=lambda c: c.energy)
        for way in ways
        if way
    ]
    return sorted(best, key=lambda found: -found.energy)


def forward(body: Body, pose: Float[Array, "dof"], up: str) -> Float[np.ndarray, "3"]:
    """Where the body's trunk faces (world); `body` stands upright in a world of vertical `up`."""
    turn = root_rotation(body, pose) @ root_rotation(body, body.poses["rest"]).T
    return turn @ world_from_upright(up)[:, 0]


@eqx.filter_jit
def _energies(body: Body, poses: Array, views: Views, terms: Terms) -> Float[Array, "start"]:
    return jax.lax.map(lambda pose: still_energy(body, pose, views, terms), poses)


@eqx.filter_jit
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
