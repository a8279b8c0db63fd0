"""Where keypoints lead before the pictures are asked: from wide to narrow, and no nearer than detectors can be trusted.

A limb that was lost, or was faster than predicted, is so brought to where the pictures can take over; one that is near
its keypoints stays where it is expected, as detectors are centimetres off.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.keypoint_views import KeypointViews
from sogjax.energy.keypoints import KeypointTerm
from sogjax.energy.posed import Posed
from sogjax.energy.priors import LimitPenalty
from sogjax.model.body import Body
from sogjax.model.camera import Camera
from sogjax.solve.gauss_newton import GaussNewton
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
