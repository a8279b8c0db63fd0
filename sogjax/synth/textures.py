"""Procedural textures of the room: sRGB colours as functions of a surface's own coordinates in metres."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

Colors = Float[np.ndarray, "n 3"]
Coordinates = Float[np.ndarray, "n 2"]
Palette = Float[np.ndarray, "color 3"]
Rgb = tuple[float, float, float]


@dataclass(frozen=True)
class Texture:
    """A kind of texture with its colours."""

    kind: str
    colors: tuple[Rgb, ...]
    period: float = 0.3
    """Metres."""
    seed: int = 0

    def __call__(self, uv: Coordinates) -> Colors:
        """Colours at surface coordinates (metres)."""
        uv, palette = uv.astype(np.float32), np.array(self.colors, np.float32)
        base = _KINDS[self.kind](uv, palette, self.period, self.seed)
        grain = 0.07 * (value_noise(uv / 0.05, self.seed) - 0.5) + 0.09 * (value_noise(uv / 0.6, self.seed + 1) - 0.5)
        return np.clip(base * (1.0 + grain[:, None]), 0.0, 1.0).astype(np.float32)


def value_noise(uv: Coordinates, seed: int) -> Float[np.ndarray, "n"]:
    """Smooth random values in 0..1 on a lattice of unit spacing."""
    lattice = np.random.default_rng([seed, 977]).random((256, 256), np.float32)
    cell = np.floor(uv).astype(int)
    share = uv - cell
    share = share * share * (3.0 - 2.0 * share)
    x0, y0 = cell[:, 0] & 255, cell[:, 1] & 255
    x1, y1 = (x0 + 1) & 255, (y0 + 1) & 255
    top = lattice[x0, y0] + share[:, 0] * (lattice[x1, y0] - lattice[x0, y0])
    bottom = lattice[x0, y1] + share[:, 0] * (lattice[x1, y1] - lattice[x0, y1])
    return top + share[:, 1] * (bottom - top)


def _plain(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    return np.broadcast_to(palette[0], (len(uv), 3))


def _planks(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    row = np.floor(uv[:, 1] / period).astype(int)
    rng = np.random.default_rng([seed, 3])
    shift = rng.random(512)[row % 512] * 2.0
    board = np.floor((uv[:, 0] + shift) / 1.4).astype(int)
    tone = rng.random(4096)[(row * 37 + board * 101) % 4096]
    colors = palette[0] + tone[:, None] * (palette[1] - palette[0])
    fibre = value_noise(np.stack([uv[:, 0] / 0.35, uv[:, 1] / 0.018], 1), seed)
    gap = (np.mod(uv[:, 1], period) < 0.006) | (np.mod(uv[:, 0] + shift, 1.4) < 0.006)
    return colors * (0.92 + 0.12 * fibre)[:, None] * np.where(gap, 0.6, 1.0)[:, None]


def _checks(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    odd = np.mod(np.floor(uv / period).sum(1), 2.0).astype(int)
    return palette[odd]


def _stripes(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    return palette[np.floor(uv[:, 0] / period).astype(int) % len(palette)]


def _bricks(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    row = np.floor(uv[:, 1] / (0.4 * period)).astype(int)
    u = uv[:, 0] + 0.5 * period * (row % 2)
    brick = np.floor(u / period).astype(int)
    tone = np.random.default_rng([seed, 5]).random(4096)[(row * 53 + brick * 17) % 4096]
    colors = palette[0] + tone[:, None] * (palette[1] - palette[0])
    mortar = (np.mod(uv[:, 1], 0.4 * period) < 0.012) | (np.mod(u, period) < 0.012)
    return np.where(mortar[:, None], palette[-1], colors)


def _wall(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    colors = np.where((uv[:, 1] < 1.05)[:, None], palette[1], palette[0])
    return np.where((uv[:, 1] < 0.12)[:, None], palette[2], colors)


def _poster(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    """A picture of overlapping discs and bars on a ground, with a white rim."""
    rng = np.random.default_rng([seed, 11])
    colors = np.tile(palette[0], (len(uv), 1))
    for k in range(7):
        centre, radius = rng.random(2) * period, period * rng.uniform(0.08, 0.25)
        inside = ((uv - centre) ** 2).sum(1) < radius**2
        if k % 3 == 2:
            inside = np.abs(uv[:, k % 2] - centre[0]) < 0.3 * radius
        colors[inside] = palette[1 + k % (len(palette) - 1)]
    return colors


def _shelf(uv: Coordinates, palette: Palette, period: float, seed: int) -> Colors:
    """Boards with books of many colours between them."""
    rng = np.random.default_rng([seed, 13])
    shelf = np.floor(uv[:, 1] / period).astype(int)
    book = np.floor(uv[:, 0] / 0.055 + 7.3 * shelf).astype(int)
    height = 0.55 + 0.35 * rng.random(997)[(book * 31 + shelf) % 997]
    colors = palette[1 + rng.integers(0, len(palette) - 1, 997)[(book * 17 + shelf * 5) % 997]]
    level = np.mod(uv[:, 1], period) / period
    colors = np.where((level > height)[:, None], 0.25 * palette[0], colors)
    return np.where((level < 0.09)[:, None], palette[0], colors)


_KINDS: dict[str, Callable[[Coordinates, Palette, float, int], Colors]] = {
    "plain": _plain,
    "planks": _planks,
    "checks": _checks,
    "stripes": _stripes,
    "bricks": _bricks,
    "wall": _wall,
    "poster": _poster,
    "shelf": _shelf,
}
