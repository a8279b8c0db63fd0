"""What keypoint detectors saw in the pictures of one time."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.model.camera import Camera, project
from sogjax.model.sog import Sog

NEAR_SIDE = 0.1
"""Metres by which a keypoint is off its landmark, where the sides are told apart: poses of the last frame count."""
MOST = 4.0
"""What a keypoint that is far off costs, in logarithms."""
RARE = 0.03
"""Share of the groups of keypoints whose sides a detector exchanges."""


NEAR_BODY = 0.25
"""Metres by which a keypoint is off its landmark, where people are told apart."""
TOLD_APART = 4.0
"""How many keypoints' worth the evidence is that people found by a detector are one actor or another: those of one body
are off together."""
LEAST = 0.05
"""What counts of a keypoint of somebody who seems to be another one."""


class SeenKeypoints(eqx.Module):
    """The keypoints of people in the pictures of one time; people are in no order."""

    pixels: Float[Array | np.ndarray, "*camera person keypoint 2"]
    """Undistorted."""
    confidence: Float[Array | np.ndarray, "*camera person keypoint"]
    """The detector's confidence, 0 to 1; 0 where there is no keypoint."""


class KeypointViews(eqx.Module):
    """Keypoints near a pose: how large the body is in each picture, and in which the sides seem exchanged."""

    seen: SeenKeypoints
    exchanged: Float[Array, "*camera person keypoint"]
    """How likely it is that the keypoint is the other side's."""
    pixels_per_metre: Float[Array, "*camera actor"]
    """Pixels for each metre at the actor's distance."""
    areas: Float[Array, "*camera"]
    """The area of the body's blobs as a share of the picture, in units of Eq. 9: what the similarity could be at
    most."""
    belongs: Float[Array, "*camera person actor"]
    """How far somebody in the picture is thought to be an actor: by all keypoints together, from `LEAST` to 1."""


def body_sizes(
    cameras: Camera, blobs: Sog, normalizers: Float[Array, "camera"], actors: Int[np.ndarray, "blob"]
) -> tuple[Float[Array, "camera actor"], Float[Array, "camera"]]:
    """Pixels per metre and areas, as in `KeypointViews`, of blobs in the world, each of the actor with a number."""
    shown = jax.vmap(project, in_axes=(0, None))(cameras, blobs)
    squared = jnp.where(shown.mask, shown.sigmas, 0.0) ** 2
    member = actors[:, None] == np.arange(actors.max() + 1)[None]
    own = jnp.asarray(member, blobs.sigmas.dtype)
    sizes = jnp.matmul(squared, own) / jnp.maximum(jnp.matmul(blobs.sigmas**2, own)[None, :], 1e-12)
    return jnp.maximum(jnp.sqrt(sizes), 1e-3), jnp.pi * jnp.sum(squared, axis=1) / normalizers


def exchange_odds(
    seen: SeenKeypoints,
    pixels: Float[Array, "camera actor keypoint 2"],
    known: Bool[Array, "camera actor keypoint"],
    pixels_per_metre: Float[Array, "camera actor"],
    mirrored: tuple[int, ...],
    groups: tuple[int, ...],
) -> Float[Array, "camera person keypoint"]:
    """How likely it is that a detector exchanged the sides of a group of a person's keypoints.

    The keypoints of a group are looked at together: whether they lie nearer to the landmarks of their own side or of
    the other. Where most cameras see a group exchanged, it is the body that is, so none counts as exchanged.

    Args:
        seen: the keypoints.
        pixels: where the body's landmarks are expected.
        known: which of these there are.
        pixels_per_metre: at the actors' distances.
        mirrored: the keypoint of the other side.
        groups: by keypoint the number of its group; -1: it is never exchanged.
    """
    other, count = np.array(mirrored, int), max(groups, default=-1) + 1
    if count == 0:
        return jnp.zeros_like(jnp.asarray(seen.confidence))
    member = jnp.asarray(np.array(groups)[:, None] == np.arange(count)[None], pixels.dtype)

    def told(pixels: Float[Array, "camera actor keypoint 2"], known: Bool[Array, "camera actor keypoint"]) -> Array:
        cost = _costs(seen, pixels, pixels_per_metre, NEAR_SIDE)
        of_keypoint = jnp.where(known[:, None], seen.confidence[:, :, None] * (MOST - cost), 0.0)
        return jnp.max(jnp.einsum("cpak,kg->cpag", of_keypoint, member, precision="highest"), axis=2)

    as_told, exchanged = told(pixels, known), told(pixels[:, :, other], known[:, :, other])
    likely = jax.nn.sigmoid(exchanged - as_told + jnp.log(RARE))
    sure = jnp.sum(seen.confidence[..., None] * member[None, None], axis=2)
    share = jnp.sum(sure * likely, axis=(0, 1)) / jnp.maximum(jnp.sum(sure, axis=(0, 1)), 1e-6)
    likely = jnp.where(share[None, None] <= 0.5, likely, 0.0)
    return jnp.einsum("cpg,kg->cpk", likely, member, precision="highest")


def belonging(
    seen: SeenKeypoints,
    pixels: Float[Array, "camera actor keypoint 2"],
    known: Bool[Array, "camera actor keypoint"],
    pixels_per_metre: Float[Array, "camera actor"],
) -> Float[Array, "camera person actor"]:
    """How far people in the pictures are actors: the more, the nearer all their keypoints lie to an actor's landmarks.

    Held against the actor who is nearest to somebody, since nobody is two actors, and against whoever is nearest to the
    actor. Where nobody lies nearer than others, all count alike; arguments as of `exchange_odds`.
    """
    confidence = jnp.asarray(seen.confidence)
    cost = _costs(seen, pixels, pixels_per_metre, NEAR_BODY)
    sure = jnp.where(known[:, None], confidence[:, :, None], 0.0)
    near = TOLD_APART * jnp.sum(sure * (MOST - cost), axis=-1) / jnp.maximum(jnp.sum(sure, axis=-1), 1.0)
    there = jnp.any(confidence > 0.0, axis=2)[..., None]  # room for people whom nobody fills is nearer than nobody
    nearest = jnp.max(jnp.where(there, near, 0.0), axis=1, keepdims=True)
    logs = (near - nearest) + (near - jnp.max(near, axis=2, keepdims=True))
    return jnp.maximum(jnp.exp(jnp.minimum(logs, 0.0)), LEAST)


def _costs(
    seen: SeenKeypoints,
    pixels: Float[Array, "camera actor keypoint 2"],
    pixels_per_metre: Float[Array, "camera actor"],
    near: float,
) -> Float[Array, "camera person actor keypoint"]:
    """What the distances of keypoints from landmarks cost, in logarithms, where they are usually `near` (metres)."""
    away = (seen.pixels[:, :, None] - pixels[:, None]) / pixels_per_metre[:, None, :, None, None]
    return jnp.minimum(jnp.sum(away**2, axis=-1) / (2.0 * near**2), MOST)
