"""Where somebody may stand still in a clip: where the floor is hidden, and most cameras do not take it for the room.

Where somebody only talks, little moves, and `moving_zones` are whole pillars of the room. OpenCV's grabCut tells in
each picture what in the zone looks unlike the room around it. One camera may be wrong, as trousers may look like the
floor; so it is told from all of them together.
"""

from collections.abc import Mapping
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Bool

from sogjax.model.cores import in_threads
from sogjax.scene.background_difference import disc, widened
from sogjax.scene.coarse_views import CoarseViews, small
from sogjax.scene.floor import Floor, over_floor
from sogjax.scene.moving_zone import REACH
from sogjax.scene.segmentation import unlike_the_room
from sogjax.scene.visual_hull import MANY, from_upright, upright

SUPPORT, LEANING = 0.4, 0.35
"""Metres over the floor in which something stands where somebody does, and how far he leans from there."""
MISTAKEN = 0.25
"""Share of the other cameras that may take somebody for the room where a camera tells him from it."""
Mask = Bool[np.ndarray, "_h _w"]


class StillZones(NamedTuple):
    """Where what never changes may be somebody, by camera."""

    narrow: dict[int, Mask]
    wide: dict[int, Mask]
    """With the rim of the voxels that tell it: a ring of wall that never changes, which keeps what moved before it from
    being learnt."""


def still_zones(zones: Mapping[int, Mask], views: CoarseViews) -> StillZones:
    """The parts of the zones (`moving_zones`) in which what never changes may be somebody.

    That is what a camera tells from the room and most others do not take for it; and what all the others tell from it.
    """
    seeing, pixels = [*views.moving], views.pixels
    small_zone = lambda k: small(zones[k].astype(np.uint8), cv2.INTER_NEAREST) > 0
    cut = lambda k: unlike_the_room(views.small_picture(k), small_zone(k)) | views.moving[k]
    unlike = dict(zip(seeing, in_threads(cut, seeing), strict=True))
    missed = views.missed(unlike)
    misses = np.sum([*missed.values()], axis=0)
    surely = views.inside & (misses <= (1 if len(seeing) >= MANY else 0))
    still = StillZones(dict(zones), dict(zones))
    for k in seeing:
        perhaps = views.inside & (misses - missed[k] <= int(MISTAKEN * len(seeing)))
        by_others, told = pixels[k].silhouette_of(surely), pixels[k].silhouette_of(perhaps) & unlike[k]
        still.wide[k] = views.enlarged(k, told | by_others)
        still.narrow[k] = views.enlarged(k, told | ~widened(~by_others, pixels[k].footprint))
    return still


def standing_zones(zones: Mapping[int, Mask], views: CoarseViews, floors: Mapping[int, Floor]) -> dict[int, Mask]:
    """The parts of the zones that lie over places where the floor is not seen: who stands still hides it.

    Where too few cameras see what is over it, near what moves. `floors` are what cameras show of it to each other
    (`seen_floors`).
    """
    (empty, _, ground), spacing = over_floor(views, floors), views.cube.spacing
    low = slice(max(ground + 1, 0), max(ground + 1, 0) + max(round(SUPPORT / spacing), 1))
    inside = upright(views.inside, views.up)[:, :, low].sum(axis=2)
    filled = (~empty & upright(views.inside, views.up))[:, :, low].sum(axis=2)
    wide = lambda places, reach: cv2.dilate(places.astype(np.uint8), disc(2 * round(reach / spacing) + 1)) > 0
    moves = upright(np.sum([*views.missed(views.moving).values()], axis=0) == 0, views.up).any(axis=2)
    plan = wide(filled > 0.5 * inside, LEANING) | ((inside == 0) & wide(moves, REACH))
    pillars = from_upright(plan[:, :, None] & ~empty, views.up)
    return {**zones} | {k: zones[k] & views.enlarged(k, at.silhouette_of(pillars)) for k, at in views.pixels.items()}
