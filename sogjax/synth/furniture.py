"""Furniture: a table and chairs among the people; and what stands between people and cameras."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from sogjax.synth.rotations import ahead_and_left
from sogjax.synth.scene import Panel, Texture, box, direction

TABLE_SIZE, TABLE_HEIGHT, SEAT_HEIGHT = (1.15, 0.72), 0.74, 0.45
"""Metres: length and depth of a table, its height, and that of a seat."""
SITTER_SEAT, EDGE = -0.34, 0.20
"""Metres from where a sitter's feet stand to the hips on the chair, and to the table."""

_WOOD = Texture("planks", ((0.56, 0.40, 0.26), (0.64, 0.47, 0.31)), 0.24, 5)
_DARK = Texture("plain", ((0.34, 0.26, 0.20),), 1.0, 6)
_SEATS = Texture("plain", ((0.45, 0.20, 0.17),), 1.0, 7)


_BOARDS = Texture("planks", ((0.46, 0.50, 0.48), (0.60, 0.63, 0.58)), 0.17, 8)
_NOTICES = Texture("poster", ((0.76, 0.74, 0.68), (0.30, 0.42, 0.50), (0.62, 0.34, 0.28), (0.40, 0.46, 0.34)), 1.0, 9)
_CLOTHS = ((0.66, 0.60, 0.50), (0.56, 0.52, 0.46), (0.42, 0.36, 0.34))

COUNTER_SIZE = (1.8, 0.44, 1.05)
"""Metres: length, depth and height of a counter."""
BOARD_SIZE, BOARD_HEIGHTS = (1.9, 0.04), (0.85, 1.52)
"""Metres: length and depth of a board, and the heights of its lower and its upper edge."""
_FARTHER = 0.12
"""Metres that these stand farther from people than a table."""
AROUND = 2.35
"""Metres from the middle of the room to a screen or a fence."""
SCREEN_ANGLES, SCREEN_HEIGHT = (-3.0, 19.0, 41.0, 63.0), 2.2
"""Degrees at which the leaves of a screen stand, before the first three cameras of twelve; metres."""
FENCE_HEIGHT = 1.0
"""Metres: below the low cameras."""


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
        kind: one of `sogjax.synth.settings.PROPS` but `auto` and `none`.
        sites: where what stands among the people stands; a screen and a fence stand around all of them.
    """
    if kind in _AROUND:
        return _AROUND[kind]()
    return [panel for site in sites for panel in _AMONG[kind](site)]


def farther(site: Site) -> Site:
    """Where what is higher than a table stands beside people: out of reach of their arms."""
    away = float(np.linalg.norm(site.place))
    return replace(site, place=site.place * (1.0 + _FARTHER / away)) if away > 0.0 else site


def _counter(site: Site) -> list[Panel]:
    """A counter closed down to the floor: it hides legs."""
    length, depth, height = COUNTER_SIZE
    site = farther(site)
    top = _slab(site.place, (length, depth), height - 0.04, height, site.turn, _DARK)
    return [*box(site.place, np.array([length - 0.04, depth - 0.06, height - 0.04]), site.turn, _BOARDS), *top]


def _board(site: Site) -> list[Panel]:
    """A board on two thin legs: it hides the trunk, and leaves head and lower legs."""
    site, (along, _) = farther(site), ahead_and_left(site.turn)
    length, depth = BOARD_SIZE
    low, high = BOARD_HEIGHTS
    panels = _slab(site.place, (length, depth), low, high, site.turn, _NOTICES)
    for end in (-1.0, 1.0):
        leg = site.place + end * (0.5 * length - 0.03) * along
        panels += _slab(leg, (0.04, 0.04), 0.0, low, site.turn, _DARK)
    return panels


def _screen() -> list[Panel]:
    """A folding screen, higher than people are, before three cameras of twelve in a ring."""
    panels: list[Panel] = []
    for leaf, angle in enumerate(np.deg2rad(SCREEN_ANGLES)):
        texture = Texture("stripes", (_CLOTHS[leaf % 2], _CLOTHS[2]), 0.31, 40 + leaf)
        width = 2.0 * AROUND * float(np.tan(np.deg2rad(0.5 * (SCREEN_ANGLES[1] - SCREEN_ANGLES[0])))) + 0.03
        panels += _slab(AROUND * direction(angle), (0.04, width), 0.04, SCREEN_HEIGHT, float(angle), texture)
    return panels


def _fence() -> list[Panel]:
    """A low fence all around: low cameras do not see legs behind it, high ones do."""
    panels: list[Panel] = []
    count = 16
    width = 2.0 * AROUND * float(np.tan(np.pi / count)) + 0.02
    for angle in 2.0 * np.pi * np.arange(count) / count:
        panels += _slab(AROUND * direction(angle), (0.03, width), 0.06, FENCE_HEIGHT, float(angle), _BOARDS)
    return panels


def _chairs(site: Site) -> list[Panel]:
    """Chairs without a table."""
    return [panel for place, facing in _chair_places(site, True) for panel in _chair(place, facing)]


def _table_and_chairs(site: Site) -> list[Panel]:
    """A table with its chairs."""
    chairs = [panel for place, facing in _chair_places(site, False) for panel in _chair(place, facing)]
    return _table(site) + chairs


def _chair_places(site: Site, close: bool) -> list[tuple[Float[np.ndarray, "3"], float]]:
    """Where chairs stand and look; without a table between them they stand closer together."""
    along, across = ahead_and_left(site.turn)
    if site.sitter:
        return [(site.place - (0.5 * TABLE_SIZE[1] + EDGE - SITTER_SEAT - 0.02) * across, site.turn + np.pi / 2)]
    away = 0.42 if close else 0.5 * TABLE_SIZE[0] + 0.10
    return [(site.place - away * along, site.turn), (site.place + away * along, site.turn + np.pi)]


def _table(site: Site) -> list[Panel]:
    """A top, four legs, and a board between the legs along the middle."""
    along, across = ahead_and_left(site.turn)
    length, depth = TABLE_SIZE
    below = TABLE_HEIGHT - 0.035
    panels = _slab(site.place, (length, depth), below, TABLE_HEIGHT, site.turn, _WOOD)
    for a, b in ((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)):
        leg = site.place + a * (0.5 * length - 0.06) * along + b * (0.5 * depth - 0.06) * across
        panels += _slab(leg, (0.055, 0.055), 0.0, below, site.turn, _DARK)
    board = site.place + (0.14 * across if site.sitter else 0.0)
    return panels + _slab(board, (length - 0.14, 0.03), 0.28, below, site.turn, _WOOD)


def _chair(place: Float[np.ndarray, "3"], facing: float) -> list[Panel]:
    """A seat on four legs with a back; `place` is below the middle of the seat."""
    ahead, aside = ahead_and_left(facing)
    seat, below = 0.43, SEAT_HEIGHT - 0.04
    panels = _slab(place, (seat, seat), below, SEAT_HEIGHT, facing, _SEATS)
    for a, b in ((-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)):
        leg = place + 0.5 * (seat - 0.05) * (a * ahead + b * aside)
        panels += _slab(leg, (0.04, 0.04), 0.0, below, facing, _DARK)
    back = place - 0.5 * (seat - 0.03) * ahead
    return panels + _slab(back, (0.03, seat - 0.02), SEAT_HEIGHT, 0.90, facing, _SEATS)


def _slab(
    place: Float[np.ndarray, "3"], size: tuple[float, float], low: float, high: float, turn: float, texture: Texture
) -> list[Panel]:
    """A box from one height to another, with its underside."""
    raised = place + np.array([0.0, 0.0, low])
    along, across = ahead_and_left(turn)
    u, v = size[0] * along, size[1] * across
    below = Panel(raised - (u + v) / 2, v, u, texture)
    return [*box(raised, np.array([*size, high - low]), turn, texture), below]


_AMONG: dict[str, Callable[[Site], list[Panel]]] = {
    **{"table": _table, "chairs": _chairs, "table_and_chairs": _table_and_chairs},
    **{"counter": _counter, "board": _board},
}
"""What stands among the people, at their sites."""
_AROUND: dict[str, Callable[[], list[Panel]]] = {"screen": _screen, "fence": _fence}
"""What stands around all of them."""
