"""Poses that look alike: back to front, or with limbs exchanged; and poses whose blobs lie near some points."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from sogjax.energy.part_energy import PartIndex
from sogjax.model.body import Body
from sogjax.model.limbs import limb_blobs, limbs
from sogjax.model.program import compiled
from sogjax.search.placed_body import means_of
from sogjax.solve.linear import solve_positive

SIDES = (("left", "right"), ("Left", "Right"), ("l_", "r_"), ("L_", "R_"))
"""Beginnings or parts of names that tell the two sides."""
ITERATIONS = 30
POSE_SPREAD = 0.05
"""Metres that a radian from the start counts as, in a fit to points."""


def other_side(names: tuple[str, ...]) -> Int[np.ndarray, "name"]:
    """The index of each name's counterpart on the other side; its own, where there is none."""
    index = {name: k for k, name in enumerate(names)}
    return np.array([index.get(_exchanged(name), k) for k, name in enumerate(names)], int)


def _exchanged(name: str) -> str:
    for left, right in SIDES:
        if left in name:
            return name.replace(left, right)
        if right in name:
            return name.replace(right, left)
    return name


def look_alikes(body: Body, pose: Float[np.ndarray, "dof"]) -> Float[np.ndarray, "other dof"]:
    """Poses whose silhouettes are nearly that of a pose.

    Half turned with the sides exchanged; then for each of the `limb_pairs`, with it exchanged, and with all but it.
    """
    blobs = other_side(body.blobs.names)
    means = means_of(body, pose[None])[0]
    if np.all(blobs == np.arange(len(blobs))):
        return pose[None][:0]
    exchanged = [np.arange(len(blobs))]
    for pair in limb_pairs(body):
        exchanged += [pair, np.setdiff1d(np.arange(len(blobs)), pair)]
    targets = np.repeat(means[None], len(exchanged), axis=0)
    for target, which in zip(targets, exchanged, strict=True):
        target[which] = means[blobs[which]]
    starts = np.stack([pose, pose[other_side(body.skeleton.dof_names)]])
    fitted, costs = fitted_to_blobs(
        body, jnp.asarray(np.tile(starts, (len(targets), 1))), jnp.asarray(np.repeat(targets, 2, axis=0))
    )
    better = np.asarray(costs).reshape(-1, 2).argmin(axis=1)
    return np.asarray(fitted).reshape(-1, 2, len(pose))[np.arange(len(better)), better]


def sides_apart(body: Body, poses: Float[np.ndarray, "start dof"]) -> Float[np.ndarray, "start"]:
    """How far the limbs of a pair are from each other, as a part of the least that they are in any named pose.

    Mean distance of a limb's blobs from those of its counterpart, of the pair for which that is least; infinite for a
    body without sides.
    """
    others, pairs = other_side(body.blobs.names), limb_pairs(body)
    if not pairs:
        return np.full(len(poses), np.inf)
    named = means_of(body, np.stack([np.asarray(pose) for pose in body.poses.values()]))
    between = lambda means: np.stack(
        [np.linalg.norm(means[:, pair] - means[:, others[pair]], axis=-1).mean(axis=1) for pair in pairs], axis=1
    )
    return (between(means_of(body, poses)) / between(named).min(axis=0)).min(axis=1)


def limb_pairs(body: Body) -> list[Int[np.ndarray, "blob"]]:
    """The blobs of each pair of limbs that are each other's counterpart."""
    dofs = other_side(body.skeleton.dof_names)
    every_limb, blobs = limbs(body.skeleton), limb_blobs(body)
    found = []
    for limb, of_limb in zip(every_limb, blobs, strict=True):
        if np.all(dofs[limb] == limb) or limb.min() > dofs[limb].min():
            continue
        others = [k for k, other in enumerate(every_limb) if np.isin(other, dofs[limb]).any()]
        found.append(np.flatnonzero(of_limb | blobs[others].any(axis=0)))
    return [pair for pair in found if len(pair)]


@compiled
def fitted_to_blobs(
    body: Body, starts: Float[Array, "start dof"], targets: Float[Array, "start blob 3"], iterations: int = ITERATIONS
) -> tuple[Float[Array, "start dof"], Float[Array, "start"]]:
    """Poses whose blobs lie near some points, and how far off they are (metres, root of the mean square)."""
    return jax.vmap(partial(fitted_part, body, PartIndex.whole(body), iterations))(starts, targets)


def fitted_part(
    body: Body, part: PartIndex, iterations: int, start: Float[Array, "dof"], target: Float[Array, "slot 3"]
) -> tuple[Float[Array, "dof"], Float[Array, ""]]:
    """A pose with a part held so that its blobs lie near some points, and how far off they are (metres, RMS)."""
    # A tracked pose may be beyond a limit; what is not to move is not to be moved back either.
    lower, upper = jnp.minimum(body.skeleton.dof_lower, start), jnp.maximum(body.skeleton.dof_upper, start)
    joints, count = jnp.asarray(body.blobs.joints)[part.blobs], part.dofs.shape[0]

    def away(pose: Array) -> tuple[Array, Array, Array]:
        frames = body.skeleton.world_from_joint(pose)
        means = body.blobs.points_world(frames)[part.blobs]
        return frames, means, jnp.where(part.blob_mask[:, None], target - means, 0.0)

    def step(_: Array, pose: Array) -> Array:
        frames, means, off = away(pose)
        counts = part.blob_mask[:, None, None] & part.dof_mask[None, None]
        jacobian = jnp.where(counts, body.skeleton.point_jacobian(frames, joints, means, part.dofs), 0.0)
        jacobian = jacobian.reshape(-1, count)
        curvature = jnp.matmul(jacobian.T, jacobian, precision="highest")
        curvature = curvature + POSE_SPREAD**2 * jnp.eye(count, dtype=pose.dtype)
        move = solve_positive(curvature, jnp.matmul(jacobian.T, off.reshape(-1), precision="highest"))
        move = move / jnp.maximum(jnp.max(jnp.abs(move)) / 0.5, 1.0)
        return jnp.clip(part.put(pose, pose[part.dofs] + move), lower, upper)

    pose = jax.lax.fori_loop(0, iterations, step, start)
    off = away(pose)[2]
    return pose, jnp.sqrt(jnp.sum(off * off) / jnp.sum(part.blob_mask, dtype=off.dtype))
