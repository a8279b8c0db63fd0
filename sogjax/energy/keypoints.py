"""Keypoints that detectors saw, as pulls on a body's landmarks: they tell which maximum, the pictures tell where.

Around each projected landmark the keypoints of all people in the picture are a mixture (soft assignment), the other
side's among them, and a constant for those that are of nobody. The gradient of its logarithm draws the landmark to the
mean of the keypoints that are thought to be its own, the less, the less any is.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.energy.image_term import gauss_newton_model
from sogjax.energy.keypoint_views import KeypointViews, SeenKeypoints, belonging, body_sizes, exchange_odds
from sogjax.energy.posed import Frame, Posed
from sogjax.energy.term import Term, Terms
from sogjax.model.body import Body
from sogjax.model.camera import NEAR, Camera, project_points, projection_jacobian
from sogjax.model.rotation import transform_points
from sogjax.solve.solution import QuadraticModel


class PointPulls(NamedTuple):
    """A value and how it changes with points in the world."""

    value: Float[Array, ""]
    by_point: Float[Array, "point 3"]
    stiffness: Float[Array, "point 3 3"]
    """The curvature of springs to where the points are drawn."""


class KeypointTerm(Term):
    """The mean over cameras and keypoints of `log(1 + r / outlier)`, times the body's share of the picture.

    `r` is the sum over the people of `belongs confidence exp(-d^2 / 2 S^2)`, d being the distance of the keypoint from
    the projected landmark (at the actor's distance, in metres) beyond `tolerance`; as far as the sides seem exchanged,
    of the keypoint of the other side; `belongs` says how far somebody is the actor. 0 where no keypoints are known.
    """

    landmarks: tuple[tuple[int, ...], ...] = eqx.field(static=True, kw_only=True)
    """The number in the body of each actor's landmark for each keypoint; -1: it has none."""
    mirrored: tuple[int, ...] = eqx.field(static=True, kw_only=True)
    """The keypoint of the other side; its own number at the midline."""
    groups: tuple[int, ...] = eqx.field(static=True, kw_only=True)
    """Keypoints of one number are exchanged with the other side's together; -1: never."""
    offsets: Float[Array, "actor keypoint 3"] = eqx.field(kw_only=True)
    """The way from the landmark to where the detector puts the keypoint, in the frame of the landmark's joint,
    metres."""
    spread: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=0.05)
    """S, metres."""
    tolerance: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=0.0)
    """Metres within which a keypoint does not pull."""
    outlier: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=0.5)
    """Confidence of a keypoint that is of nobody."""

    def value(self, posed: Posed, frame: Frame) -> Float[Array, ""]:
        """The value for the posed landmarks; 0 where no keypoints are known."""
        views = frame.views
        if views.keypoints is None:
            return jnp.zeros((), posed.pose.dtype)
        logs, _, _ = self._mixtures(self.points(posed), views.cameras, views.keypoints)
        return jnp.sum(logs * self._worth(views.keypoints)[:, None])

    def quadratic(self, posed: Posed, frame: Frame) -> QuadraticModel:
        """Gradient in closed form, and the curvature of springs to where the landmarks are drawn."""
        nothing = jnp.zeros_like(posed.pose)
        if frame.views.keypoints is None:
            return QuadraticModel(jnp.zeros((), posed.pose.dtype), nothing, nothing[:, None] * nothing[None, :])
        return self.model(posed, frame.views.cameras, frame.views.keypoints)

    def model(self, posed: Posed, cameras: Camera, views: KeypointViews) -> QuadraticModel:
        """The quadratic model for keypoints that are given."""
        points = self.points(posed)
        pulls = self.pulls(points, cameras, views)
        jacobian = posed.body.skeleton.point_jacobian(posed.world_from_joint, self._joints(posed.body), points)
        return gauss_newton_model(pulls.value, pulls.by_point, pulls.stiffness, jacobian)

    def pulls(self, points: Float[Array, "point 3"], cameras: Camera, views: KeypointViews) -> PointPulls:
        """What keypoints say of points in the world, in the order of `points`, with the weight."""
        logs, pulls, springs = self._mixtures(points, cameras, views)
        scale = self.signed_weight * self._worth(views)
        across = jax.vmap(projection_jacobian, in_axes=(0, None))(cameras, points)
        stretched = across * (springs * scale[:, None])[:, :, None, None]
        return PointPulls(
            value=jnp.sum(logs * scale[:, None]),
            by_point=jnp.einsum("cnk,cnki->ni", pulls * scale[:, None, None], across, precision="highest"),
            stiffness=jnp.einsum("cnki,cnkj->nij", across, stretched, precision="highest"),
        )

    def views(
        self, seen: SeenKeypoints, cameras: Camera, posed: Posed, normalizers: Float[Array, "camera"]
    ) -> KeypointViews:
        """Keypoints near a pose; normalizers as in `Views`."""
        sizes, areas = body_sizes(cameras, posed.blobs, normalizers, posed.body.blob_actors)
        pixels, depths = jax.vmap(project_points, in_axes=(0, None))(cameras, self.points(posed))
        shape = (len(pixels), len(self.landmarks), len(self.mirrored))
        known = (depths > NEAR).reshape(shape) & jnp.asarray(np.array(self.landmarks, int) >= 0)[None]
        exchanged = exchange_odds(seen, pixels.reshape(*shape, 2), known, sizes, self.mirrored, self.groups)
        belongs = belonging(seen, pixels.reshape(*shape, 2), known, sizes)
        return KeypointViews(seen, exchanged, sizes, areas, belongs)

    def points(self, posed: Posed) -> Float[Array, "point 3"]:
        """Where the detector would put the keypoints of all actors, in the world; any place for those without one."""
        marks = np.maximum(np.array(self.landmarks, int), 0).reshape(-1)
        offsets = posed.body.landmarks.offsets[marks] + self.offsets.reshape(-1, 3)
        return transform_points(posed.world_from_joint[np.array(self._joints(posed.body))], offsets)

    def rotations(self, posed: Posed) -> Float[Array, "point 3 3"]:
        """The rotations of the frames in which the offsets are given."""
        return posed.world_from_joint[np.array(self._joints(posed.body)), :3, :3]

    def _joints(self, body: Body) -> tuple[int, ...]:
        return tuple(body.landmarks.joints[max(mark, 0)] for marks in self.landmarks for mark in marks)

    def _worth(self, views: KeypointViews) -> Float[Array, "camera"]:
        """What a keypoint of each camera counts."""
        used = max(sum(mark >= 0 for marks in self.landmarks for mark in marks), 1)
        return views.areas / (views.areas.shape[0] * used)

    def _mixtures(
        self, points: Float[Array, "point 3"], cameras: Camera, views: KeypointViews
    ) -> tuple[Float[Array, "camera point"], Float[Array, "camera point 2"], Float[Array, "camera point"]]:
        """The logarithm of each camera and point's mixture, its derivative by the pixel, and the springs' stiffness."""
        used = jnp.asarray(np.array(self.landmarks, int).reshape(-1) >= 0)
        other, count, actors = np.array(self.mirrored, int), len(self.mirrored), len(self.landmarks)
        seen = views.seen
        pixels = jnp.concatenate([seen.pixels, seen.pixels[..., other, :]], axis=-3)
        mirrored = views.exchanged[..., other] * seen.confidence[..., other]
        sure = jnp.concatenate([(1.0 - views.exchanged) * seen.confidence, mirrored], axis=-2)
        # By camera, candidate and point; a point is a keypoint of an actor.
        pixels, sure = jnp.tile(pixels, (1, 1, actors, 1)), jnp.tile(sure, (1, 1, actors))
        sure = sure * jnp.repeat(jnp.tile(views.belongs, (1, 2, 1)), count, axis=2)
        scale = jnp.repeat(views.pixels_per_metre, count, axis=1)
        project_all = jax.vmap(project_points, in_axes=(0, None))
        at, depths = project_all(cameras, points)
        sure = jnp.where(used[None, None, :] & (depths > NEAR)[:, None, :], sure, 0.0)
        away = (pixels - at[:, None]) / scale[:, None, :, None]
        distance = jnp.sqrt(jnp.sum(jnp.where((sure > 0.0)[..., None], away, 1.0) ** 2, axis=-1) + 1e-12)
        beyond = jnp.maximum(distance - self.tolerance, 0.0)
        parts = sure * jnp.exp(-0.5 * (beyond / self.spread) ** 2)
        total = self.outlier + jnp.sum(parts, axis=1)
        shares = parts / total[:, None]
        stiffness = shares * (beyond / distance) / self.spread**2
        pulls = jnp.einsum("cpn,cpnk->cnk", stiffness, away) / scale[..., None]
        return jnp.log(total / self.outlier), pulls, jnp.sum(stiffness, axis=1) / scale**2


def keypoint_term_among(terms: Terms) -> KeypointTerm | None:
    """The pull of the keypoints; None: the energy has none."""
    return next((term for term in terms if isinstance(term, KeypointTerm)), None)
