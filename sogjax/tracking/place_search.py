"""Where a body may stand in one frame: places whose colours are the body's, in all cameras together."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.energy.similarity import Similarity, similarity_among
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.model.body import Body
from sogjax.model.camera import Camera, distort, project_points
from sogjax.model.frames import axis_vector
from sogjax.model.sog import Sog

NUM_SLICES = 5
"""A body standing at a place is a stack of so many blobs, which says nothing of its heading or pose."""
SPACING = 0.25
"""Metres between places."""
REACH = 0.6
"""How far from the middle of the cameras places are looked for, as a part of the cameras' distance from it."""
HEIGHTS = 1.5
"""Metres above and below the middle of the cameras."""
SEEN_BY = 0.75
"""Part of the cameras that must see a place. A body close to one camera fills its picture with whatever matches."""
APART = 0.4
"""Metres between places that count as different."""


class Slices(eqx.Module):
    """A body cut across its vertical: blobs that take on the colours of all that lies in them."""

    offsets: Float[Array, "slice 3"]
    """Metres, from the body's root."""
    sigmas: Float[Array, "slice"]
    members: Bool[Array, "slice blob"]

    @classmethod
    def from_body(cls, body: Body, root: Float[np.ndarray, "3"], up: str) -> "Slices":
        """Slices of the rest pose, whose root is at `root`, with as many blobs in each."""
        blobs = jax.jit(Body.posed_blobs)(body, body.poses["rest"])
        means, sigmas = np.asarray(blobs.means, float), np.asarray(blobs.sigmas, float)
        parts = np.array_split(np.argsort(means @ axis_vector(up)), min(NUM_SLICES, len(means)))
        centre = means.mean(axis=0)
        vertical = axis_vector(up)
        on_axis = lambda point: centre + vertical * float((point - centre) @ vertical) - root
        # As large in a picture as its blobs side by side, within what a slice of that height can be.
        size = lambda part: float(np.sqrt(np.sum(sigmas[part] ** 2)))
        members = np.array([np.isin(np.arange(len(means)), part) for part in parts])
        dtype = body.blob_sigmas.dtype
        return cls(
            jnp.asarray([on_axis(means[part].mean(axis=0)) for part in parts], dtype),
            jnp.asarray([size(part) for part in parts], dtype),
            jnp.asarray(members),
        )

    def views(self, views: Views) -> Views:
        """What the cameras see, each image blob resembling a slice as much as the slice's most similar blob."""
        by_slice = jnp.max(
            jnp.where(self.members[None, :, :, None], views.color_similarities[:, None, :, :], 0.0), axis=2
        )
        return eqx.tree_at(lambda v: v.color_similarities, views, by_slice)


def possible_places(cameras: Camera, up: str) -> Float[np.ndarray, "place 3"]:
    """A grid of places (metres, world) that enough cameras see."""
    world = np.asarray(cameras.camera_from_world, float)
    centres = -np.einsum("cji,cj->ci", world[:, :3, :3], world[:, :3, 3])
    middle = nearest_point(centres, world[:, 2, :3])
    distance = float(np.median(np.linalg.norm(centres - middle, axis=1)))
    reach = max(REACH * distance, 2.0 * SPACING)
    vertical = np.abs(axis_vector(up))
    extent = np.where(vertical > 0.5, min(HEIGHTS, reach), reach)
    axes = [np.arange(-n, n + 1) * SPACING for n in np.ceil(extent / SPACING).astype(int)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3) + middle
    return grid[np.asarray(well_seen(cameras, jnp.asarray(grid, cameras.intrinsics.dtype)))]


def nearest_point(
    points: Float[np.ndarray, "line 3"], directions: Float[np.ndarray, "line 3"]
) -> Float[np.ndarray, "3"]:
    """The point nearest to lines; where all are parallel, the one of them nearest to the lines' points."""
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    across = np.eye(3)[None] - directions[:, :, None] * directions[:, None, :]
    return np.linalg.lstsq(across.sum(axis=0), np.einsum("lij,lj->i", across, points), rcond=1e-9)[0]


@eqx.filter_jit
def well_seen(cameras: Camera, points: Float[Array, "place 3"]) -> Bool[Array, "place"]:
    """Whether enough cameras have a place in their picture."""

    def inside(camera: Camera) -> Bool[Array, "place"]:
        pixels, depth = project_points(camera, points)
        if camera.fisheye is not None:  # whose undistorted picture is much larger than the one it recorded
            pixels = jnp.where(camera.fisheye, distort(camera, pixels), pixels)
        within = jnp.all((pixels > 0.0) & (pixels < camera.image_size[None, :]), axis=-1)
        return within & (depth > 0.0)

    part = jnp.mean(jax.vmap(inside)(cameras).astype(points.dtype), axis=0)
    return part >= SEEN_BY - 1e-3


def best_places(
    slices: Slices, views: Views, places: Float[np.ndarray, "place 3"], terms: Terms, count: int
) -> Float[np.ndarray, "best 3"]:
    """The places of the highest similarity (Eq. 9) of the slices, `APART` from each other, best first."""
    on_device = jnp.asarray(places, slices.sigmas.dtype)
    scores = np.asarray(_scores(slices, slices.views(views), on_device, similarity_among(terms)))
    left, best = np.argsort(-scores), []
    while len(left) and len(best) < count:
        best.append(left[0])
        left = left[np.linalg.norm(places[left] - places[left[0]], axis=1) >= APART]
    return places[best]


@eqx.filter_jit
def _scores(slices: Slices, views: Views, places: Float[Array, "place 3"], similarity: Similarity) -> Array:
    mask = jnp.ones(slices.sigmas.shape[0], bool)

    def score(place: Float[Array, "3"]) -> Float[Array, ""]:
        means = slices.offsets + place[None, :]
        return similarity.of_blobs(Sog(means, slices.sigmas, jnp.zeros_like(means), mask), views)

    return jax.lax.map(score, places, batch_size=16)
