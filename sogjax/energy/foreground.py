"""The foreground term: a body is to cover what is not background, and nothing that is."""

from dataclasses import replace
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.image_term import ImageTerm
from sogjax.energy.overlap import ImagePulls
from sogjax.energy.posed import Frame, Posed
from sogjax.energy.views import Windows
from sogjax.model.camera import project
from sogjax.model.sog import Sog

LANES = 8
"""Entries along the last axis that XLA on a CPU computes at once; an exponential of those left over takes six times as
long."""


class Foreground(ImageTerm):
    """Sum over the cells of `a_i l_i C_i`, the mean over the cameras, in units of the whole picture as in Eq. 9.

    `a_i` is the cell's E_ii, `l_i` the log odds of foreground against background there, and `C_i = 1 - exp(-sum_q
    A_q(i))` how far the blobs cover it: smooth, at most 1, whatever their colours and however many there are.
    """

    density: Float[Array, ""] = eqx.field(converter=jnp.asarray, default=2.0)
    """A_q in the middle of a blob: 2 makes a silhouette end where the Gaussians sum to about a half."""

    def value(self, posed: Posed, frame: Frame) -> Float[Array, ""]:
        """The value for the posed blobs in all windows; 0 where no background is known."""
        views = frame.views
        if views.windows is None:
            return jnp.zeros((), posed.pose.dtype)
        seen = jax.vmap(project, in_axes=(0, None))(views.cameras, posed.blobs)
        return jnp.mean(jax.vmap(self._of_camera)(views.windows, seen) / views.normalizers)

    def pulls(self, posed: Posed, seen: Sog, frame: Frame) -> ImagePulls:
        """Gradient in closed form; the springs are those of the cells that want to be covered."""
        if frame.views.windows is None:
            nothing = jnp.zeros_like(seen.sigmas)
            return ImagePulls(nothing[:, 0], jnp.zeros_like(seen.means), nothing, nothing)
        return jax.vmap(self._pulls)(frame.views.windows, seen)

    def _of_camera(self, windows: Windows, seen: Sog) -> Float[Array, ""]:
        gain = windows.areas[:, None, None] * windows.odds
        return jnp.sum(gain * cover(windows, seen, self.density))

    def _pulls(self, windows: Windows, seen: Sog) -> ImagePulls:
        """Value and derivatives of one camera: every sum over cells is a product of small matrices."""
        num_blobs, seen = seen.capacity, _whole_lanes(seen)
        rows = _rows(windows, seen, self.density)
        total = jnp.einsum("wxb,wyb->wxy", rows.of_x, rows.of_y)
        left = _exponentials(-total)
        gain = windows.areas[:, None, None] * windows.odds
        slope = gain * left
        weights_x = rows.of_x * jnp.einsum("wxy,wyb->wxb", slope, rows.of_y)
        weights_y = rows.of_y * jnp.einsum("wxy,wxb->wyb", slope, rows.of_x)
        wanted = rows.of_x * jnp.einsum("wxy,wyb->wxb", jnp.maximum(slope, 0.0), rows.of_y)
        mass, away_x, spread_x = _moments(weights_x, windows.x, seen.means[:, 0])
        _, away_y, spread_y = _moments(weights_y, windows.y, seen.means[:, 1])
        mass_wanted, _, _ = _moments(wanted, windows.x, seen.means[:, 0])
        inverse_x, inverse_y = 1.0 / rows.variance_x[:, 0], 1.0 / rows.variance_y[:, 0]
        sigma = seen.sigmas[None, :]
        # A_q is density sigma^2 / sqrt(vx vy) exp(...), and both variances grow with sigma^2.
        by_sigma = mass * (2.0 / sigma - sigma * (inverse_x + inverse_y))
        by_sigma = by_sigma + sigma * (spread_x * inverse_x**2 + spread_y * inverse_y**2)
        stiffness = mass_wanted * 0.5 * (inverse_x + inverse_y)
        return ImagePulls(
            value=jnp.sum(gain * (1.0 - left)),
            by_mean=jnp.sum(jnp.stack([away_x * inverse_x, away_y * inverse_y], axis=-1), axis=0)[:num_blobs],
            by_sigma=jnp.sum(by_sigma, axis=0)[:num_blobs],
            stiffness=jnp.sum(stiffness, axis=0)[:num_blobs],
        )


def cover(windows: Windows, seen: Sog, density: Float[Array, ""]) -> Float[Array, "window column row"]:
    """How far blobs cover the cells of one camera's windows: C_i of the foreground term."""
    rows = _rows(windows, seen, density)
    return -jnp.expm1(-jnp.einsum("wxb,wyb->wxy", rows.of_x, rows.of_y))


def _whole_lanes(seen: Sog) -> Sog:
    """The blobs with so much padding that they are a multiple of `LANES`."""
    extra = -seen.capacity % LANES
    at_end = lambda leaf: jnp.pad(leaf, [(0, extra), *[(0, 0)] * (leaf.ndim - 1)])
    return replace(jax.tree.map(at_end, seen), sigmas=jnp.pad(seen.sigmas, (0, extra), constant_values=1.0))


def _exponentials(values: Float[Array, "window column row"]) -> Float[Array, "window column row"]:
    """Exponentials along one long axis (see `LANES`); without the barrier XLA would make it two short ones again."""
    return jnp.exp(jax.lax.optimization_barrier(values.reshape(values.shape[0], -1))).reshape(values.shape)


def _moments(
    weights: Float[Array, "window cell blob"], places: Float[Array, "window cell"], means: Float[Array, "blob"]
) -> tuple[Float[Array, "window blob"], Float[Array, "window blob"], Float[Array, "window blob"]]:
    """The moments of weights about each blob: their sums over cells, times the distance from it, times its square.

    They are one product with powers of the places, counted from the window's middle: sums along an axis are slow.
    """
    middle = jnp.mean(places, axis=1, keepdims=True)
    at, mean = places - middle, means[None, :] - middle
    powers = jnp.stack([jnp.ones_like(at), at, at * at], axis=-1)
    sums = jnp.einsum("wcb,wck->wkb", weights, powers)
    away = sums[:, 1] - mean * sums[:, 0]
    return sums[:, 0], away, sums[:, 2] - mean * (2.0 * sums[:, 1] - mean * sums[:, 0])


class GridRows(NamedTuple):
    """The factors of A_q along x and y, how far cells are from the blobs, and the variances."""

    of_x: Float[Array, "*window column blob"]
    of_y: Float[Array, "*window row blob"]
    dx: Float[Array, "*window column blob"]
    dy: Float[Array, "*window row blob"]
    variance_x: Float[Array, "*window 1 blob"]
    variance_y: Float[Array, "*window 1 blob"]


def grid_rows(
    x: Float[Array, "column"], y: Float[Array, "row"], step: Float[Array, "2"], seen: Sog, density: Float[Array, ""]
) -> GridRows:
    """Densities A_q of projected blobs on a grid with cells at x and y, of sizes `step`, as products of rows."""
    squared = (jnp.where(seen.mask, seen.sigmas, 1.0) ** 2)[None, :]
    # The mean of a Gaussian over a cell, about: a cell has the variance of its width.
    variance_x, variance_y = squared + step[0] ** 2 / 12.0, squared + step[1] ** 2 / 12.0
    dx, dy = x[:, None] - seen.means[None, :, 0], y[:, None] - seen.means[None, :, 1]
    height = jnp.where(seen.mask, density, 0.0)[None, :]
    of_x = height * jnp.sqrt(squared / variance_x) * jnp.exp(-0.5 * dx * dx / variance_x)
    of_y = jnp.sqrt(squared / variance_y) * jnp.exp(-0.5 * dy * dy / variance_y)
    return GridRows(of_x, of_y, dx, dy, variance_x, variance_y)


def _rows(windows: Windows, seen: Sog, density: Float[Array, ""]) -> GridRows:
    of_window = jax.vmap(grid_rows, in_axes=(0, 0, 0, None, None))
    return of_window(windows.x, windows.y, windows.step, seen, density)
