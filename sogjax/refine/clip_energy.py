"""The energy of a clip as a function of all its poses and what they share, with a quadratic model.

What they share is the shape of the body and, where cameras may move, seven numbers of each of these.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.priors import RestPenalty, pose_spread
from sogjax.model.body import Body
from sogjax.refine.arrow import ArrowSystem
from sogjax.refine.camera_moves import LARGEST_STEP, MOVE, SPREAD, Sights
from sogjax.refine.clip_priors import ContactModel, MovingBlobs, contact_model, smooth_model, standing, undersides
from sogjax.refine.clip_programs import (
    frame_models,
    moved_in_frames,
    moved_in_pictures,
    moving_blobs,
    shaped,
    term_values,
)
from sogjax.refine.clip_shape import ClipShape
from sogjax.refine.frame_models import FrameModels
from sogjax.refine.pictures import ClipPictures, NearPairs
from sogjax.tracking.tracker import Tracker

LARGEST_SHAPE_STEP = 0.05
"""The largest step of an iteration: logarithms of scales, metres."""
MANY_CAMERAS = 12
"""Cameras for which the weight of the shape's prior is given: the energy is a mean over them, and few say little."""


@dataclass(frozen=True)
class Weights:
    """Weights of the parts of a clip's energy, in units of the similarity of Eq. 9; each sums over frames."""

    appearance: float = 1.0
    """Weight of what the cells say against the background, beside the terms of tracking."""
    rest: float = 2e-5
    shape: float = 3e-5
    """Weight of half a squared shape parameter in units of its expected deviation, with `MANY_CAMERAS`."""
    smooth: float = 0.0025
    sudden: float = 0.05
    """Radians and metres for each squared frame: second differences above it count only linearly."""
    contact: float = 10.0
    """1/m^2: of how far a standing foot moves from frame to frame."""
    cameras: float = 5e-6
    """Weight of half a squared number of a camera's move in units of its expected deviation."""


@dataclass(frozen=True)
class ClipEnergy:
    """Everything but the poses and the shape parameters."""

    tracker: Tracker
    shape: ClipShape
    pictures: ClipPictures
    frames: Int[np.ndarray, "frame"]
    """Their numbers."""
    fps: float
    """Of these numbers."""
    step: int
    """Between the numbers of frames of which none is missing."""
    vertical: Float[np.ndarray, "3"]
    """Unit vector upwards."""
    weights: Weights
    floor: float
    """Its height along the vertical, metres; NaN: there is none."""
    standing: Bool[np.ndarray, "frame blob"] | None = None
    """Blobs that stand from each frame to the next; None: they must be found first (`near`)."""
    pairs: NearPairs | None = None
    """None: they must be found first (`near`)."""
    velocities: Float[np.ndarray, "frame blob 3"] | None = None
    """Velocities of the blobs, metres a frame; None: cameras do not move, and have no part in the parameters."""

    @property
    def num_shared(self) -> int:
        """Number of the parameters that all frames share."""
        return self.shape.num_params + (
            0 if self.velocities is None else MOVE * len(self.pictures.views.normalizers[0])
        )

    def moves(self, params: Float[np.ndarray, "shared"]) -> Float[np.ndarray, "camera 7"]:
        """The parameters that are the cameras' moves."""
        return params[self.shape.num_params :].reshape(-1, MOVE)

    @cached_property
    def rest(self) -> RestPenalty:
        """Being near rest, by the tracker's body: the shape hardly changes what pictures tell of a turn."""
        return RestPenalty(self.weights.rest, pose_spread(self.tracker.body))

    @property
    def spread(self) -> Float[np.ndarray, "shared"]:
        """Expected deviation of each shared parameter."""
        cameras = (self.num_shared - self.shape.num_params) // MOVE
        return np.concatenate([np.asarray(self.shape.spread, float), np.tile(SPREAD, cameras)])

    @property
    def largest_steps(self) -> Float[np.ndarray, "shared"]:
        """The largest step of each shared parameter in one iteration."""
        shape = self.shape.num_params
        return np.concatenate(
            [np.full(shape, LARGEST_SHAPE_STEP), np.tile(LARGEST_STEP, (self.num_shared - shape) // MOVE)]
        )

    @property
    def priors(self) -> Float[np.ndarray, "shared"]:
        """Curvature of what holds the shared parameters at 0."""
        shape = np.arange(self.num_shared) < self.shape.num_params
        of_shape = self.weights.shape * max(MANY_CAMERAS / len(self.tracker.normalizers), 1.0)
        weights = np.where(shape, 2.0 * of_shape, 2.0 * self.weights.cameras)
        return weights * len(self.frames) / self.spread**2

    def near(self, poses: Float[np.ndarray, "frame dof"], params: Float[np.ndarray, "shared"]) -> "ClipEnergy":
        """The energy with the pairs of blobs that matter near some poses, and the feet that stand there."""
        capacity = 0 if self.pairs is None else self.pairs.capacity
        body = self.body(params)
        found = NearPairs.of(self.tracker, body, self.pictures, _single(poses), capacity, self._sights(params))
        blobs = self.blobs(poses, params)
        heights = undersides(blobs.means, blobs.sigmas, self.vertical) - self.floor
        feet = standing(blobs.means, heights, self.frames, self.fps, self.step)
        return replace(self, pairs=found, standing=feet)

    def body(self, params: Float[np.ndarray, "shared"]) -> Body:
        """The body with some shape parameters."""
        return shaped(self.shape, _single(params[: self.shape.num_params]))

    def _sights(self, params: Float[np.ndarray, "shared"]) -> Sights | None:
        """How cameras see all frames; None: as calibrated."""
        if self.velocities is None:
            return None
        return Sights(_single(self.moves(params)), _single(self.velocities))

    def blobs(self, poses: Float[np.ndarray, "frame dof"], params: Float[np.ndarray, "shared"]) -> MovingBlobs:
        """Where the blobs are, and how they move."""
        shape = _single(params[: self.shape.num_params])
        return MovingBlobs(*(np.asarray(part, float) for part in moving_blobs(self.shape, shape, _single(poses))))

    def model(
        self, poses: Float[np.ndarray, "frame dof"], params: Float[np.ndarray, "shared"]
    ) -> tuple[float, ArrowSystem, tuple[Float[np.ndarray, "frame dof"], Float[np.ndarray, "shared"]]]:
        """The energy (to be maximised) and its model, near the poses that `near` was given.

        Last, the curvatures by what is seen alone (and by the priors of the shape), by which damping is measured: feet
        that stand are so stiff that all else would hardly move.
        """
        assert self.standing is not None
        dofs, weights = poses.shape[1], self.weights
        value, gradient, curvature = (np.asarray(part, float) for part in self._seen(poses, params)[:3])
        smooth = smooth_model(poses, self.frames, weights.smooth, weights.sudden, self.step)
        contact = contact_model(self.blobs(poses, params), self.floor, self.vertical, self.standing, weights.contact)
        contact = _padded(contact, self.num_shared)
        prior = self.priors
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

    def most(
        self, poses: Float[np.ndarray, "frame dof"], params: Float[np.ndarray, "shared"]
    ) -> Float[np.ndarray, "camera"]:
        """What each camera would gain if every blob of every frame could move freely in its picture."""
        return np.asarray(self._seen(poses, params).most, float).sum(axis=0)

    def _seen(self, poses: Float[np.ndarray, "frame dof"], params: Float[np.ndarray, "shared"]) -> FrameModels:
        assert self.pairs is not None
        appearance = jnp.float32(self.weights.appearance)
        return frame_models(
            self.shape, _single(params[: self.shape.num_params]), self.tracker.terms, self.pictures, self.pairs.pairs,
            _single(poses), appearance, self.rest, self._sights(params),
        )  # fmt: skip

    def values(
        self, poses: Float[np.ndarray, "frame dof"], params: Float[np.ndarray, "shared"]
    ) -> dict[str, Float[np.ndarray, "frame"]]:
        """The value of each term of tracking in every frame, without its weight and without a history.

        Cameras stand where they were moved to; the times at which they see are left out.
        """
        assert self.pairs is not None
        views = self.pictures.views
        if self.velocities is not None:
            cameras = moved_in_frames(views.cameras, _single(self.moves(params)))
            views = eqx.tree_at(lambda v: v.cameras, views, cameras)
        found = term_values(self.body(params), self.tracker.terms, views, self.pairs.pairs, _single(poses))
        return {name: np.asarray(value, float) for name, value in found.items()}

    def moved(
        self,
        before: tuple[Float[np.ndarray, "frame dof"], Float[np.ndarray, "shared"]],
        after: tuple[Float[np.ndarray, "frame dof"], Float[np.ndarray, "shared"]],
    ) -> float:
        """How far blobs have moved in any picture, in units of the margin within which pairs hold."""
        (old, old_params), (new, new_params) = before, after
        bodies = self.body(old_params), self.body(new_params)
        sights = self._sights(old_params), self._sights(new_params)
        return float(np.max(moved_in_pictures(self.tracker.cameras, bodies, sights, (_single(old), _single(new)))))


def _padded(contact: ContactModel, shared: int) -> ContactModel:
    """Derivatives with 0 for shared parameters that do not move the blobs."""
    more = shared - len(contact.shared_gradient)
    return contact._replace(
        cross=np.pad(contact.cross, ((0, 0), (0, 0), (0, more))),
        shared_gradient=np.pad(contact.shared_gradient, (0, more)),
        corner=np.pad(contact.corner, (0, more)),
    )


def _single(values: np.ndarray) -> Float[Array, "..."]:
    return jnp.asarray(values, jnp.float32)
