"""Keypoints before the pictures are asked: where they lead, and how far they lie from the landmarks on average.

A limb that was lost, or was faster than predicted, is brought to where the pictures can take over: from wide to narrow,
and no nearer than detectors can be trusted. One that is near its keypoints stays where it is expected.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.keypoint_views import KeypointViews, SeenKeypoints
from sogjax.energy.keypoints import KeypointTerm
from sogjax.energy.posed import Posed
from sogjax.energy.priors import LimitPenalty
from sogjax.model.body import Body
from sogjax.model.camera import Camera
from sogjax.model.program import compiled
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.solve.linear import solve_positive
from sogjax.solve.solution import QuadraticModel, Scales

WIDTHS = (0.2, 0.08)
"""Metres: S of the pulls, one after the other."""
NEAR_ENOUGH = 0.06
"""Metres from its keypoint, within which a landmark stays."""
ITERATIONS = 8
"""Of each width, at most."""


class _Led(eqx.Module):
    """The pull of the keypoints within the joints' limits, to be maximised."""

    body: Body
    cameras: Camera
    views: KeypointViews
    pull: KeypointTerm
    limits: LimitPenalty

    def __call__(self, pose: Float[Array, "dof"]) -> Float[Array, ""]:
        return self.quadratic(pose).value

    def quadratic(self, pose: Float[Array, "dof"]) -> QuadraticModel:
        posed = Posed.from_pose(self.body, pose)
        return self.pull.model(posed, self.cameras, self.views) + self.limits.model(posed)


class KeypointPrefit(eqx.Module):
    """The keypoints of a frame."""

    body: Body
    cameras: Camera
    views: KeypointViews
    pull: KeypointTerm

    def followed(self, pose: Float[Array, "dof"], scales: Scales) -> Float[Array, "dof"]:
        """From an expected pose to where the keypoints lead."""
        solver = GaussNewton(epsilon=0.01, min_iterations=1, max_iterations=ITERATIONS)
        for width in WIDTHS:
            pull = eqx.tree_at(
                lambda p: (p.weight, p.spread, p.tolerance),
                self.pull,
                (
                    jnp.ones_like(self.pull.weight),
                    jnp.full_like(self.pull.spread, width),
                    jnp.full_like(self.pull.tolerance, NEAR_ENOUGH),
                ),
            )
            led = _Led(self.body, self.cameras, self.views, pull, LimitPenalty(1.0))
            pose = solver.maximize(led, pose, scales).params
        return pose


FARTHEST = 0.03
"""Metres: of an offset."""
EXPECTED = 0.02
"""Metres: an offset's usual size, for places that few cameras see."""
INDEPENDENT = 10.0
"""Frames that err independently, about: those of a second of motion err in common."""
BIAS_ITERATIONS = 6


class _Sums(NamedTuple):
    by_offset: Float[Array, "point 3"]
    stiffness: Float[Array, "point 3 3"]


@compiled
def estimated_offsets(
    pull: KeypointTerm,
    body: Body,
    cameras: Camera,
    normalizers: Float[Array, "camera"],
    poses: Float[Array, "frame dof"],
    seen: SeenKeypoints,
) -> Float[Array, "actor keypoint 3"]:
    """The offsets that bring the landmarks nearest to the keypoints of some frames, robustly; `FARTHEST` at most.

    The widths are those of `pull`; the body stands upright in the recording's world; `seen` is by frame and camera.
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
        moved = flat + jax.vmap(solve_positive)(sums.stiffness + held, pulled)
        length = jnp.linalg.norm(moved, axis=-1, keepdims=True)
        return (moved * jnp.minimum(1.0, FARTHEST / jnp.maximum(length, 1e-9))).reshape(offsets.shape)

    return jax.lax.fori_loop(0, BIAS_ITERATIONS, improved, start.offsets)
