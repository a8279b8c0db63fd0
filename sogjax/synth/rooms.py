"""The room in several kinds: floor, walls, and what stands along them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from sogjax.synth.clothes import Outfit
from sogjax.synth.scene import Panel, Rgb, Texture, box, direction

_WALLS = (-5.6, 5.9, -5.8, 5.5, 3.3)
"""Metres: x from, x to, y from, y to, height."""

_FURNITURE: tuple[Rgb, ...] = (
    *((0.60, 0.22, 0.20), (0.25, 0.36, 0.55), (0.72, 0.60, 0.30), (0.33, 0.47, 0.33), (0.78, 0.74, 0.66)),
    *((0.30, 0.28, 0.27), (0.52, 0.38, 0.26), (0.80, 0.64, 0.52), (0.46, 0.44, 0.58)),
)


@dataclass(frozen=True)
class Decor:
    """The colours of a cluttered room."""

    furniture: tuple[Rgb, ...] = _FURNITURE
    """Nine, also of the posters."""
    floor: tuple[Rgb, Rgb] = ((0.50, 0.40, 0.30), (0.62, 0.52, 0.40))
    paint: tuple[Rgb, Rgb, Rgb] = ((0.72, 0.71, 0.66), (0.50, 0.56, 0.58), (0.35, 0.30, 0.26))
    """Upper wall, lower wall, skirting board."""
    bricks: tuple[Rgb, Rgb, Rgb] = ((0.52, 0.34, 0.27), (0.64, 0.44, 0.34), (0.62, 0.60, 0.56))


def room_of(kind: str, outfits: Sequence[Outfit], rng: np.random.Generator) -> list[Panel]:
    """The panels of a room.

    Args:
        kind: `cluttered`, `camouflage` (the same in the colours of the people), `plain` or `green`.
        outfits: what the people wear.
        rng: draws the furniture.
    """
    bare: dict[str, Rgb] = {"plain": (0.62, 0.61, 0.58), "green": (0.22, 0.60, 0.28)}
    if kind in bare:
        sheet = Texture("plain", (bare[kind],), 1.0, 21)
        return _shell(sheet, sheet, sheet, 22)
    return _cluttered(rng, _camouflage(outfits) if kind == "camouflage" else Decor())


def _camouflage(outfits: Sequence[Outfit]) -> Decor:
    """A room in the colours of people's skin and clothes."""
    colors = [color for o in outfits for color in (o.skin, o.shirt[0], o.trousers, o.shirt[1], o.shoes, o.hair)]
    every = tuple(colors[k % len(colors)] for k in range(len(_FURNITURE)))
    one = outfits[0]
    return Decor(every, (one.trousers, one.skin), (one.skin, one.shirt[0], one.shoes), (*one.shirt, one.skin))


def _cluttered(rng: np.random.Generator, decor: Decor) -> list[Panel]:
    """A room with furniture along its walls, a few low things inside, and posters."""
    seed = int(rng.integers(1 << 30))
    floor, paint = Texture("planks", decor.floor, 0.14, seed), Texture("wall", decor.paint, 1.0, seed + 1)
    panels = _shell(floor, paint, Texture("bricks", decor.bricks, 0.24, seed + 2), seed + 3)
    panels += _posters(rng, decor)
    for angle in np.deg2rad(np.arange(0, 360, 24) + rng.uniform(-6, 6, 15)):
        panels += _standing_thing(angle, rng, decor)
    for angle in np.deg2rad(rng.uniform(0, 90) + np.array([0, 95, 200, 275])):
        size = rng.uniform([0.3, 0.3, 0.18], [0.5, 0.6, 0.36])
        panels += box(2.75 * direction(angle), size, rng.uniform(0, 3), _cover(rng, decor))
    return panels


def _shell(floor: Texture, paint: Texture, bricks: Texture, seed: int) -> list[Panel]:
    """Floor, ceiling and walls, one of them of bricks."""
    x0, x1, y0, y1, top = _WALLS
    ceiling = Texture("checks", ((0.86, 0.86, 0.84), (0.82, 0.82, 0.80)), 0.6, seed)
    x, y, z = np.array([x1 - x0, 0, 0]), np.array([0, y1 - y0, 0]), np.array([0, 0, top])
    return [
        Panel(np.array([x0, y0, 0.0]), x, y, floor, False),
        Panel(np.array([x0, y0, top]), y, x, ceiling, False),
        Panel(np.array([x1, y0, 0.0]), -x, z, paint, False),
        Panel(np.array([x0, y1, 0.0]), x, z, paint, False),
        Panel(np.array([x0, y0, 0.0]), y, z, bricks, False),
        Panel(np.array([x1, y1, 0.0]), -y, z, paint, False),
    ]


def _posters(rng: np.random.Generator, decor: Decor) -> list[Panel]:
    """Four posters on every wall."""
    x0, x1, y0, y1, _ = _WALLS
    x, y = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    panels = []
    for offset, along, aside in ((y0 + 0.015, -x, y), (y1 - 0.015, x, y), (x0 + 0.015, y, x), (x1 - 0.015, -y, x)):
        for place in (-3.4, -1.2, 0.9, 3.2):
            size = rng.uniform([0.7, 0.8], [1.3, 1.2])
            height = rng.uniform(1.15, 1.6)
            shift = place + rng.uniform(-0.3, 0.3)
            corner = shift * np.abs(along) + offset * aside + np.array([0, 0, height])
            colors = tuple(decor.furniture[k] for k in rng.permutation(len(decor.furniture))[:5])
            texture = Texture("poster", colors, float(size.max()), int(rng.integers(1 << 30)))
            panels.append(Panel(corner, size[0] * along, np.array([0, 0, size[1]]), texture, False))
    return panels


def _cover(rng: np.random.Generator, decor: Decor) -> Texture:
    """A texture for a piece of furniture."""
    first, second, third = (decor.furniture[k] for k in rng.permutation(len(decor.furniture))[:3])
    kind = str(rng.choice(["plain", "plain", "stripes", "checks", "planks"]))
    return Texture(kind, (first, second, third), float(rng.uniform(0.08, 0.3)), int(rng.integers(1 << 30)))


def _standing_thing(angle: float, rng: np.random.Generator, decor: Decor) -> list[Panel]:
    """Something that stands near the wall: a cupboard, a shelf with books, a barrel or a stack of boxes."""
    place = rng.uniform(4.75, 5.1) * direction(angle)
    facing = angle + np.pi / 2 + rng.uniform(-0.25, 0.25)
    kind = int(rng.integers(4))
    if kind == 0:
        return box(place, rng.uniform([0.8, 0.35, 0.7], [1.2, 0.5, 1.3]), facing, _cover(rng, decor))
    if kind == 1:
        colors = (decor.furniture[6], *(decor.furniture[k] for k in rng.permutation(6)))
        return box(place, rng.uniform([0.8, 0.3, 1.3], [1.1, 0.35, 2.0]), facing, Texture("shelf", colors, 0.33))
    if kind == 2:
        return _barrel(place, float(rng.uniform(0.22, 0.32)), float(rng.uniform(0.6, 1.0)), _cover(rng, decor))
    lower = rng.uniform([0.5, 0.4, 0.35], [0.8, 0.6, 0.6])
    upper = lower * rng.uniform(0.6, 0.9, 3)
    stacked = place + np.array([0.0, 0.0, lower[2]])
    return box(place, lower, facing, _cover(rng, decor)) + box(stacked, upper, facing + 0.4, _cover(rng, decor))


def _barrel(place: Float[np.ndarray, "3"], radius: float, height: float, texture: Texture) -> list[Panel]:
    """A tub with twelve sides and a lid."""
    rim = [place + radius * direction(angle) for angle in np.linspace(0, 2 * np.pi, 13)]
    z = np.array([0.0, 0.0, height])
    sides = [Panel(a, b - a, z, texture) for a, b in pairwise(rim)]
    half = radius * 0.70
    return sides + box(place + z * 0.98, np.array([2 * half, 2 * half, 0.02 * height + 0.01]), 0.3, texture)
