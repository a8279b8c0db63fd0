"""How far a body covers a silhouette, cell by cell: the soft picture that a body of blobs casts.

In the terms of Eq. 8: a cell of the picture is an image blob, and the body covers it where the sum of the overlaps
reaches the cap. Eq. 9 counts that sum up to the cap, so it hardly tells where the edge of the body is; here the sum
goes through a step at the cap, so that the edge of the body is compared with the edge of the mask.
"""

from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.energy.overlap import EXACT_EXPONENT, overlaps, self_overlaps
from sogjax.model.body import Body
from sogjax.model.camera import Camera, distort, project
from sogjax.model.compiled import stage_barrier
from sogjax.model.program import compiled
from sogjax.model.sog import Sog
from sogjax.scene.background_difference import reduced_mask
from sogjax.scene.visual_hull import resized

SHARPNESS = 4.0
"""Power of the step: covered = t^4 / (1 + t^4) where the overlaps are t times the cap. At t = 1 the body's Gaussians
sum up to a half, which is where a body file counts a picture as body."""
SMALLEST = 1e-6


class Silhouettes(eqx.Module):
    """The masks of one pose as cells of equal size, for each camera; cameras without a mask have no cells."""

    cameras: Camera
    means: Float[Array, "*pose camera cell 2"]
    """Centres in undistorted pixels."""
    sigmas: Float[Array, "*pose camera cell"]
    """Half the side of a cell, pixels."""
    coverage: Float[Array, "*pose camera cell"]
    """Part of the cell that the mask covers."""
    mask: Bool[Array, "*pose camera cell"]


class NormalEquations(NamedTuple):
    """A sum of squares, half its gradient, and its Gauss-Newton matrix by some parameters."""

    value: Float[Array, ""]
    gradient: Float[Array, "param"]
    matrix: Float[Array, "param param"]


def mismatch(blobs: Float[Array, "blob 4"], silhouettes: Silhouettes) -> Float[Array, ""]:
    """Mean over the cameras of the squared difference of coverages, as a part of the mask's area.

    `blobs` are means and sigmas in the world (metres).
    """
    return mismatch_of(times_cap(_blobs(blobs), silhouettes), silhouettes)


def times_cap(blobs: Sog, silhouettes: Silhouettes) -> Float[Array, "camera cell"]:
    """How often blobs of a body (metres, world) together fill the cap of each cell; masked ones fill nothing."""
    of_camera = lambda camera, *cells: jnp.sum(_fills(project(camera, blobs), *cells), axis=0)
    return jax.vmap(of_camera)(silhouettes.cameras, silhouettes.means, silhouettes.sigmas)


def _fills(seen: Sog, means: Float[Array, "cell 2"], sigmas: Float[Array, "cell"]) -> Float[Array, "blob cell"]:
    """E_ij / E_ii of Eq. 6: how often each of the projected blobs alone fills the cap of a cell."""
    cells = _blobs(jnp.column_stack([means, sigmas]))
    same_color = jnp.ones((seen.capacity, cells.capacity), sigmas.dtype)
    return overlaps(cells, seen, same_color, jnp.asarray(EXACT_EXPONENT, sigmas.dtype)) / self_overlaps(cells)[None]


def _blobs(rows: Float[Array, "blob dim_and_1"]) -> Sog:
    """Means and sigmas of blobs, one after the other, as a Sog without colours."""
    means = rows[:, :-1]
    return Sog.from_arrays(means, rows[:, -1], jnp.zeros((len(means), 3), means.dtype))


def mismatch_of(times_cap: Float[Array, "camera cell"], silhouettes: Silhouettes) -> Float[Array, ""]:
    """`mismatch` of a body, or of parts that together fill the cap of each cell so often."""
    weights = jax.vmap(_cell_weights)(silhouettes.coverage, silhouettes.mask)
    difference = jax.vmap(jax.vmap(_covered))(times_cap) - silhouettes.coverage
    return jnp.sum(weights * difference**2) / _num_seen(silhouettes)


def mismatch_equations(
    blobs: Float[Array, "blob 4"], jacobian: Float[Array, "blob 4 param"], silhouettes: Silhouettes
) -> NormalEquations:
    """`mismatch` with its derivatives, given those of the blobs.

    One camera after the other: the pairs of one stay in the cache. A camera without cells costs nothing; the barrier
    has the cells of the others copied before their pairs are computed, which takes a quarter of the time of pairs that
    look each up among those of all cameras.
    """
    of_camera = partial(_camera_equations, blobs, jacobian)
    if_seen = lambda camera: stage_barrier(jnp.any(camera[-1]), of_camera, *camera)
    parts = jax.lax.map(if_seen, _by_camera(silhouettes))
    return jax.tree.map(lambda part: jnp.sum(part, axis=0) / _num_seen(silhouettes), parts)


def _by_camera(silhouettes: Silhouettes) -> tuple[Camera, Array, Array, Array, Array]:
    s = silhouettes
    return s.cameras, s.means, s.sigmas, s.coverage, s.mask


def _num_seen(silhouettes: Silhouettes) -> Float[Array, ""]:
    seen = jnp.any(silhouettes.mask, axis=-1)
    return jnp.maximum(jnp.sum(seen), 1).astype(silhouettes.sigmas.dtype)


def _covered(times_cap: Float[Array, ""]) -> Float[Array, ""]:
    power = jnp.maximum(times_cap, SMALLEST) ** SHARPNESS
    return power / (1.0 + power)


def _cell_weights(coverage: Float[Array, "cell"], mask: Bool[Array, "cell"]) -> Float[Array, "cell"]:
    area = jnp.maximum(jnp.sum(jnp.where(mask, coverage, 0.0)), 1.0)
    return jnp.where(mask, 1.0, 0.0) / area


def _camera_equations(blobs, jacobian, camera, means, sigmas, coverage, mask) -> NormalEquations:
    """One camera's part: first by what is seen of the blobs (mean and sigma, pixels), then by the parameters.

    What a blob fills depends on no other blob, so three derivatives, each along the same direction of all blobs, are
    those of all pairs.
    """

    def seen_rows(blobs: Float[Array, "blob 4"]) -> Float[Array, "blob 3"]:
        seen = project(camera, _blobs(blobs))
        return jnp.column_stack([seen.means, seen.sigmas])

    seen = project(camera, _blobs(blobs))
    fills = lambda *rows: _fills(
        eqx.tree_at(lambda s: (s.means, s.sigmas), seen, (jnp.stack(rows[:2], axis=1), rows[2])), means, sigmas
    )
    rows = (*seen.means.T, seen.sigmas)
    along = [tuple(jnp.full_like(row, j == k) for j, row in enumerate(rows)) for k in range(len(rows))]
    slopes = jnp.stack([jax.jvp(fills, rows, direction)[1] for direction in along], axis=1)
    covered, steepness = jax.vmap(jax.value_and_grad(_covered))(jnp.sum(fills(*rows), axis=0))
    weights = _cell_weights(coverage, mask)
    by_seen = (slopes * steepness[None, None]).reshape(-1, means.shape[0])
    of_one = lambda blob: seen_rows(blob[None])[0]
    projection = jax.vmap(jax.jacfwd(of_one))(blobs)
    chain = jnp.einsum("bij,bjp->bip", projection, jacobian, precision="highest").reshape(-1, jacobian.shape[-1])
    difference = covered - coverage
    product = lambda a, b: jnp.matmul(a, b, precision="highest")
    by_param = product(chain.T, by_seen)
    gradient, matrix = product(by_param, weights * difference), product(by_param * weights[None, :], by_param.T)
    return NormalEquations(jnp.sum(weights * difference**2), gradient, matrix)


BODY_LEVEL = 0.5
"""Where the sum of the projected Gaussians is above this, the picture shows body: the sizes in body files mean that."""


def silhouette_iou(
    body: Body,
    pose: Float[Array, "dof"],
    camera: Camera,
    mask: Bool[np.ndarray, "height width"],
    untold: Bool[np.ndarray, "height width"] | None = None,
) -> float:
    """Intersection over union of the body's silhouette and a mask of the camera's picture, as recorded.

    Where the mask is `untold`, nothing counts.
    """
    small = reduced_mask(mask)
    shown = body_silhouette(body, pose, camera, small.shape)
    return overlap_ratio(shown if untold is None else shown & ~reduced_mask(untold), small)


def overlap_ratio(first: Bool[np.ndarray, "rows columns"], second: Bool[np.ndarray, "rows columns"]) -> float:
    """Intersection over union; 0 where both are empty."""
    return float((first & second).sum() / max((first | second).sum(), 1))


def body_silhouette(
    body: Body, pose: Float[Array, "dof"], camera: Camera, shape: tuple[int, int]
) -> Bool[np.ndarray, "rows columns"]:
    """Where the body is visible in the camera's picture as recorded, resized to (rows, columns)."""
    return np.asarray(_coverage(body, pose, resized(camera, (shape[1], shape[0])), shape)) > BODY_LEVEL


@compiled
def _coverage(
    body: Body, pose: Float[Array, "dof"], camera: Camera, shape: tuple[int, int]
) -> Float[Array, "rows columns"]:
    """The sum of the projected Gaussians; each is a product of one along the rows and one along the columns."""
    seen = project(camera, body.posed_blobs(pose))
    means = distort(camera, seen.means)
    along = lambda axis, count: jnp.exp(
        -0.5 * ((jnp.arange(count, dtype=means.dtype)[None, :] - means[:, axis, None]) / seen.sigmas[:, None]) ** 2
    )
    rows, columns = along(1, shape[0]), along(0, shape[1])
    return jnp.matmul(jnp.where(seen.mask[:, None], rows, 0.0).T, columns, precision="highest")
