"""What the cameras see in one frame, as searches take it: what each cluster of blobs would explain, by cell."""

from collections.abc import Sequence
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, UInt8

from sogjax.energy.appearance import ColorWindows
from sogjax.energy.views import odds_on_grid
from sogjax.model.body import Body
from sogjax.model.camera import Camera, point_depths, project, project_points
from sogjax.model.program import compiled
from sogjax.model.sog import Sog
from sogjax.scene.cells import inside_pictures
from sogjax.scene.color_clusters import ColorClusters, cluster_odds
from sogjax.scene.foreground import BackgroundModel
from sogjax.tracking.culling import ImageReader

SIDE = 40
"""Cells of a window in each direction."""
FREE_SPACE = 0.4
"""What the odds of a cell count that is rather background: a limb that is a little beside its place must not lose more
than one that hides in the trunk."""
SOMEBODY = 0.5
"""The odds, at most, of a cell that is not the background and has none of an actor's colours: it may be somebody else.
With `LARGEST`, an actor fits a bystander as well as himself."""
COVERED = 2.0
"""Density of what hides the background, as in the foreground term."""


class SeenFrame(eqx.Module):
    """The cells of one frame, compared with the colours of one body."""

    cameras: Camera
    odds: Float[Array, "camera cluster rows columns"]
    """Log odds of each cluster of blobs against the background; the last cluster is the body as a whole."""
    cell_sizes: Float[Array, "camera"]
    known: Float[Array, "camera rows columns"]
    """1 for cells whose background is known, -1 for others, 0 where nothing is seen."""
    found: tuple[Sog, ...] = ()
    """Blobs in the world of actors that were found: what they cover is theirs."""
    hidden_from: Float[Array, "camera rows columns"] | None = None
    """Depth from which on cells are hidden by what stands in front (metres); None: nothing does."""

    @classmethod
    def from_cells(
        cls,
        cameras: Camera,
        reader: ImageReader,
        cells: UInt8[np.ndarray | Array, "camera rows columns 3"],
        clusters: ColorClusters,
        present: Sequence[bool] | None = None,
    ) -> "SeenFrame":
        """The frame as a reader of pictures understands it; without a background, if the reader has none.

        A camera that is not `present` (None: all are) says nothing.
        """
        dtype = cameras.intrinsics.dtype
        tables = jnp.asarray(np.concatenate([clusters.tables, clusters.whole[None]]), dtype)
        grids = reader.candidates.grids
        inside = inside_pictures(grids, cells.shape[1:3])
        if present is not None:
            inside[~np.array(present, bool)] = 0.0
        hidden = None if reader.occluders is None else reader.occluders.cells
        if hidden is not None:
            inside[np.asarray(hidden) == 0.0] = 0.0
        odds = _odds(jnp.asarray(cells), jnp.asarray(inside), reader.background, tables)
        known = np.zeros(inside.shape) if reader.background is None else np.asarray(reader.background.known)
        sizes = jnp.asarray([grid.cell_size for grid in grids], dtype)
        return cls(cameras, odds, sizes, jnp.asarray((2.0 * known - 1.0) * inside, dtype), hidden_from=hidden)

    def windows(self, centre: Float[Array, "3"], radius: Float[Array, ""]) -> ColorWindows:
        """Grids around a ball (metres, world)."""
        boxes = self._around(centre, radius)
        windows = ColorWindows.in_boxes(self.odds[:, :-1], self.cell_sizes, self.cameras, boxes, (SIDE, SIDE))
        odds = jnp.where(windows.odds < 0.0, FREE_SPACE * windows.odds, windows.odds)
        windows = replace(windows, odds=odds, scale=0.5 * (boxes[:, 1, 0] - boxes[:, 0, 0]) / radius)
        if self.hidden_from is not None:
            depths = jax.vmap(lambda camera: point_depths(camera, centre[None])[0])(self.cameras)
            from_depth = jax.vmap(odds_on_grid)(self.hidden_from, self.cell_sizes, self.cameras, windows.x, windows.y)
            shown = (depths[:, None, None] < from_depth).astype(windows.free.dtype)
            windows = replace(windows, free=shown, odds=windows.odds * shown[:, None])
        return replace(windows, free=self._free(windows))

    def _around(self, centre: Float[Array, "3"], radius: Float[Array, ""]) -> Float[Array, "camera 2 2"]:
        """Boxes (lowest and highest x, y in undistorted pixels) around a ball."""

        def box(camera: Camera) -> Float[Array, "2 2"]:
            pixels, depth = project_points(camera, centre[None])
            reach = radius * camera.focal_length / jnp.maximum(depth[0], radius)
            return jnp.stack([pixels[0] - reach, pixels[0] + reach])

        return jax.vmap(box)(self.cameras)

    def _free(self, windows: ColorWindows) -> Float[Array, "camera column row"]:
        """1 less what the found actors cover."""
        free = windows.free
        for blobs in self.found:
            seen = jax.vmap(project, in_axes=(0, None))(self.cameras, blobs)
            dx = windows.x[:, :, None] - seen.means[:, None, :, 0]
            dy = windows.y[:, :, None] - seen.means[:, None, :, 1]
            variance = seen.sigmas[:, None, :] ** 2
            of_x = jnp.where(seen.mask[:, None, :], COVERED * jnp.exp(-0.5 * dx * dx / variance), 0.0)
            free = free * jnp.exp(-jnp.einsum("cxb,cyb->cxy", of_x, jnp.exp(-0.5 * dy * dy / variance)))
        return free

    def with_found(self, body: Body, pose: Float[np.ndarray | Array, "dof"]) -> "SeenFrame":
        """This frame, with one more actor found."""
        blobs = _posed(body, jnp.asarray(pose))
        return eqx.tree_at(lambda f: f.found, self, (*self.found, blobs), is_leaf=_is_tuple)

    @property
    def whole(self) -> Float[Array, "camera rows columns"]:
        """Log odds of the body as a whole against the background."""
        return self.odds[:, -1]


_posed = compiled(Body.posed_blobs)


def _is_tuple(value: object) -> bool:
    return isinstance(value, tuple)


@compiled
def _odds(cells: Array, inside: Array, background: BackgroundModel | None, tables: Array) -> Array:
    return cluster_odds(cells.astype(tables.dtype) / 255.0, inside.astype(tables.dtype), background, tables, SOMEBODY)
