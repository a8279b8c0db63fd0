"""The energy of a search: how well a pose explains the pictures, within the joints' limits, and climbing it."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.appearance import Appearance, BlobClusters, ColorWindows
from sogjax.energy.foreground import Foreground
from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.posed import Frame, History, Posed
from sogjax.energy.priors import AccelerationPenalty
from sogjax.energy.similarity import Similarity
from sogjax.energy.term import Penalty, Term, Terms
from sogjax.energy.views import Views, whole_image_overlap
from sogjax.model.batches import of_each, shared_out
from sogjax.model.body import Body
from sogjax.model.camera import Camera
from sogjax.model.program import compiled
from sogjax.model.skeleton import Skeleton
from sogjax.model.sog import Sog
from sogjax.scene.color_clusters import SLOTS, ColorClusters
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.solve.solution import QuadraticModel, Scales

REST_WEIGHT = 0.002
"""Weight of `RestPrior`, where a body that explains all that it covers gains about 1."""
LIMITS = 5.0
"""Factor of the weights of the other terms in this energy."""
SILHOUETTE = 0.5
"""The area of a body in a picture, as a part of that of the discs of its blobs (which overlap)."""
NARROWEST = 0.5
"""Radians, the least range of a joint that is counted."""
LARGEST_ANGLE, LARGEST_TRANSLATION = 0.3, 0.15
"""Bounds on a step of the climb: radians, metres."""
DISC = 1.35
"""Radius of the disc that a blob of sigma 1 stands for."""
CLIMBED_IN_A_CALL, SCORED_IN_A_CALL = 8, 64
"""Room for poses."""


class RestPrior(Penalty):
    """How far joints are from the rest pose, as a part of their range, squared.

    Of two poses that look the same, the one that twists less is more likely.
    """

    def value(self, posed: Posed, frame: Frame) -> Float[Array, ""]:
        """The sum over the degrees of freedom that have limits."""
        return from_rest(posed.body.skeleton, posed.pose)

    def quadratic(self, posed: Posed, frame: Frame) -> QuadraticModel:
        """The exact model: the prior is quadratic."""
        inverse = 2.0 * self.weight / _ranges(posed.body.skeleton, posed.pose) ** 2
        return QuadraticModel(self.part(posed, frame), -inverse * posed.pose, jnp.diag(inverse))


def from_rest(skeleton: Skeleton, pose: Float[Array, "dof"]) -> Float[Array, ""]:
    """How far joints that have limits are from the rest pose, as a part of their range, squared and added up."""
    return jnp.sum((pose / _ranges(skeleton, pose)) ** 2)


def _ranges(skeleton: Skeleton, pose: Float[Array, "dof"]) -> Float[Array, "dof"]:
    """How far each degree of freedom goes to the side on which it is."""
    bound = jnp.where(pose < 0.0, -skeleton.dof_lower, skeleton.dof_upper)
    return jnp.maximum(bound, NARROWEST)


class SearchEnergy(eqx.Module):
    """The energy of poses of one body, with everything but what is seen around each of them."""

    body: Body
    cameras: Camera
    terms: Terms
    """All but the appearance."""
    clusters: BlobClusters
    counted: Bool[Array, "camera"]
    """The cameras that say anything."""

    @classmethod
    def from_terms(cls, body: Body, cameras: Camera, terms: Sequence[Term], clusters: ColorClusters) -> "SearchEnergy":
        """The energy with the terms of tracking that need no windows, lists or history.

        It does not know the body's name, so one program serves all actors.
        """
        others = [term for term in terms if not isinstance(term, (Similarity, Foreground, AccelerationPenalty))]
        others = [eqx.tree_at(lambda term: term.weight, term, LIMITS * term.weight) for term in others]
        members = BlobClusters.from_members(clusters.members, SLOTS)
        every = jnp.ones(cameras.image_size.shape[0], bool)
        return cls(replace(body, name=""), cameras, (*others, RestPrior(REST_WEIGHT)), members, every)

    def appearance(self, windows: ColorWindows) -> Appearance:
        """The appearance, in units of the body's own area in the pictures: it does not matter how large it is seen."""
        wholes = windows.scale**2 / whole_image_overlap(self.cameras.image_size)
        whole = jnp.mean(jnp.where(self.counted, wholes, 0.0))  # as the appearance is a mean over all cameras
        size = SILHOUETTE * jnp.pi * jnp.sum((DISC * self.body.blob_sigmas) ** 2)
        return Appearance(1.0 / (size * whole), windows, self.clusters, counted=self.counted)

    def of_windows(self, windows: ColorWindows) -> FrameEnergy:
        """The energy with what is seen around some poses."""
        num_cameras, dtype = windows.x.shape[0], windows.x.dtype
        nothing = Sog(
            jnp.zeros((num_cameras, 0, 2), dtype),
            jnp.zeros((num_cameras, 0), dtype),
            jnp.zeros((num_cameras, 0, 3), dtype),
            jnp.zeros((num_cameras, 0), bool),
        )
        views = Views(
            self.cameras,
            nothing,
            jnp.zeros((num_cameras, self.body.num_blobs, 0), dtype),
            whole_image_overlap(self.cameras.image_size),
        )
        return FrameEnergy(
            self.body, views, History.unknown(self.body.poses["rest"]), (self.appearance(windows), *self.terms)
        )


def scores(
    energy: SearchEnergy,
    windows: ColorWindows,
    place: Int[np.ndarray, "start"],
    poses: Float[np.ndarray, "start dof"],
) -> Float[np.ndarray, "start"]:
    """The energies of poses, each in the windows of its place."""
    return shared_out(partial(_scores, energy, windows), SCORED_IN_A_CALL, place, poses)[0]


@compiled
def _scores(
    energy: SearchEnergy, windows: ColorWindows, count: Array, place: Array, poses: Array
) -> tuple[Float[Array, "start"]]:
    here = lambda index: energy.of_windows(jax.tree.map(lambda leaf: leaf[index], windows))
    return (of_each(lambda index, pose: here(index)(pose), place, poses, count=count),)


def climbed(
    energy: SearchEnergy,
    windows: ColorWindows,
    place: Int[np.ndarray, "start"],
    poses: Float[np.ndarray, "start dof"],
    scales: Scales,
    iterations: int,
) -> tuple[Float[np.ndarray, "start dof"], Float[np.ndarray, "start"]]:
    """Every pose climbed and its energy."""
    climb = partial(_climbed, energy, windows, scales, jnp.asarray(iterations))
    ends, values = shared_out(climb, CLIMBED_IN_A_CALL, place, poses)
    return ends, values


@compiled
def _climbed(
    energy: SearchEnergy,
    windows: ColorWindows,
    scales: Scales,
    iterations: Array,
    count: Array,
    place: Array,
    poses: Array,
) -> tuple[Float[Array, "start dof"], Float[Array, "start"]]:
    solver = GaussNewton(epsilon=0.01, max_iterations=iterations)

    def climb(index: Array, pose: Array) -> tuple[Array, Array]:
        here = jax.tree.map(lambda leaf: leaf[index], windows)
        solution = solver.maximize(energy.of_windows(here), pose, scales)
        return solution.params, solution.value

    return of_each(climb, place, poses, count=count)
