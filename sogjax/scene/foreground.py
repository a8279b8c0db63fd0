"""Foreground against background: what the colour of a cell says about whether somebody is seen there."""

import math
from dataclasses import replace
from typing import Any

import cv2
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, UInt8

from sogjax.model.color import SHADING, SPREAD
from sogjax.scene.background import BackgroundCells, BackgroundImage
from sogjax.scene.background_difference import working_size

LARGEST = 2.0
"""No cell says more than this: what disturbs one (a reflection, a wrong background) disturbs its neighbours too."""
SMALLEST_SPREAD = 0.015
"""Standard deviation of a channel at one place in one light, at least (compression, a lens that breathes)."""
SHADOW = 0.06
"""Standard deviation of the light that a shadow or a reflection takes or adds, as a part of the background's."""
DEEP_SHADOW, SHADOWED = 0.3, 0.05
"""Standard deviation of the light that a deep shadow takes, and the share of cells that lie in one. With room for deep
shadows in every cell dark sleeves and trousers passed for them, and limbs were lost; without any, hands were drawn to
their own shadows on the floor. Of a subject of any colours there are none: nothing tells black trousers from them."""
SUBJECT_UNKNOWN = 0.3
"""Share of a subject whose colours are none of its blobs': any colour."""
COLOR_BINS = 32
"""Bins of each channel in the table of a subject's colours."""
COARSER = 2
"""Those bins in which the colours of a picture are counted, in each channel."""
PICTURE_SMOOTHING = 0.05
"""Share of any colour in the colours of a picture whose background is not known."""
UNKNOWN_BACKGROUND = 0.6
"""What colours count where the background is not known, as a part of what they count where it is."""
LARGEST_UNKNOWN = 1.0
"""`LARGEST` there."""
TEMPER = 0.5
"""Part of the logarithm that counts: neighbouring cells err together."""
_LIGHT_STEPS = (0.15, 0.08, 0.05)
"""How far cells may be off to count in each estimate of a frame's light."""
_LIGHT_STRIDE = 3
"""Every so many rows and columns are enough for it."""
_NORMAL = (2.0 * np.pi) ** 1.5

Cells = Float[Array, "camera rows columns"]
SubjectColors = Float[Array, "bin bin bin"]
"""Logarithm of the density of a subject's colours at the middle of each bin of sRGB; 0 is that of any colour."""


def subject_colors(
    colors: Float[np.ndarray, "blob 3"], areas: Float[np.ndarray, "blob"]
) -> Float[np.ndarray, "bin bin bin"]:
    """The colours of a subject, from those of its blobs (sRGB) and how much of it each is."""
    middle = (np.arange(COLOR_BINS) + 0.5) / COLOR_BINS
    places = np.stack(np.meshgrid(middle, middle, middle, indexing="ij"), axis=-1).reshape(-1, 3)
    density = np.full(len(places), SUBJECT_UNKNOWN)
    for color, share in zip(np.asarray(colors, float), np.asarray(areas, float) / np.sum(areas), strict=True):
        distance, peak = _color_gaussian(places, color)
        density += (1.0 - SUBJECT_UNKNOWN) * share * peak * np.exp(-0.5 * distance)
    return np.log(density).reshape(COLOR_BINS, COLOR_BINS, COLOR_BINS)


def _color_gaussian(colors: Any, color: Any) -> tuple[Any, Any]:
    """Squared distances of colours from those of a blob, in standard deviations, and the density there.

    A Gaussian that is longer along the blob's own colour, as shading makes that darker or brighter. Arrays of numpy or
    jax that broadcast, channels last.
    """
    off, length = colors - color, (color * color).sum(axis=-1)
    along, squared = (off * color).sum(axis=-1), (off * off).sum(axis=-1)
    variance = SPREAD**2
    distance = (squared - along**2 / (variance / SHADING**2 + length)) / variance
    return distance, 1.0 / (_NORMAL * variance * (variance + SHADING**2 * length) ** 0.5)


def own_density(colors: Float[Array, "*#place 3"], color: Float[Array, "*#place 3"]) -> Float[Array, "*place"]:
    """Logarithm of the density of colours (sRGB) where blobs of some colours are seen; 0 is that of any colour."""
    distance, peak = _color_gaussian(colors, color)
    return jnp.log((1.0 - SUBJECT_UNKNOWN) * peak * jnp.exp(-0.5 * distance) + SUBJECT_UNKNOWN)


def own_color(colors: Float[Array, "*#place 3"], color: Float[Array, "*#place 3"]) -> Float[Array, "*place"]:
    """How far colours (sRGB) are those of blobs, lit as they may be: 1 for the same, towards 0 for others."""
    return jnp.exp(-0.5 * _color_gaussian(colors, color)[0])


def subject_density(colors: Float[Array, "*place 3"], subject: SubjectColors) -> Float[Array, "*place"]:
    """Logarithm of the density of colours (sRGB) where some blob of a subject is seen; 0 is that of any colour."""
    red, green, blue = color_bins(colors)
    place = (red * COLOR_BINS + green) * COLOR_BINS + blue
    return subject.reshape(-1).at[place].get(mode="promise_in_bounds")


class BackgroundModel(eqx.Module):
    """What is compared with every frame: the background channel by channel, and what follows from it alone."""

    planes: tuple[Cells, Cells, Cells]
    """Red, green and blue of the background, sRGB, 0 to 1."""
    precision: Cells
    """1 / variance of a channel."""
    volume: Cells
    """Logarithm of the Gaussian's volume in colours, in the background's own light: a frame's changes it little."""
    deep_volume: Cells
    """Logarithm of the volume of the Gaussian of a deep shadow."""
    known: Bool[Array, "camera rows columns"]
    unknown: Bool[Array, "camera rows columns"]
    """The other cells that are in the picture."""
    elsewhere: Float[Array, "camera bin bin bin"]
    """What `color_surprise` says of the known background: it stands for what is unknown."""

    def filled_by(self, other: "BackgroundModel") -> "BackgroundModel":
        """This background, with what another one of the same cells knows where this one knows nothing."""
        filled = lambda own, others: jnp.where(self.known, own, others)
        known, unknown = self.known | other.known, self.unknown & other.unknown
        parts = {
            name: jax.tree.map(filled, getattr(self, name), getattr(other, name))
            for name in ("planes", "precision", "volume", "deep_volume")
        }
        return replace(self, **parts, known=known, unknown=unknown)

    @classmethod
    def from_background(cls, background: BackgroundCells) -> "BackgroundModel":
        """The background may be darker or brighter by a factor (a shadow), at a cost: longer Gaussians that way."""
        dtype = jnp.result_type(float)
        variance = jnp.maximum(jnp.asarray(background.spread, dtype), SMALLEST_SPREAD) ** 2
        colors, known = jnp.asarray(background.colors, dtype) / 255.0, jnp.asarray(background.known)
        red, green, blue = (colors[..., k] for k in range(3))
        unknown = (jnp.asarray(background.spread) > 0.0) & ~known
        elsewhere = color_surprise(colors, known.astype(dtype))
        nothing = jnp.zeros_like(variance)
        empty = cls((red, green, blue), nothing, nothing, nothing, known, unknown, elsewhere)
        return empty._with_variance(variance)

    def _with_variance(self, variance: Cells) -> "BackgroundModel":
        length = sum(plane * plane for plane in self.planes)
        volume, deep = (jnp.log(_NORMAL * variance * jnp.sqrt(variance + s**2 * length)) for s in (SHADOW, DEEP_SHADOW))
        return replace(self, precision=1.0 / variance, volume=volume, deep_volume=deep)

    def blurred(self, spread: float) -> "BackgroundModel":
        """This background, each channel of which is known no better than to a standard deviation."""
        return self._with_variance(jnp.maximum(1.0 / self.precision, spread**2))


def log_odds(
    cells: Float[Array, "camera rows columns 3"], empty: BackgroundModel, subject: SubjectColors | None
) -> Float[Array, "camera rows columns"]:
    """Logarithm of foreground over background, within `LARGEST`.

    Each is the density of the cell's colour: a place of the subject's own colours says little either way. Colours are
    sRGB, 0 to 1; slow changes of the light are taken out first. A subject that is None may have any colours. Where the
    background is unknown, what the picture shows elsewhere stands for it, within `LARGEST_UNKNOWN`: wood is more likely
    the floor than a sleeve. It says nothing of a subject of any colours.
    """
    seen = [cells[..., k] for k in range(3)]
    if subject is None:
        odds = _surprise(seen, empty, deep_shadows=False)
        return jnp.where(empty.known, jnp.clip(TEMPER * odds, -LARGEST, LARGEST), 0.0)
    odds = _surprise(seen, empty)
    density = subject_density(cells, subject)
    elsewhere = TEMPER * UNKNOWN_BACKGROUND * (surprise_of(cells, empty.elsewhere) + density)
    unknown = jnp.where(empty.unknown, jnp.clip(elsewhere, -LARGEST_UNKNOWN, LARGEST_UNKNOWN), 0.0)
    return jnp.where(empty.known, jnp.clip(TEMPER * (odds + density), -LARGEST, LARGEST), unknown)


def color_surprise(
    cells: Float[Array, "camera rows columns 3"], counted: Float[Array, "camera rows columns"]
) -> Float[Array, "camera bin bin bin"]:
    """Minus the logarithm of the density of colours among the cells of each picture that count; 0 if none does."""
    coarse = COLOR_BINS // COARSER

    def of_camera(colors: Float[Array, "rows columns 3"], counted: Float[Array, "rows columns"]) -> Array:
        index = tuple(part // COARSER for part in color_bins(colors))
        table = jnp.zeros((coarse,) * 3, colors.dtype).at[index].add(counted)
        for axis in range(3):
            smaller, larger = jnp.roll(table, 1, axis), jnp.roll(table, -1, axis)
            table = 0.5 * table + 0.25 * (smaller + larger)
        total = jnp.sum(counted)
        density = jnp.where(total > 0.0, table / jnp.maximum(total, 1.0) * coarse**3, 1.0)
        return -jnp.log((1.0 - PICTURE_SMOOTHING) * density + PICTURE_SMOOTHING)

    return jax.vmap(of_camera)(cells, counted)


def surprise_of(
    cells: Float[Array, "camera rows columns 3"], table: Float[Array, "camera bin bin bin"]
) -> Float[Array, "camera rows columns"]:
    """What the table of `color_surprise` says of each cell's colour."""
    camera = jnp.arange(cells.shape[0])[:, None, None]
    return table[camera, *(part // COARSER for part in color_bins(cells))]


def background_surprise(
    cells: Float[Array, "camera rows columns 3"], empty: BackgroundModel
) -> Float[Array, "camera rows columns"]:
    """Minus the logarithm of the density of each cell's colour, if the background is seen there."""
    return _surprise([cells[..., k] for k in range(3)], empty)


def _surprise(seen: list[Cells], empty: BackgroundModel, deep_shadows: bool = True) -> Cells:
    gains = _light(seen, empty)
    expected = [gain[:, None, None] * plane for gain, plane in zip(gains, empty.planes, strict=True)]
    off = [s - e for s, e in zip(seen, expected, strict=True)]
    squared = sum(o * o for o in off)
    along = sum(o * e for o, e in zip(off, expected, strict=True))
    # Along the expected colour: by the background's length, a brighter light would explain more than all.
    length = sum(e * e for e in expected)

    def surprise(shadow: float, volume: Cells) -> Cells:
        longer = shadow**2 * empty.precision
        explained = longer * along * along / (1.0 + longer * length)
        return 0.5 * (squared - explained) * empty.precision + volume

    usual = surprise(SHADOW, empty.volume)
    if not deep_shadows:
        return usual
    deep = surprise(DEEP_SHADOW, empty.deep_volume) - math.log(2.0 * SHADOWED)  # twice, as its other half is light
    return jnp.minimum(usual, jnp.where(along < 0.0, deep, jnp.inf))


def color_bins(cells: Float[Array, "*cell 3"]) -> tuple[Array, Array, Array]:
    """The bin of each cell's colour in a table of colours."""
    red, green, blue = (jnp.clip(cells[..., k] * COLOR_BINS, 0, COLOR_BINS - 1).astype(jnp.int32) for k in range(3))
    return red, green, blue


def foreground_weights(odds: Float[Array, "*shape"]) -> Float[Array, "*shape"]:
    """How much the colour of a cell counts: 1 where it may be foreground, down to 0 where it is background."""
    return jnp.clip(1.0 + odds / LARGEST, 0.0, 1.0)


def _light(seen: list[Cells], empty: BackgroundModel) -> list[Float[Array, "camera"]]:
    """The gain of each channel that makes the background most like a frame, wherever that shows it."""
    part = lambda values: values[:, ::_LIGHT_STRIDE, ::_LIGHT_STRIDE]
    seen, planes, known = [part(s) for s in seen], [part(plane) for plane in empty.planes], part(empty.known)
    gains = [jnp.ones(known.shape[0], known_as.dtype) for known_as in seen]
    for step in _LIGHT_STEPS:
        rest = [s - gain[:, None, None] * plane for s, gain, plane in zip(seen, gains, planes, strict=True)]
        weight = jnp.where(known, jnp.exp(-0.5 / step**2 * sum(r * r for r in rest)), 0.0)
        gains = [_gain(weight, s, plane) for s, plane in zip(seen, planes, strict=True)]
    return gains


def _gain(weight: Cells, seen: Cells, plane: Cells) -> Float[Array, "camera"]:
    """The gain that fits best by least squares; 1 where nothing tells."""
    total = jnp.sum(weight * plane * plane, axis=(1, 2))
    found = jnp.sum(weight * plane * seen, axis=(1, 2)) / jnp.maximum(total, 1e-6)
    return jnp.where(total > 1e-2, found, 1.0)


_log_odds = jax.jit(log_odds)


def foreground_probability(
    image: UInt8[np.ndarray, "height width 3"], background: BackgroundImage
) -> Float[np.ndarray, "rows columns"]:
    """The probability of each pixel (BGR, working size), as the tracker has it for cells; a half where unknown."""
    size = working_size(image.shape[1], image.shape[0])
    small = lambda part: cv2.resize(part, size, interpolation=cv2.INTER_AREA)
    known = small(background.known.astype(np.float32)) > 0.999
    empty = BackgroundCells(
        small(background.picture)[None, ..., ::-1], small(background.spread)[None] / 255.0, known[None]
    )
    seen = (small(image)[None, ..., ::-1] / 255.0).astype(np.float32)
    odds = _log_odds(seen, BackgroundModel.from_background(empty), None)
    return np.asarray(1.0 / (1.0 + np.exp(-odds[0] / TEMPER)), np.float32)
