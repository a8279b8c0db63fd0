"""Furniture in the middle of the room, which hides people's legs: tables and chairs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sogjax.synth.scene import Panel, box
from sogjax.synth.textures import Texture

TABLE_HEIGHT = 0.74
SEAT_HEIGHT = 0.45
SITTER_SEAT = -0.34
"""Metres from where a sitter's feet stand to the hips on the chair."""
EDGE = 0.20
"""Metres from where a sitter's feet stand to the table."""

TABLE_SIZE = (1.15, 0.72)
_TOP = 0.035
_LEG = 0.055
_SEAT = 0.43
_WOOD = Texture("planks", ((0.56, 0.40, 0.26), (0.64, 0.47, 0.31)), 0.24, 5)
_DARK = Texture("plain", ((0.34, 0.26, 0.20),), 1.0, 6)
_SEATS = Texture("plain", ((0.45, 0.20, 0.17),), 1.0, 7)


@dataclass(frozen=True)
class Site:
    """Where furniture stands: the middle of the table on the floor, and the direction its long side runs in."""

    place: Float[np.ndarray, "3"]
    turn: float
    """Radians about the vertical; people at the table look along `turn` + 90 degrees or the other way."""
    sitter: bool = False
    """Whether the chair stands at the long side, for somebody who sits at the table; else one at each end."""


def furniture(kind: str, sites: Sequence[Site]) -> list[Panel]:
    """Panels of the furniture.

    Args:
        kind: `table`, `chairs` or `table_and_chairs`.
        sites: where; one table with its chairs each.
    """
    panels: list[Panel] = []
    for site in sites:
        if kind != "chairs":
            panels += _table(site)
        if kind != "table":
            for place, facing in _chair_places(site, kind == "chairs"):
                panels += _chair(place, facing)
    return panels


def _chair_places(site: Site, close: bool) -> list[tuple[Float[np.ndarray, "3"], float]]:
    """Where chairs stand and look; without a table between them they stand closer together."""
    along, across = _axes(site.turn)
    if site.sitter:
        return [(site.place - (0.5 * TABLE_SIZE[1] + EDGE - SITTER_SEAT - 0.02) * across, site.turn + np.pi / 2)]
    away = 0.42 if close else 0.5 * TABLE_SIZE[0] + 0.10
    return [(site.place - away * along, site.turn), (site.place + away * along, site.turn + np.pi)]


def _axes(turn: float) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    along = np.array([np.cos(turn), np.sin(turn), 0.0])
    return along, np.array([-along[1], along[0], 0.0])


def _table(site: Site) -> list[Panel]:
    """A top, four legs, and a board between the legs along the middle."""
    along, across = _axes(site.turn)
    length, depth = TABLE_SIZE
    panels = _slab(site.place, (length, depth), TABLE_HEIGHT - _TOP, TABLE_HEIGHT, site.turn, _WOOD)
    for a in (-1.0, 1.0):
        for b in (-1.0, 1.0):
            leg = site.place + a * (0.5 * length - 0.06) * along + b * (0.5 * depth - 0.06) * across
            panels += _slab(leg, (_LEG, _LEG), 0.0, TABLE_HEIGHT - _TOP, site.turn, _DARK)
    board = site.place + (0.14 * across if site.sitter else 0.0)
    return panels + _slab(board, (length - 0.14, 0.03), 0.28, TABLE_HEIGHT - _TOP, site.turn, _WOOD)


def _chair(place: Float[np.ndarray, "3"], facing: float) -> list[Panel]:
    """A seat on four legs with a back; `place` is below the middle of the seat."""
    ahead, aside = _axes(facing)
    panels = _slab(place, (_SEAT, _SEAT), SEAT_HEIGHT - 0.04, SEAT_HEIGHT, facing, _SEATS)
    for a in (-1.0, 1.0):
        for b in (-1.0, 1.0):
            leg = place + 0.5 * (_SEAT - 0.05) * (a * ahead + b * aside)
            panels += _slab(leg, (0.04, 0.04), 0.0, SEAT_HEIGHT - 0.04, facing, _DARK)
    back = place - 0.5 * (_SEAT - 0.03) * ahead
    return panels + _slab(back, (0.03, _SEAT - 0.02), SEAT_HEIGHT, 0.90, facing, _SEATS)


def _slab(
    place: Float[np.ndarray, "3"], size: tuple[float, float], low: float, high: float, turn: float, texture: Texture
) -> list[Panel]:
    """A box from one height to another, with its underside."""
    raised = place + np.array([0.0, 0.0, low])
    along, across = _axes(turn)
    u, v = size[0] * along, size[1] * across
    below = Panel(raised - (u + v) / 2, v, u, texture)
    return [*box(raised, np.array([*size, high - low]), turn, texture), below]
