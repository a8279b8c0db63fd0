"""Where a detector puts its keypoints on a body: offsets from the landmarks, told by frames whose poses are known."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.keypoint_views import SeenKeypoints
from sogjax.energy.keypoints import KeypointTerm
from sogjax.energy.posed import Posed
from sogjax.model.body import Body
from sogjax.model.camera import Camera

FARTHEST = 0.03
"""Metres: of an offset."""
EXPECTED = 0.02
"""Metres: an offset's usual size, for places that few cameras see."""
INDEPENDENT = 10.0
"""Frames that err independently, about: those of a second of motion err in common."""
ITERATIONS = 6


class _Sums(NamedTuple):
    by_offset: Float[Array, "point 3"]
    stiffness: Float[Array, "point 3 3"]


@eqx.filter_jit
def estimated_offsets(
    pull: KeypointTerm,
    body: Body,
    cameras: Camera,
    normalizers: Float[Array, "camera"],
    poses: Float[Array, "frame dof"],
    seen: SeenKeypoints,
) -> Float[Array, "actor keypoint 3"]:
    """The offsets that bring the landmarks nearest to the keypoints of some frames, robustly; `FARTHEST` at most.

    Args:
        pull: whose widths hold.
        body: upright in the recording's world.
        cameras: that see it.
        normalizers: as in `Views`.
        poses: of the frames.
        seen: by frame and camera.
    """
    start = eqx.tree_at(lambda p: (p.weight, p.offsets), pull, (jnp.ones_like(pull.weight), 0.0 * pull.offsets))
    posed = jax.lax.map(lambda pose: Posed.from_pose(body, pose), poses)
    views = jax.lax.map(lambda each: start.views(each[0], cameras, each[1], normalizers), (seen, posed))
    # Cameras count alike, and all frames together as one: they err in common.
    views = eqx.tree_at(lambda v: v.areas, views, jnp.ones_like(views.areas))

    def improved(_, offsets: Float[Array, "actor keypoint 3"]) -> Float[Array, "actor keypoint 3"]:
        now = eqx.tree_at(lambda p: p.offsets, start, offsets)

        def of_frame(each) -> _Sums:
            posed, views = each
            pulls, turns = now.pulls(now.points(posed), cameras, views), now.rotations(posed)
            by_offset = jnp.einsum("nij,ni->nj", turns, pulls.by_point, precision="highest")
            return _Sums(by_offset, jnp.einsum("nia,nij,njb->nab", turns, pulls.stiffness, turns, precision="highest"))

        sums = jax.tree.map(lambda leaf: jnp.mean(leaf, axis=0), jax.lax.map(of_frame, (posed, views)))
        used = max(sum(mark >= 0 for marks in pull.landmarks for mark in marks), 1) * normalizers.shape[0]
        held = jnp.eye(3, dtype=offsets.dtype)[None] / (EXPECTED**2 * used * INDEPENDENT)
        flat = offsets.reshape(-1, 3)
        pulled = sums.by_offset - jnp.einsum("nij,nj->ni", jnp.broadcast_to(held, sums.stiffness.shape), flat)
        moved = flat + jnp.linalg.solve(sums.stiffness + held, pulled[..., None])[..., 0]
        length = jnp.linalg.norm(moved, axis=-1, keepdims=True)
        return (moved * jnp.minimum(1.0, FARTHEST / jnp.maximum(length, 1e-9))).reshape(offsets.shape)

    return jax.lax.fori_loop(0, ITERATIONS, improved, start.offsets)
