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
from sogjax.scene.coarse_views import CoarseViews, enlarged, small
from sogjax.scene.segmentation import unlike_the_room
from sogjax.scene.visual_hull import MANY

MISTAKEN = 0.25
"""Share of the other cameras that may take somebody for the room where a camera tells him from it."""
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
    views = CoarseViews.of({k: movements[k] for k in zones}, cameras)
    if views is None:
        return dict(zones)
    seeing, pixels = [*views.moving], views.pixels
    small_zone = lambda k: small(zones[k].astype(np.uint8), cv2.INTER_NEAREST) > 0
    cut = lambda k: unlike_the_room(small(pictures[k], cv2.INTER_AREA), small_zone(k)) | views.moving[k]
    with ThreadPoolExecutor() as pool:
        unlike = dict(zip(seeing, pool.map(cut, seeing), strict=True))
    missed = views.missed(unlike)
    misses = np.sum([*missed.values()], axis=0)
    surely = views.inside & (misses <= (1 if len(seeing) >= MANY else 0))
    still = dict(zones)
    for k in seeing:
        perhaps = views.inside & (misses - missed[k] <= int(MISTAKEN * len(seeing)))
        told = (pixels[k].silhouette_of(perhaps) & unlike[k]) | pixels[k].silhouette_of(surely)
        still[k] = enlarged(told, zones[k].shape)
    return still
