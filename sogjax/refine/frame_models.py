"""Quadratic models of the energy of frames by pose, shape and cameras: what each camera pulls, times Jacobians."""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.energy.image_term import ImageTerm, gauss_newton_model, weighted_pulls
from sogjax.energy.overlap import ImagePulls
from sogjax.energy.posed import Frame, History, Posed
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.model.body import Body
from sogjax.model.camera import Camera, project, projection_jacobian
from sogjax.model.skeleton import ancestor_table
from sogjax.model.sog import Sog
from sogjax.refine.camera_moves import MOVE, Sights, sight_rates
from sogjax.refine.clip_shape import ClipShape

LOOSE = 0.1
"""Share of the mean stiffness of a picture's blobs: what holds each of them at least."""


class FrameModels(NamedTuple):
    """Models of each frame by its pose, then the shape, then (if they may move) the cameras."""

    value: Float[Array, "*frame"]
    gradient: Float[Array, "*frame param"]
    curvature: Float[Array, "*frame param param"]
    """Positive semi-definite."""
    most: Float[Array, "*frame camera"] | None = None
    """What each camera would gain if every blob could move freely in its picture; None: cameras do not move."""


class ShapeRates(NamedTuple):
    """How fast a body's own lengths change with its shape."""

    joint_offsets: Float[Array, "joint 3 shape"]
    blob_offsets: Float[Array, "blob 3 shape"]
    blob_sigmas: Float[Array, "blob shape"]


class SeenBy(NamedTuple):
    """What one frame's pictures say, by the blobs in the world."""

    value: Float[Array, ""]
    by_mean: Float[Array, "blob 3"]
    by_sigma: Float[Array, "blob"]
    stiffness: Float[Array, "blob 3 3"]
    sigma_stiffness: Float[Array, "blob"]
    cameras: "SeenByCameras | None"


class SeenByCameras(NamedTuple):
    """What one frame's pictures say, by the moves of the cameras."""

    most: Float[Array, "camera"]
    gradient: Float[Array, "camera 7"]
    curvature: Float[Array, "camera 7 7"]
    mixed: Float[Array, "blob 3 camera 7"]
    """Curvature by the blobs in the world and the moves."""


def shape_rates(shape: ClipShape, params: Float[Array, "shape"]) -> ShapeRates:
    """How points move with the shape, at some shape parameters."""
    lengths = lambda p: (lambda b: ShapeRates(b.skeleton.offsets, b.blobs.offsets, b.blob_sigmas))(shape.shaped(p))
    return jax.jacfwd(lengths)(params)


def frame_model(
    body: Body,
    rates: ShapeRates,
    pose: Float[Array, "dof"],
    views: Views,
    terms: Terms,
    sights: Sights | None = None,
) -> FrameModels:
    """The quadratic model of one frame, with `sights` also by the moves of the cameras.

    `terms` look at `views`, without a history.
    """
    posed, frame = Posed.from_pose(body, pose), Frame(views, History.unknown(pose))
    seen = _seen_by([term for term in terms if isinstance(term, ImageTerm)], posed, frame, sights)
    jacobian = jnp.concatenate([posed.point_jacobian(), blobs_by_shape(body, rates, posed.world_from_joint)], axis=2)
    springs = gauss_newton_model(seen.value, seen.by_mean, seen.stiffness, jacobian)
    dofs = pose.shape[0]
    by_size = rates.blob_sigmas
    gradient = springs.gradient.at[dofs:].add(jnp.matmul(seen.by_sigma, by_size, precision="highest"))
    sizes = jnp.matmul((by_size * seen.sigma_stiffness[:, None]).T, by_size, precision="highest")
    curvature = springs.curvature.at[dofs:, dofs:].add(sizes)
    others = [term.quadratic(posed, frame) for term in terms if not isinstance(term, ImageTerm)]
    model = FrameModels(
        seen.value + sum(model.value for model in others),
        gradient.at[:dofs].add(sum(model.gradient for model in others)),
        curvature.at[:dofs, :dofs].add(sum(model.curvature for model in others)),
    )
    return model if seen.cameras is None else _with_cameras(model, jacobian, seen.cameras)


def _with_cameras(model: FrameModels, jacobian: Float[Array, "blob 3 param"], cameras: SeenByCameras) -> FrameModels:
    """The model with the moves of the cameras as further parameters."""
    flat = jacobian.reshape(-1, jacobian.shape[-1])
    across = jnp.matmul(flat.T, cameras.mixed.reshape(len(flat), -1), precision="highest")
    count = len(cameras.curvature)
    apart = jnp.eye(count, dtype=across.dtype)[:, None, :, None] * cameras.curvature[:, :, None, :]
    own = apart.reshape(count * MOVE, count * MOVE)
    rows = [jnp.concatenate([model.curvature, across], axis=1), jnp.concatenate([across.T, own], axis=1)]
    gradient = jnp.concatenate([model.gradient, cameras.gradient.reshape(-1)])
    return FrameModels(model.value, gradient, jnp.concatenate(rows), cameras.most)


def _seen_by(terms: Sequence[ImageTerm], posed: Posed, frame: Frame, sights: Sights | None) -> SeenBy:
    """The mean over the cameras, in units of the whole picture."""
    cameras, normalizers = frame.views.cameras, frame.views.normalizers

    def projected(means: Float[Array, "blob 3"], sigmas: Float[Array, "blob"]) -> tuple[tuple[Array, Array], Sog]:
        blobs = eqx.tree_at(lambda b: (b.means, b.sigmas), posed.blobs, (means, sigmas))
        seen = jax.vmap(project, in_axes=(0, None))(cameras, blobs) if sights is None else sights.seen(cameras, blobs)
        return (seen.means, seen.sigmas), seen

    _, pull_back, seen = jax.vjp(projected, posed.blobs.means, posed.blobs.sigmas, has_aux=True)
    pulls = weighted_pulls(terms, posed, seen, frame)
    scale = 1.0 / (normalizers * normalizers.shape[0])
    scaled = jax.tree.map(lambda leaf: leaf * scale.reshape(-1, *[1] * (leaf.ndim - 1)), pulls)
    by_mean, by_sigma = pull_back((scaled.by_mean, scaled.by_sigma))
    springs = jnp.where(seen.mask, scaled.stiffness, 0.0)
    if sights is None:
        across = jax.vmap(projection_jacobian, in_axes=(0, None))(cameras, posed.blobs.means)
    else:
        across = sights.across(cameras, posed.blobs.means)
    stiffness = jnp.einsum("cbki,cbkj->bij", across, across * springs[:, :, None, None], precision="highest")
    # A size is held as a place is: by springs in both directions, as far as it is seen enlarged.
    enlarged = seen.sigmas / posed.blobs.sigmas[None, :]
    sigma_stiffness = 2.0 * jnp.sum(springs * enlarged**2, axis=0)
    of_cameras = None if sights is None else _seen_by_cameras(cameras, sights, posed.blobs, scaled, springs, across)
    return SeenBy(jnp.sum(scaled.value), by_mean, by_sigma, stiffness, sigma_stiffness, of_cameras)


def _seen_by_cameras(
    cameras: Camera,
    sights: Sights,
    blobs: Sog,
    pulls: ImagePulls,
    springs: Float[Array, "camera blob"],
    across: Float[Array, "camera blob 2 3"],
) -> SeenByCameras:
    """What each camera sees, before the sum over the cameras."""
    rates = jax.vmap(sight_rates, in_axes=(0, 0, None, None))(cameras, sights.moves, blobs, sights.velocities)
    dot = lambda what, *arrays: jnp.einsum(what, *arrays, precision="highest")
    gradient = dot("cbk,cbkm->cm", pulls.by_mean, rates.means) + dot("cb,cbm->cm", pulls.by_sigma, rates.sigmas)
    held = springs[:, :, None, None] * rates.means
    sized = 2.0 * springs[:, :, None] * rates.sigmas
    curvature = dot("cbkm,cbkn->cmn", held, rates.means) + dot("cbm,cbn->cmn", sized, rates.sigmas)
    return SeenByCameras(_most(pulls, springs), gradient, curvature, dot("cbki,cbkm->bicm", across, held))


def _most(pulls: ImagePulls, springs: Float[Array, "camera blob"]) -> Float[Array, "camera"]:
    """What the springs could gain at most; blobs that hardly any spring holds would move far for nothing."""
    held = springs + LOOSE * jnp.mean(springs, axis=1, keepdims=True) + jnp.finfo(springs.dtype).tiny
    return 0.5 * jnp.sum(jnp.sum(pulls.by_mean**2, axis=-1) / held, axis=1)


def blobs_by_shape(
    body: Body, rates: ShapeRates, world_from_joint: Float[Array, "joint 4 4"]
) -> Float[Array, "blob 3 shape"]:
    """Derivatives of the blobs' means: every joint above a blob carries it along, turned as its parent is."""
    rotations = world_from_joint[:, :3, :3]
    joints = np.array(body.blobs.joints, int)
    parents = np.array(body.skeleton.parents, int)
    unturned = jnp.eye(3, dtype=rotations.dtype)[None]
    of_parents = jnp.where((parents >= 0)[:, None, None], rotations[np.maximum(parents, 0)], unturned)
    moved = jnp.einsum("jab,jbs->jas", of_parents, rates.joint_offsets, precision="highest")
    above = jnp.asarray(ancestor_table(body.skeleton.parents)[joints], rotations.dtype)
    carried = jnp.einsum("nj,jas->nas", above, moved, precision="highest")
    return carried + jnp.einsum("nab,nbs->nas", rotations[joints], rates.blob_offsets, precision="highest")
