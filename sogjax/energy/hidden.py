"""Windows in which what stands in front of a body says nothing of it."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.energy.foreground import grid_rows
from sogjax.energy.views import Windows, odds_on_grid
from sogjax.model.camera import Camera, point_depths, project
from sogjax.model.sog import Sog

WIDER = 1.5
"""Blobs are so much wider where their depths are spread over cells: those beside a body are hidden at its depth."""
LEAST = 1e-3
"""Density of blobs below which the depth of a cell is that of the whole body."""


def without_hidden(
    windows: Windows,
    hidden_from: Float[Array, "camera rows columns"],
    cell_sizes: Float[Array, "camera"],
    cameras: Camera,
    blobs: Sog,
    actors: tuple[int, ...],
) -> Windows:
    """The windows of actors, with odds of 0 in cells that are hidden at the depth that an actor has there.

    `hidden_from` are depths along the camera's axis (metres) from which on cells of the pictures as recorded are
    hidden; `actors` are the numbers of those that the blobs (in the world) belong to.
    """
    numbers = np.array(actors, int)
    own = jnp.asarray(numbers[None, :] == np.arange(windows.odds.shape[1])[:, None])

    def of_camera(windows: Windows, hidden: Array, cell_size: Array, camera: Camera) -> Float[Array, "window _ _"]:
        seen, depths = project(camera, blobs), point_depths(camera, blobs.means)

        def of_window(x: Array, y: Array, step: Array, odds: Array, own: Bool[Array, "blob"]) -> Array:
            from_depth = odds_on_grid(hidden, cell_size, camera, x, y)
            shown = _depths_on_grid(x, y, step, replace(seen, mask=seen.mask & own), depths) < from_depth
            return jnp.where(shown, odds, 0.0)

        return jax.vmap(of_window)(windows.x, windows.y, windows.step, windows.odds, own)

    return replace(windows, odds=jax.vmap(of_camera)(windows, hidden_from, cell_sizes, cameras))


def _depths_on_grid(
    x: Float[Array, "column"],
    y: Float[Array, "row"],
    step: Float[Array, "2"],
    seen: Sog,
    depths: Float[Array, "blob"],
) -> Float[Array, "column row"]:
    """The mean depth of the blobs of one actor around each cell."""
    rows = grid_rows(x, y, step, replace(seen, sigmas=WIDER * seen.sigmas), jnp.ones((), seen.sigmas.dtype))
    count = jnp.maximum(jnp.sum(seen.mask, dtype=depths.dtype), 1.0)
    usual = jnp.sum(jnp.where(seen.mask, depths, 0.0)) / count
    total = jnp.matmul(rows.of_x, rows.of_y.T) + LEAST
    return (jnp.matmul(rows.of_x * depths[None, :], rows.of_y.T) + LEAST * usual) / total
