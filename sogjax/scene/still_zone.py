"""Where somebody may stand still in a clip, told by colour: what looks like the room to most cameras is empty.

Where somebody only talks, little moves, and `moving_zones` are whole pillars of the room. OpenCV's grabCut tells in
each picture what in the zone looks unlike the room around it. One camera may be wrong, as trousers may look like the
floor; so it is told from all of them together.
"""

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from sogjax.model.camera import Camera
from sogjax.scene.background_difference import widened
from sogjax.scene.moving_zone import SEEING, SMALLEST_ROOM
from sogjax.scene.segmentation import COARSE_SIDE, unlike_the_room
from sogjax.scene.visual_hull import MANY, Cube, cube_around, resized, voxel_pixels

MISTAKEN = 0.25
"""Share of the other cameras that may take somebody for the room where a camera tells him from it."""
MOVING = 0.25
"""Part of a pixel of the smaller pictures that moves, at least."""

Mask = Bool[np.ndarray, "_h _w"]


def still_zones(
    zones: Mapping[int, Mask],
    movements: Mapping[int, Mask],
    pictures: Mapping[int, UInt8[np.ndarray, "_h _w 3"]],
    cameras: Mapping[int, Camera],
) -> dict[int, Mask]:
    """The parts of the zones (`moving_zones`) in which what never changes may be somebody.

    That is what a camera tells from the room and most others do not take for it; and what all the others tell from it.
    By camera, `movements` are where anything moves in the clip, and `pictures` (BGR) are typical ones of it.
    """
    small_zones = {k: _small(zone.astype(np.uint8), cv2.INTER_NEAREST) > 0 for k, zone in zones.items()}
    moving = {k: _small(movements[k].astype(np.float32), cv2.INTER_AREA) > MOVING for k in zones}
    seeing = [k for k in zones if moving[k].any()]
    if len(seeing) < 2:
        return dict(zones)
    cut = lambda k: unlike_the_room(_small(pictures[k], cv2.INTER_AREA), small_zones[k]) | moving[k]
    with ThreadPoolExecutor() as pool:
        unlike = dict(zip(seeing, pool.map(cut, seeing), strict=True))
    small = {k: resized(cameras[k], unlike[k].shape[::-1]) for k in seeing}
    found = cube_around([moving[k] for k in seeing], [small[k] for k in seeing])
    cube = Cube(found.centre, max(found.size, SMALLEST_ROOM))
    pixels = {k: voxel_pixels(cube, small[k], unlike[k].shape) for k in seeing}
    missed = {k: ~pixels[k].hits(widened(unlike[k], pixels[k].footprint)) for k in seeing}
    misses = np.sum([*missed.values()], axis=0)
    inside = np.sum([pixels[k].inside for k in seeing], axis=0) >= SEEING * len(seeing)
    surely = inside & (misses <= (1 if len(seeing) >= MANY else 0))
    still = dict(zones)
    for k in seeing:
        perhaps = inside & (misses - missed[k] <= int(MISTAKEN * len(seeing)))
        told = (pixels[k].silhouette_of(perhaps) & unlike[k]) | pixels[k].silhouette_of(surely)
        still[k] = cv2.resize(told.astype(np.uint8), zones[k].shape[::-1], interpolation=cv2.INTER_NEAREST) > 0
    return still


def _small(picture: np.ndarray, interpolation: int) -> np.ndarray:
    scale = min(COARSE_SIDE / max(picture.shape[:2]), 1.0)
    size = (round(scale * picture.shape[1]), round(scale * picture.shape[0]))
    return cv2.resize(picture, size, interpolation=interpolation)
