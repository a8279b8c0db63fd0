"""The pose of the first frame without a hint: places, headings and named poses tried at once, the best refined."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.frame_energy import still_energy
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.model.body import Body
from sogjax.model.camera import Camera
from sogjax.model.skeleton import Skeleton
from sogjax.solve import ConditionedAscent, Scales
from sogjax.tracking.frame_views import FrameViews
from sogjax.tracking.initial_pose import body_centre, placed, root_position, shifts, turned
from sogjax.tracking.limbs import limbs, with_other_limb
from sogjax.tracking.place_search import Slices, best_places, possible_places, well_seen
from sogjax.tracking.scales import pose_scales

NUM_PLACES = 12
NUM_HEADINGS = 12
NUM_AT_PLACE, COARSE_ITERATIONS = 4, 25
"""Starts at each place that are climbed a little way in the coarse picture."""
NUM_MIDDLE, MIDDLE_ITERATIONS = 12, 50
"""Starts that are climbed in the middle one."""
NUM_FINE, FINE_ITERATIONS = 4, 120
"""Starts that are climbed to the end in the fine one."""
AT_ONCE = 4
"""Poses that are climbed in one call."""
LIMB_ITERATIONS = 25
"""For each pose in which one limb is tried another way."""
STRAIN_COST = 0.005
"""Share of the energy that each joint at the end of its range costs. Two legs of one colour may be exchanged with
hardly a difference in the pictures, but not without twisting the pelvis and the hips."""
STRAINED, NARROWEST = 0.7, 0.5
"""Part of a joint's range, from the rest pose, where strain begins; radians, the least range that is counted."""
DIFFERENT = 0.1
"""Metres, mean distance of the blobs: poses farther apart are different optima."""


@dataclass(frozen=True)
class FoundPose:
    """The best pose of a search and how far the next different one is behind."""

    pose: Float[Array, "dof"]
    energy: float
    margin: float
    """(energy - energy of the next different optimum) / energy, less what strains cost; 1 where there is no other."""


def search_pose(body: Body, frame: FrameViews, terms: Terms, up: str) -> FoundPose:
    """The pose of a body (upright in the world) that suits the pictures of one frame best."""
    coarse = frame.views(0, body)
    scales = pose_scales(body.skeleton)
    poses = _promising(body, _starts(body, coarse, terms, up), coarse, terms)
    energies = jnp.zeros(poses.shape[0])
    for level, keep, iterations in (
        (0, NUM_MIDDLE, COARSE_ITERATIONS),
        (1, NUM_FINE, MIDDLE_ITERATIONS),
        (2, NUM_FINE, FINE_ITERATIONS),
    ):
        views = coarse if level == 0 else frame.views(level, body, poses)
        poses, energies = _climbed(body, poses, views, terms, scales, iterations)
        energies = jnp.where(_well_seen(body, poses, views.cameras), energies, -jnp.inf)
        best = _different(body, poses, energies, keep)
        poses, energies = poses[best], energies[best]
    better = [_better_limbs(body, jnp.roll(poses, -k, axis=0), views, terms, scales) for k in range(len(poses))]
    poses, energies = (jnp.stack(parts) for parts in zip(*better, strict=True))
    likely = energies - STRAIN_COST * jnp.abs(energies) * jax.vmap(partial(strain, body.skeleton))(poses)
    best = _different(body, poses, likely, NUM_FINE)
    margin = 1.0 if len(best) < 2 else float((likely[best[0]] - likely[best[1]]) / jnp.abs(likely[best[0]]))
    return FoundPose(poses[best[0]], float(energies[best[0]]), margin)


def strain(skeleton: Skeleton, pose: Float[Array, "dof"]) -> Float[Array, ""]:
    """How many joints are near the end of their range: each counts from 0 at `STRAINED` of it to 1 at the end."""
    bound = jnp.where(pose < 0.0, -skeleton.dof_lower, skeleton.dof_upper)
    part = jnp.abs(pose) / jnp.maximum(bound, NARROWEST)
    return jnp.sum((jnp.clip(part - STRAINED, 0.0, 1.0 - STRAINED) / (1.0 - STRAINED)) ** 2)


def _better_limbs(
    body: Body, poses: Float[Array, "start dof"], views: Views, terms: Terms, scales: Scales
) -> tuple[Float[Array, "dof"], Float[Array, ""]]:
    """The first of some poses with each limb in turn tried as in the named poses and in the others, then climbed.

    A limb that lies before the trunk has an optimum of its own: what is right for the rest does not lead it out.
    """
    pose = poses[0]
    for limb in limbs(body.skeleton):
        variants = with_other_limb(body, pose, limb, poses[1:])
        climbed, energies = _climbed(body, variants, views, terms, scales, LIMB_ITERATIONS)
        pose = climbed[jnp.argmax(energies)]
    climbed, energies = _climbed(body, pose[None], views, terms, scales, FINE_ITERATIONS)
    return climbed[0], energies[0]


def search_poses(bodies: Sequence[Body], frame: FrameViews, terms: Terms, up: str) -> list[FoundPose]:
    """The poses of several bodies in one frame: the surest is found first, and what it covers is its own."""
    found: dict[int, FoundPose] = {}
    while len(found) < len(bodies):
        open_ones = [k for k in range(len(bodies)) if k not in found]
        candidates = {k: search_pose(bodies[k], frame, terms, up) for k in open_ones}
        surest = max(open_ones, key=lambda k: candidates[k].margin)
        found[surest] = candidates[surest]
        frame = frame.with_found(bodies[surest], found[surest].pose)
    return [found[k] for k in range(len(bodies))]


def _promising(
    body: Body, starts: Float[Array, "place start dof"], views: Views, terms: Terms
) -> Float[Array, "promising dof"]:
    """The best starts at each place: the best of all are often the same mistake many times."""
    energies = _energies(body, starts.reshape(-1, starts.shape[-1]), views, terms).reshape(starts.shape[:2])
    best = jnp.argsort(-energies, axis=1)[:, :NUM_AT_PLACE]
    return jnp.take_along_axis(starts, best[:, :, None], axis=1).reshape(-1, starts.shape[-1])


def _starts(body: Body, views: Views, terms: Terms, up: str) -> Float[Array, "place start dof"]:
    """Every named pose at every heading, at each of the most promising places."""
    root = root_position(body, body.poses["rest"])
    slices = Slices.from_body(body, root, up)
    places = best_places(slices, views, possible_places(views.cameras, up), terms, NUM_PLACES)
    headings = np.arange(NUM_HEADINGS) * 2.0 * np.pi / NUM_HEADINGS - np.pi
    standing = jnp.stack([placed(body, body.poses["rest"], place) for place in places])
    turned_poses = jnp.stack(
        [turned(body, pose, float(heading), up) for pose in body.poses.values() for heading in headings]
    )
    steps = _centres(body, standing)[:, None, :] - _centres(body, turned_poses)[None, :, :]
    moves = jnp.einsum("dk,psk->psd", shifts(body), steps, precision="highest")
    return turned_poses[None, :, :] + moves


@eqx.filter_jit
def _centres(body: Body, poses: Float[Array, "start dof"]) -> Float[Array, "start 3"]:
    return jax.vmap(lambda pose: body_centre(body, pose))(poses)


@eqx.filter_jit
def _energies(body: Body, poses: Array, views: Views, terms: Terms) -> Float[Array, "start"]:
    return jax.lax.map(lambda pose: still_energy(body, pose, views, terms), poses, batch_size=8)


def _climbed(
    body: Body, poses: Array, views: Views, terms: Terms, scales: Scales, iterations: int
) -> tuple[Float[Array, "start dof"], Float[Array, "start"]]:
    """Every pose climbed and its energy; always the same number at once, so that one program serves all."""
    count = poses.shape[0]
    padded = jnp.concatenate([poses, jnp.tile(poses[-1], (-count % AT_ONCE, 1))])
    parts = [
        _climbed_together(body, padded[k : k + AT_ONCE], views, terms, scales, jnp.asarray(iterations))
        for k in range(0, len(padded), AT_ONCE)
    ]
    climbed, energies = (jnp.concatenate(part)[:count] for part in zip(*parts, strict=True))
    return climbed, energies


@eqx.filter_jit
def _climbed_together(
    body: Body, poses: Array, views: Views, terms: Terms, scales: Scales, iterations: Int[Array, ""]
) -> tuple[Float[Array, "start dof"], Float[Array, "start"]]:
    solver = ConditionedAscent(max_iterations=iterations)

    def climb(pose: Float[Array, "dof"]) -> tuple[Array, Array]:
        solution = solver.maximize(lambda p: still_energy(body, p, views, terms), pose, scales)
        return solution.params, solution.value

    return jax.vmap(climb)(poses)


@eqx.filter_jit
def _well_seen(body: Body, poses: Array, cameras: Camera) -> Bool[Array, "start"]:
    return well_seen(cameras, _centres(body, poses))


def _different(body: Body, poses: Array, energies: Array, count: int) -> np.ndarray:
    """Which poses are the best `count` that lie `DIFFERENT` from each other, best first."""
    means = np.asarray(_means(body, poses))
    left, best = np.argsort(-np.asarray(energies)), []
    while len(left) and len(best) < count:
        best.append(left[0])
        distances = np.linalg.norm(means[left] - means[left[0]], axis=-1).mean(axis=1)
        left = left[distances >= DIFFERENT]
    return np.array(best)


@eqx.filter_jit
def _means(body: Body, poses: Array) -> Float[Array, "start blob 3"]:
    return jax.vmap(lambda pose: body.posed_blobs(pose).means)(poses)
