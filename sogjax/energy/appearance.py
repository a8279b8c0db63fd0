"""How well a body explains what is seen around it, by colours and background, with what is in front seen first.

For searches: grids around a place, on which a body in any pose there is compared with the pictures in a few matrix
products, whatever its distance from the truth.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.foreground import GridRows, grid_rows
from sogjax.energy.image_term import ImageTerm
from sogjax.energy.overlap import ImagePulls
from sogjax.energy.posed import Frame, Posed
from sogjax.energy.views import odds_on_grid
from sogjax.model.camera import Camera, project
from sogjax.model.sog import Sog

Result = TypeVar("Result")

SAMPLES = 2
"""Places along each side of a window's cell at which the picture is looked at."""
DEPTH_SCALE = 0.06
"""Metres: a blob that much nearer to a camera than another counts e times as much where both lie."""


class ColorWindows(eqx.Module):
    """A grid in each camera, undistorted pixels, and what each cluster of blobs would explain of its cells."""

    x: Float[Array, "*camera column"]
    """Centres of the cells."""
    y: Float[Array, "*camera row"]
    step: Float[Array, "*camera 2"]
    """Width and height of a cell."""
    odds: Float[Array, "*camera cluster column row"]
    """Log odds of a cluster of blobs against the background; 0 where nothing is known."""
    free: Float[Array, "*camera column row"]
    """1 where a body may gain and lose; 0 where another one is seen."""

    scale: Float[Array, "*camera"]
    """Pixels for each metre at the middle of the grid."""

    @property
    def areas(self) -> Float[Array, "*camera"]:
        """E_ii of Eq. 8 of a cell: (pi/4) times its area."""
        return jnp.pi / 4.0 * self.step[..., 0] * self.step[..., 1]

    @classmethod
    def in_boxes(
        cls,
        odds: Float[Array, "camera cluster rows columns"],
        cell_sizes: Float[Array, "camera"],
        cameras: Camera,
        boxes: Float[Array, "camera 2 2"],
        size: tuple[int, int],
    ) -> "ColorWindows":
        """Grids of `size` (columns, rows) that fill boxes, in which a body may gain and lose everywhere.

        Each cell of a grid is the mean of `SAMPLES` times as many places in each direction, of which the cell of the
        picture tells the log odds. `boxes` are the lowest and highest x, y; the scale is 1 everywhere.
        """
        step = (boxes[:, 1] - boxes[:, 0]) / jnp.array([size], boxes.dtype)

        def along(axis: int, parts: int) -> Float[Array, "camera n"]:
            places = (jnp.arange(size[axis] * parts, dtype=boxes.dtype) + 0.5) / parts
            return boxes[:, 0, axis, None] + places[None] * step[:, axis, None]

        seen = jax.vmap(odds_on_grid)(odds, cell_sizes, cameras, along(0, SAMPLES), along(1, SAMPLES))
        split = seen.reshape(*seen.shape[:2], size[0], SAMPLES, size[1], SAMPLES)
        free, scale = jnp.ones((len(boxes), *size), boxes.dtype), jnp.ones(len(boxes), boxes.dtype)
        return cls(along(0, 1), along(1, 1), step, jnp.mean(split, axis=(3, 5)), free, scale)


class BlobClusters(eqx.Module):
    """Blobs of like colour, as arrays of one shape for all actors: a large cluster is several."""

    members: Int[Array, "cluster slot"]
    """Blobs of each cluster."""
    real: Float[Array, "cluster slot"]
    """1, and 0 for padding."""
    slots: Int[Array, "blob"]
    """Where each blob is among the members."""

    @classmethod
    def from_members(cls, members: Sequence[Sequence[int]], num_slots: int) -> "BlobClusters":
        """From the blobs of each cluster, at most `num_slots`; every blob is in one."""
        table, real = np.zeros((len(members), num_slots), int), np.zeros((len(members), num_slots))
        slots = np.zeros(sum(map(len, members)), int)
        for k, part in enumerate(members):
            table[k, : len(part)], real[k, : len(part)] = part, 1.0
            slots[list(part)] = k * num_slots + np.arange(len(part))
        return cls(jnp.asarray(table), jnp.asarray(real, jnp.result_type(float)), jnp.asarray(slots))

    def grouped(self, values: Float[Array, "n blob"]) -> Float[Array, "cluster n slot"]:
        """Values of the blobs by cluster; 0 in the padding."""
        return jnp.swapaxes(values[:, self.members] * self.real[None], 0, 1)

    def spread(self, values: Float[Array, "cluster n slot"]) -> Float[Array, "n blob"]:
        """Values by cluster for the blobs in their order."""
        return jnp.swapaxes(values, 0, 1).reshape(values.shape[1], -1)[:, self.slots]


class Appearance(ImageTerm):
    """Log likelihood of the cells with the body before them, less that of the background alone.

    A cell is covered by `C = 1 - exp(-sum_q A_q)`, and what is seen there is shared by the clusters of blobs as their
    densities are, the nearer ones before those behind: `sum_i a_i log(1 - C_i + C_i sum_k share_ik odds_ik)`, the mean
    over the cameras, in units of the whole picture as in Eq. 9.
    """

    windows: ColorWindows
    clusters: BlobClusters
    density: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=2.0)
    """A_q in the middle of a blob, as in the foreground term."""
    counted: Bool[Array, "camera"] | None = None
    """The cameras that say anything, one after the other; None: all do, at once."""

    def value(self, posed: Posed, frame: Frame) -> Float[Array, ""]:
        """The value for the posed blobs."""
        cameras = frame.views.cameras
        seen = jax.vmap(project, in_axes=(0, None))(cameras, posed.blobs)
        nearness = _nearness(posed.blobs, seen, cameras.focal_length)
        of_camera = lambda windows, seen, near: _value(self._maps(windows, seen, near)[1], windows)
        return jnp.mean(self._of_each(of_camera, seen, nearness) / frame.views.normalizers)

    def pulls(self, posed: Posed, seen: Sog, frame: Frame) -> ImagePulls:
        """Gradient in closed form, who is in front taken as it is; springs where more cover is wanted."""
        nearness = _nearness(posed.blobs, seen, frame.views.cameras.focal_length)
        return self._of_each(self._pulls, seen, nearness)

    def _of_each(self, function: Callable[..., Result], seen: Sog, nearness: Float[Array, "camera blob"]) -> Result:
        """What a function makes of each camera; 0 of those that do not count."""
        given = self.windows, seen, nearness
        if self.counted is None:
            return jax.vmap(function)(*given)
        one = jax.jit(lambda *each: function(*each))  # which is traced once
        shapes = jax.eval_shape(one, *jax.tree.map(lambda leaf: leaf[0], given))
        nothing = jax.tree.map(lambda leaf: jnp.zeros(leaf.shape, leaf.dtype), shapes)
        if_counted = lambda each: jax.lax.cond(each[0], lambda: one(*each[1]), lambda: nothing)
        return jax.lax.map(if_counted, (self.counted, given))

    def covered(self, posed: Posed, frame: Frame) -> tuple[Float[Array, "camera column row"], Array]:
        """How far cells are covered, and what the body gains there (log likelihood)."""
        cameras = frame.views.cameras
        seen = jax.vmap(project, in_axes=(0, None))(cameras, posed.blobs)
        nearness = _nearness(posed.blobs, seen, cameras.focal_length)
        maps = jax.vmap(lambda *each: self._maps(*each)[1])(self.windows, seen, nearness)
        return 1.0 - maps.left, jnp.log(maps.likelihood)

    def _maps(self, windows: ColorWindows, seen: Sog, nearness: Float[Array, "blob"]) -> tuple[GridRows, "_Maps"]:
        rows = grid_rows(windows.x, windows.y, windows.step, seen, self.density)
        of_x, of_y = rows.of_x, rows.of_y
        total = jnp.matmul(of_x, of_y.T)
        shares = jnp.matmul(
            self.clusters.grouped(of_x * nearness[None, :]), jnp.swapaxes(self.clusters.grouped(of_y), 1, 2)
        )
        whole = jnp.sum(shares, axis=0) + 1e-6
        ratios = jnp.exp(windows.odds)
        mean = (jnp.sum(shares * ratios, axis=0) + 1e-6) / whole
        left = jnp.exp(-total)
        return rows, _Maps(left, whole, ratios, mean, left + (1.0 - left) * mean)

    def _pulls(self, windows: ColorWindows, seen: Sog, nearness: Float[Array, "blob"]) -> ImagePulls:
        (of_x, of_y, dx, dy, variance_x, variance_y), maps = self._maps(windows, seen, nearness)
        gain = windows.areas * windows.free / maps.likelihood
        by_total = gain * maps.left * (maps.mean - 1.0)
        by_share = gain[None] * (1.0 - maps.left)[None] * (maps.ratios - maps.mean[None]) / maps.whole[None]

        def summed(slope: Array, slopes: Array) -> tuple[Array, Array]:
            """Sums for each blob, along y of the slopes times its rows and along x of its columns."""
            shared_y = self.clusters.spread(jnp.matmul(slopes, self.clusters.grouped(of_y)))
            shared_x = self.clusters.spread(jnp.matmul(jnp.swapaxes(slopes, 1, 2), self.clusters.grouped(of_x)))
            near = nearness[None, :]
            return jnp.matmul(slope, of_y) + near * shared_y, jnp.matmul(slope.T, of_x) + near * shared_x

        along_y, along_x = summed(by_total, by_share)
        wanted, _ = summed(jnp.maximum(by_total, 0.0), jnp.maximum(by_share, 0.0))
        over_x = lambda values: jnp.sum(of_x * along_y * values, axis=0)
        over_y = lambda values: jnp.sum(of_y * along_x * values, axis=0)
        inverse_x, inverse_y = 1.0 / variance_x[0], 1.0 / variance_y[0]
        mass = over_x(1.0)
        spread = over_x(dx**2) * inverse_x**2 + over_y(dy**2) * inverse_y**2
        by_sigma = mass * (2.0 / seen.sigmas - seen.sigmas * (inverse_x + inverse_y)) + seen.sigmas * spread
        stiffness = jnp.sum(of_x * wanted, axis=0) * 0.5 * (inverse_x + inverse_y)
        return ImagePulls(
            value=_value(maps, windows),
            by_mean=jnp.stack([over_x(dx) * inverse_x, over_y(dy) * inverse_y], axis=-1),
            by_sigma=by_sigma,
            stiffness=stiffness,
        )


class _Maps(NamedTuple):
    """The maps of a grid: exp(-sum A), the nearness-weighted density, odds of clusters, their mean, likelihood."""

    left: Float[Array, "*camera column row"]
    whole: Float[Array, "*camera column row"]
    ratios: Float[Array, "*camera cluster column row"]
    mean: Float[Array, "*camera column row"]
    likelihood: Float[Array, "*camera column row"]


def _value(maps: _Maps, windows: ColorWindows) -> Float[Array, ""]:
    return windows.areas * jnp.sum(windows.free * jnp.log(maps.likelihood))


def _nearness(blobs: Sog, seen: Sog, focal_length: Float[Array, "camera"]) -> Float[Array, "camera blob"]:
    """How much each blob counts where several lie behind each other."""
    depths = jnp.where(seen.mask, blobs.sigmas[None, :] * focal_length[:, None] / seen.sigmas, jnp.inf)
    nearest = jnp.min(depths, axis=1, keepdims=True)
    nearest = jnp.where(jnp.isfinite(nearest), nearest, 0.0)
    weights = jnp.exp(-(jnp.where(seen.mask, depths, nearest) - nearest) / DEPTH_SCALE)
    return jax.lax.stop_gradient(jnp.maximum(weights, 1e-6))
