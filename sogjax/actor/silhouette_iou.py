"""The silhouette that a body casts, and how well it covers a mask."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.images.plate_difference import reduced_mask
from sogjax.images.visual_hull import resized
from sogjax.model.body import Body
from sogjax.model.camera import Camera, distort, project

BODY_LEVEL = 0.5
"""Where the sum of the projected Gaussians is above this, the picture shows body: the sizes in body files mean that."""


def silhouette_iou(
    body: Body, pose: Float[Array, "dof"], camera: Camera, mask: Bool[np.ndarray, "height width"]
) -> float:
    """Intersection over union of the body's silhouette and a mask of the camera's picture, as recorded."""
    small = reduced_mask(mask)
    return overlap_ratio(body_silhouette(body, pose, camera, small.shape), small)


def overlap_ratio(first: Bool[np.ndarray, "rows columns"], second: Bool[np.ndarray, "rows columns"]) -> float:
    """Intersection over union; 0 where both are empty."""
    return float((first & second).sum() / max((first | second).sum(), 1))


def body_silhouette(
    body: Body, pose: Float[Array, "dof"], camera: Camera, shape: tuple[int, int]
) -> Bool[np.ndarray, "rows columns"]:
    """Where the body is visible in the camera's picture as recorded, resized to (rows, columns)."""
    return np.asarray(_coverage(body, pose, resized(camera, (shape[1], shape[0])), shape)) > BODY_LEVEL


@eqx.filter_jit
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
