"""The energy of a clip as a function of all its poses and the shape of its body, with a quadratic model."""

from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.adjust.arrow import ArrowSystem
from sogjax.adjust.clip_shape import ClipShape
from sogjax.adjust.contact import MovingBlobs, contact_model, standing, undersides
from sogjax.adjust.frame_models import FrameModels, blobs_by_shape, frame_model, shape_rates
from sogjax.adjust.pictures import ClipPictures, NearPairs
from sogjax.adjust.rest import RestPenalty
from sogjax.adjust.smoothness import smooth_model
from sogjax.energy.appearance import Appearance, ColorWindows
from sogjax.energy.foreground import Foreground
from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.neighbours import displacement
from sogjax.energy.pairs import SparsePairs
from sogjax.energy.posed import History
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.model.body import Body
from sogjax.model.camera import Camera
from sogjax.tracking.tracker import Tracker


@dataclass(frozen=True)
class Weights:
    """Of the parts of a clip's energy, in units of the similarity of Eq. 9; each sums over frames."""

    appearance: float = 1.0
    """Of what the cells say against the background, beside the terms of tracking."""
    rest: float = 2e-5
    shape: float = 3e-5
    """Of half a squared shape parameter in units of its expected deviation."""
    smooth: float = 0.0025
    sudden: float = 0.05
    """Radians and metres for each squared frame: second differences above it count only linearly."""
    contact: float = 10.0
    """1/m^2: of how far a standing foot moves from frame to frame."""


@dataclass(frozen=True)
class ClipEnergy:
    """Everything but the poses and the shape parameters."""

    tracker: Tracker
    shape: ClipShape
    pictures: ClipPictures
    frames: Int[np.ndarray, "frame"]
    """Their numbers."""
    fps: float
    vertical: Float[np.ndarray, "3"]
    """Unit vector upwards."""
    weights: Weights
    floor: float
    """Its height along the vertical, metres; NaN: there is none."""
    standing: Bool[np.ndarray, "frame blob"] | None = None
    """Blobs that stand from each frame to the next; None: they must be found first (`near`)."""
    pairs: NearPairs | None = None
    """None: they must be found first (`near`)."""

    def near(self, poses: Float[np.ndarray, "frame dof"], params: Float[np.ndarray, "shape"]) -> "ClipEnergy":
        """With the pairs of blobs that matter near some poses, and the feet that stand there."""
        capacity = 0 if self.pairs is None else self.pairs.capacity
        body = self.body(params)
        found = NearPairs.of(self.tracker, body, self.pictures, _single(poses), capacity)
        blobs = self.blobs(poses, params)
        heights = undersides(blobs.means, blobs.sigmas, self.vertical) - self.floor
        feet = standing(blobs.means, heights, self.frames, self.fps)
        return replace(self, pairs=found, standing=feet)

    def body(self, params: Float[np.ndarray, "shape"]) -> Body:
        """The body with some shape parameters."""
        return _shaped(self.shape, _single(params))

    def blobs(self, poses: Float[np.ndarray, "frame dof"], params: Float[np.ndarray, "shape"]) -> MovingBlobs:
        """Where the blobs are, and how they move."""
        return MovingBlobs(*(np.asarray(part, float) for part in _blobs(self.shape, _single(params), _single(poses))))

    def model(
        self, poses: Float[np.ndarray, "frame dof"], params: Float[np.ndarray, "shape"]
    ) -> tuple[float, ArrowSystem, tuple[Float[np.ndarray, "frame dof"], Float[np.ndarray, "shape"]]]:
        """The energy (to be maximised) and its model, near the poses that `near` was given.

        Last, the curvatures by what is seen alone (and by the priors of the shape), by which damping is measured: feet
        that stand are so stiff that all else would hardly move.
        """
        assert self.pairs is not None
        assert self.standing is not None
        dofs, weights, count = poses.shape[1], self.weights, len(poses)
        appearance, rest = jnp.float32(weights.appearance), jnp.float32(weights.rest)
        seen = _frame_models(
            self.shape, _single(params), self.tracker.terms, self.pictures, self.pairs.pairs, _single(poses),
            appearance, rest,
        )  # fmt: skip
        value, gradient, curvature = (np.asarray(part, float) for part in seen)
        smooth = smooth_model(poses, self.frames, weights.smooth, weights.sudden)
        contact = contact_model(self.blobs(poses, params), self.floor, self.vertical, self.standing, weights.contact)
        prior = 2.0 * weights.shape * count / np.asarray(self.shape.spread, float) ** 2
        diagonal = np.arange(dofs)
        seen_own = np.einsum("tii->ti", curvature)
        scale = seen_own[:, :dofs] + smooth.own, seen_own[:, dofs:].sum(axis=0) + prior
        own, beside = curvature[:, :dofs, :dofs] + contact.own, contact.next
        own[:, diagonal, diagonal] += smooth.own
        beside[:, diagonal, diagonal] += smooth.next
        system = ArrowSystem(
            own=own,
            next=beside,
            after_next=smooth.after_next,
            cross=curvature[:, :dofs, dofs:] + contact.cross,
            corner=curvature[:, dofs:, dofs:].sum(axis=0) + contact.corner + np.diag(prior),
            gradient=gradient[:, :dofs] + smooth.gradient + contact.gradient,
            shared_gradient=gradient[:, dofs:].sum(axis=0) + contact.shared_gradient - prior * params,
        )
        total = value.sum() + smooth.value + contact.value - 0.5 * np.sum(prior * params**2)
        return float(total), system, scale

    def values(
        self, poses: Float[np.ndarray, "frame dof"], params: Float[np.ndarray, "shape"]
    ) -> dict[str, Float[np.ndarray, "frame"]]:
        """The value of each term of tracking in every frame, without its weight and without a history."""
        assert self.pairs is not None
        found = term_values(
            self.body(params), self.tracker.terms, self.pictures.views, self.pairs.pairs, _single(poses)
        )
        return {name: np.asarray(value, float) for name, value in found.items()}

    def moved(
        self,
        before: tuple[Float[np.ndarray, "frame dof"], Float[np.ndarray, "shape"]],
        after: tuple[Float[np.ndarray, "frame dof"], Float[np.ndarray, "shape"]],
    ) -> float:
        """How far blobs have moved in any picture, in units of the margin within which pairs hold."""
        (old, old_params), (new, new_params) = before, after
        bodies = self.body(old_params), self.body(new_params)
        return float(np.max(_moved(self.tracker.cameras, *bodies, _single(old), _single(new))))


def _single(values: np.ndarray) -> Float[Array, "..."]:
    return jnp.asarray(values, jnp.float32)


@eqx.filter_jit
def _shaped(shape: ClipShape, params: Float[Array, "shape"]) -> Body:
    return shape.shaped(params)


@eqx.filter_jit
def _blobs(shape: ClipShape, params: Float[Array, "shape"], poses: Float[Array, "frame dof"]) -> tuple[Array, ...]:
    body, rates = shape.shaped(params), shape_rates(shape, params)

    def one(pose: Array) -> tuple[Array, Array, Array]:
        frames = body.skeleton.world_from_joint(pose)
        means = body.blobs.points_world(frames)
        by_pose = body.skeleton.point_jacobian(frames, body.blobs.joints, means)
        return means, by_pose, blobs_by_shape(body, rates, frames)

    return (*jax.lax.map(one, poses), body.blob_sigmas, rates.blob_sigmas)


@eqx.filter_jit
def _frame_models(
    shape: ClipShape,
    params: Float[Array, "shape"],
    terms: Terms,
    pictures: ClipPictures,
    pairs: SparsePairs,
    poses: Float[Array, "frame dof"],
    appearance: Float[Array, ""],
    rest: Float[Array, ""],
) -> FrameModels:
    body, rates = shape.shaped(params), shape_rates(shape, params)

    def one(frame: tuple[Views, ColorWindows, SparsePairs, Array]) -> FrameModels:
        views, windows, near, pose = frame
        added = (Appearance(appearance, windows, pictures.kinds), RestPenalty(rest))
        # The foreground's part is in the appearance already.
        kept = [term for term in terms if not isinstance(term, Foreground)]
        return frame_model(body, rates, pose, replace(views, pairs=near), (*kept, *added))

    return jax.lax.map(one, (pictures.views, pictures.windows, pairs, poses))


@eqx.filter_jit
def term_values(
    body: Body, terms: Terms, views: Views, pairs: SparsePairs, poses: Float[Array, "frame dof"]
) -> dict[str, Float[Array, "frame"]]:
    """The value of each term in every frame, without its weight and without a history."""

    def one(frame: tuple[Views, SparsePairs, Array]) -> dict[str, Float[Array, ""]]:
        seen, near, pose = frame
        return FrameEnergy(body, replace(seen, pairs=near), History.unknown(pose), terms).values(pose)

    return jax.lax.map(one, (views, pairs, poses))


@eqx.filter_jit
def _moved(cameras: Camera, before: Body, after: Body, old: Array, new: Array) -> Float[Array, "frame"]:
    one = lambda poses: displacement(cameras, before.posed_blobs(poses[0]), after.posed_blobs(poses[1]))
    return jax.lax.map(one, (old, new))
