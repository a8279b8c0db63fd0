"""Cameras that stand a little elsewhere than their calibration says, and see a little earlier or later."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from sogjax.model.camera import Camera, project, projection_jacobian
from sogjax.model.rotation import cross_matrix
from sogjax.model.sog import Sog
from sogjax.refine.clip_priors import step_of

TURN, PLACE, TIME = slice(0, 3), slice(3, 6), slice(6, 7)
MOVE = 7
"""Numbers of a move: a rotation vector (radians), the way of the centre (metres), both along the axes of the camera as
it was calibrated, and by how many frames what it sees is later than its frame's number says."""
SPREAD = np.array([np.deg2rad(0.3)] * 3 + [0.01] * 3 + [1.0])
"""Expected deviation of each."""
LARGEST_STEP = np.array([0.01] * 3 + [0.03] * 3 + [0.3])
"""The largest step of one iteration."""


def moved_camera(camera: Camera, move: Float[Array, "7"]) -> Camera:
    """The camera turned about its centre, which is then moved."""
    turned = jnp.matmul(_rotation(move[TURN]).T, camera.camera_from_world[:3, :3], precision="highest")
    offset = jnp.matmul(_rotation(move[TURN]).T, camera.camera_from_world[:3, 3] - move[PLACE], precision="highest")
    pose = camera.camera_from_world.at[:3, :3].set(turned).at[:3, 3].set(offset)
    return eqx.tree_at(lambda c: c.camera_from_world, camera, pose)


moved_cameras = jax.vmap(moved_camera)
"""Cameras of a stack, each moved by its own numbers."""


def seen_after(camera: Camera, move: Float[Array, "7"], blobs: Sog, velocities: Float[Array, "blob 3"]) -> Sog:
    """What a moved camera sees of blobs (world) that move on by `velocities` (metres a frame)."""
    later = eqx.tree_at(lambda b: b.means, blobs, blobs.means + move[None, TIME] * velocities)
    return project(moved_camera(camera, move), later)


class Sights(eqx.Module):
    """How all cameras see a frame."""

    moves: Float[Array, "camera 7"]
    velocities: Float[Array, "*frame blob 3"]
    """Metres a frame; with a leading axis those of several frames."""

    def seen(self, cameras: Camera, blobs: Sog) -> Sog:
        """What each camera sees of blobs (world)."""
        return jax.vmap(seen_after, in_axes=(0, 0, None, None))(cameras, self.moves, blobs, self.velocities)

    def across(self, cameras: Camera, means: Float[Array, "blob 3"]) -> Float[Array, "camera blob 2 3"]:
        """Derivatives of what is seen by where the blobs are (pixels per metre)."""
        later = means[None] + self.moves[:, None, TIME] * self.velocities[None]
        return jax.vmap(projection_jacobian)(moved_cameras(cameras, self.moves), later)


class SightRates(eqx.Module):
    """How what a camera sees changes with its move."""

    means: Float[Array, "*camera blob 2 7"]
    sigmas: Float[Array, "*camera blob 7"]


def sight_rates(camera: Camera, move: Float[Array, "7"], blobs: Sog, velocities: Float[Array, "blob 3"]) -> SightRates:
    """Derivatives of `seen_after`."""

    def places(move: Float[Array, "7"]) -> tuple[Array, Array]:
        seen = seen_after(camera, move, blobs, velocities)
        return seen.means, seen.sigmas

    return SightRates(*jax.jacfwd(places)(move))


def velocities_of(
    means: Float[np.ndarray, "frame blob 3"], frames: Int[np.ndarray, "frame"]
) -> Float[np.ndarray, "frame blob 3"]:
    """How fast the blobs of a clip move (metres by a frame's number), from the frames before and after.

    0 where neither is known.
    """
    step = step_of(frames)
    steps = np.diff(means, axis=0) / step
    follows = (np.diff(frames) == step).astype(float)[:, None, None]
    total, count = np.zeros_like(means), np.zeros((len(means), 1, 1))
    for part in (slice(1, None), slice(None, -1)):
        total[part] += follows * steps
        count[part] += follows
    return total / np.maximum(count, 1.0)


def _rotation(vector: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Rodrigues' formula, with its derivatives at 0."""
    squared = jnp.sum(vector * vector)
    small = squared < 1e-8
    angle = jnp.sqrt(jnp.where(small, 1.0, squared))
    first = jnp.where(small, 1.0 - squared / 6.0, jnp.sin(angle) / angle)
    second = jnp.where(small, 0.5 - squared / 24.0, (1.0 - jnp.cos(angle)) / angle**2)
    cross = cross_matrix(vector)
    return jnp.eye(3, dtype=vector.dtype) + first * cross + second * jnp.matmul(cross, cross, precision="highest")
