"""The compiled programs behind the energy of a clip: one frame after the other, in single precision."""

from dataclasses import replace

import jax
from jaxtyping import Array, Float

from sogjax.energy.appearance import Appearance, ColorWindows
from sogjax.energy.foreground import Foreground
from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.neighbours import displaced, margins
from sogjax.energy.pairs import SparsePairs
from sogjax.energy.posed import History
from sogjax.energy.priors import RestPenalty
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.model.body import Body
from sogjax.model.camera import Camera, project
from sogjax.model.program import compiled
from sogjax.model.sog import Sog
from sogjax.refine.camera_moves import Sights, moved_cameras
from sogjax.refine.clip_shape import ClipShape
from sogjax.refine.frame_models import FrameModels, blobs_by_shape, frame_model, shape_rates
from sogjax.refine.pictures import ClipPictures

moved_in_frames = compiled(jax.vmap(moved_cameras, in_axes=(0, None)))
"""The cameras of every frame, moved."""


@compiled
def shaped(shape: ClipShape, params: Float[Array, "shape"]) -> Body:
    """The body with some shape parameters."""
    return shape.shaped(params)


@compiled
def moving_blobs(
    shape: ClipShape, params: Float[Array, "shape"], poses: Float[Array, "frame dof"]
) -> tuple[Array, ...]:
    """What `MovingBlobs` has."""
    body, rates = shape.shaped(params), shape_rates(shape, params)

    def one(pose: Array) -> tuple[Array, Array, Array]:
        frames = body.skeleton.world_from_joint(pose)
        means = body.blobs.points_world(frames)
        by_pose = body.skeleton.point_jacobian(frames, body.blobs.joints, means)
        return means, by_pose, blobs_by_shape(body, rates, frames)

    return (*jax.lax.map(one, poses), body.blob_sigmas, rates.blob_sigmas)


@compiled
def frame_models(
    shape: ClipShape,
    params: Float[Array, "shape"],
    terms: Terms,
    pictures: ClipPictures,
    pairs: SparsePairs,
    poses: Float[Array, "frame dof"],
    appearance: Float[Array, ""],
    rest: RestPenalty,
    sights: Sights | None,
) -> FrameModels:
    """Models of all frames; with `sights` also by the moves of the cameras."""
    body, rates = shape.shaped(params), shape_rates(shape, params)

    def one(frame: tuple[Views, ColorWindows, SparsePairs, Array, Array | None]) -> FrameModels:
        views, windows, near, pose, velocities = frame
        sight = None if sights is None or velocities is None else Sights(sights.moves, velocities)
        added = (Appearance(appearance, windows, pictures.clusters), rest)
        # The foreground's part is in the appearance already, rest has a weight of its own.
        kept = [term for term in terms if not isinstance(term, Foreground | RestPenalty)]
        return frame_model(body, rates, pose, replace(views, pairs=near), (*kept, *added), sight)

    velocities = None if sights is None else sights.velocities
    return jax.lax.map(one, (pictures.views, pictures.windows, pairs, poses, velocities))


@compiled
def term_values(
    body: Body, terms: Terms, views: Views, pairs: SparsePairs, poses: Float[Array, "frame dof"]
) -> dict[str, Float[Array, "frame"]]:
    """The value of each term in every frame, without its weight and without a history."""

    def one(frame: tuple[Views, SparsePairs, Array]) -> dict[str, Float[Array, ""]]:
        seen, near, pose = frame
        return FrameEnergy(body, replace(seen, pairs=near), History.unknown(pose), terms).values(pose)

    return jax.lax.map(one, (views, pairs, poses))


@compiled
def moved_in_pictures(
    cameras: Camera, bodies: tuple[Body, Body], sights: tuple[Sights | None, Sights | None], poses: tuple[Array, Array]
) -> Float[Array, "frame"]:
    """How far blobs have moved in any picture of each frame, in units of the margin within which pairs hold."""

    def seen(body: Body, sight: Sights | None, poses: Array) -> Sog:
        def one(frame: tuple[Array, Array | None]) -> Sog:
            pose, velocities = frame
            blobs = body.posed_blobs(pose)
            if sight is None or velocities is None:
                return jax.vmap(project, in_axes=(0, None))(cameras, blobs)
            return Sights(sight.moves, velocities).seen(cameras, blobs)

        return jax.lax.map(one, (poses, None if sight is None else sight.velocities))

    before, after = (seen(*each) for each in zip(bodies, sights, poses, strict=True))
    return jax.vmap(displaced, in_axes=(0, 0, None))(before, after, margins(cameras))
