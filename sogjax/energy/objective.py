"""The energy that tracking maximises (Eq. 9, 10), written once for any number of cameras and actors."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.neighbours import margins, near_pairs
from sogjax.energy.overlap import (
    EXACT_EXPONENT,
    GradientMode,
    capped_overlap,
    overlap_of_pairs,
    pair_color_similarities,
    self_overlaps,
)
from sogjax.energy.pairs import SparsePairs
from sogjax.energy.priors import acceleration_penalty, limit_penalty
from sogjax.model.body import Body
from sogjax.model.camera import Camera, project
from sogjax.model.sog import Sog


class EnergyWeights(eqx.Module):
    """The constants of Eq. 6, 8 and 10, by default those of the paper (the commands' are in their configs).

    What is swept is an array; what changes the formula is static.
    """

    limit_weight: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=1.0)
    acceleration_weight: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=0.05)
    exponent: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=EXACT_EXPONENT)
    capped: bool = eqx.field(static=True, default=True)
    gradient: GradientMode = eqx.field(static=True, default="forward")


class Views(eqx.Module):
    """What the cameras see at one time: a stack of cameras and, for each, its image as a Sog."""

    cameras: Camera
    images: Sog
    color_similarities: Float[Array, "camera body image"]
    """d(c_i, c_j) of Eq. 7: it does not depend on the pose, so it is computed once a frame."""
    normalizers: Float[Array, "camera"]
    """E(K_l, K_l) of Eq. 9 over the whole image, before culling, in square pixels."""
    pairs: SparsePairs | None = None
    """The pairs that matter near some pose; None: all pairs are compared."""

    @classmethod
    def from_images(
        cls,
        cameras: Camera,
        images: Sog,
        body: Sog,
        normalizers: Float[Array, "camera"],
        space: str,
        color_radius: Float[Array, ""],
    ) -> "Views":
        """Compare the colours of a body's blobs with every image; all colours are in `space`."""
        compare = lambda image: pair_color_similarities(image, body, space, color_radius)
        return cls(cameras, images, jax.vmap(compare)(images), normalizers)

    def near(self, blobs: Sog, weights: "EnergyWeights", capacity: int) -> tuple["Views", Int[Array, ""]]:
        """The same views with only the pairs that matter near `blobs` (world), and how many blocks those are."""
        seen = jax.vmap(project, in_axes=(0, None))(self.cameras, blobs)
        pairs, count = near_pairs(
            self.images, self.color_similarities, seen, margins(self.cameras), weights.exponent, capacity
        )
        views = Views(self.cameras, self.images, self.color_similarities, self.normalizers, pairs)
        return views, count


class History(eqx.Module):
    """The poses of the two frames before; `known` is False where there are none (no acceleration penalty)."""

    previous: Float[Array, "dof"]
    before_previous: Float[Array, "dof"]
    known: Bool[Array, ""]


class EnergyTerms(eqx.Module):
    """The parts of Eq. 10, unweighted, and their sum."""

    similarity: Float[Array, ""]
    limit_penalty: Float[Array, ""]
    acceleration_penalty: Float[Array, ""]
    energy: Float[Array, ""]


def whole_image_overlap(image_sizes: Float[Array, "*camera 2"]) -> Float[Array, "*camera"]:
    """E(K_l, K_l): the sum of pi sigma_i^2 over a quad-tree that tiles the image, (pi/4) x its area."""
    return jnp.pi / 4.0 * image_sizes[..., 0] * image_sizes[..., 1]


def view_similarity(
    camera: Camera,
    image: Sog,
    color_similarities: Float[Array, "body image"],
    normalizer: Float[Array, ""],
    blobs: Sog,
    weights: EnergyWeights,
) -> Float[Array, ""]:
    """Normalised similarity of one image with a body's blobs in the world: one summand of Eq. 9."""
    overlap = capped_overlap(
        image,
        project(camera, blobs),
        color_similarities,
        weights.exponent,
        capped=weights.capped,
        gradient=weights.gradient,
    )
    return overlap / normalizer


def similarity(blobs: Sog, views: Views, weights: EnergyWeights) -> Float[Array, ""]:
    """E(Theta) of Eq. 9: the mean over the cameras of the normalised similarity."""
    if views.pairs is not None:
        return _sparse_similarity(blobs, views, views.pairs, weights)
    per_camera = jax.vmap(view_similarity, in_axes=(0, 0, 0, 0, None, None))
    return jnp.mean(
        per_camera(views.cameras, views.images, views.color_similarities, views.normalizers, blobs, weights)
    )


def _sparse_similarity(blobs: Sog, views: Views, pairs: SparsePairs, weights: EnergyWeights) -> Float[Array, ""]:
    """The same from the pairs that matter, of all cameras at once."""
    seen = jax.vmap(project, in_axes=(0, None))(views.cameras, blobs)
    per_camera = overlap_of_pairs(
        pairs,
        image_caps(views, pairs),
        seen,
        weights.exponent,
        capped=weights.capped,
        gradient=weights.gradient,
    )
    return jnp.mean(per_camera / views.normalizers)


def image_caps(views: Views, pairs: SparsePairs) -> Float[Array, "camera image"]:
    """Caps of Eq. 8 of the image blobs that pairs count, which fill whole tiles."""
    extra = pairs.image_shape[1] - views.images.capacity
    return jnp.pad(self_overlaps(views.images), ((0, 0), (0, extra)))


def penalties(body: Body, pose: Float[Array, "dof"], history: History) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """E_lim and E_acc of Eq. 10, unweighted."""
    lower, upper = body.skeleton.joint_limits()
    limits = limit_penalty(body.skeleton.joint_params(pose), lower, upper)
    acceleration = acceleration_penalty(pose, history.previous, history.before_previous)
    return limits, jnp.where(history.known, acceleration, 0.0)


def energy_terms(
    body: Body, pose: Float[Array, "dof"], views: Views, history: History, weights: EnergyWeights
) -> EnergyTerms:
    """Every term of Eq. 10 at a pose."""
    limits, acceleration = penalties(body, pose, history)
    match = similarity(body.posed_blobs(pose), views, weights)
    penalty = weights.limit_weight * limits + weights.acceleration_weight * acceleration
    return EnergyTerms(match, limits, acceleration, match - penalty)


def terms_of_energy(
    body: Body, pose: Float[Array, "dof"], energy: Float[Array, ""], history: History, weights: EnergyWeights
) -> EnergyTerms:
    """The terms of Eq. 10 at a pose whose energy is known: without looking at the pictures again."""
    limits, acceleration = penalties(body, pose, history)
    penalty = weights.limit_weight * limits + weights.acceleration_weight * acceleration
    return EnergyTerms(energy + penalty, limits, acceleration, energy)


def energy(
    body: Body, pose: Float[Array, "dof"], views: Views, history: History, weights: EnergyWeights
) -> Float[Array, ""]:
    """E(Theta) of Eq. 10, to be maximised."""
    return energy_terms(body, pose, views, history, weights).energy
