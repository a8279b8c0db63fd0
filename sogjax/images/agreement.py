"""Whether the masks of several cameras show one thing: each is compared with the visual hull of the others."""

from collections.abc import Mapping

import cv2
import numpy as np
from jaxtyping import Bool

from sogjax.images.plate_difference import disc, reduced_mask
from sogjax.images.visual_hull import VoxelPixels, cube_around, resized, voxel_pixels
from sogjax.model.camera import Camera

AGREEING = 0.75
"""Share of a mask that the hull of all cameras must cover. Good masks have 0.93 and more, and so had the
rough ones of a real recording; a mask without legs leaves the others with about a half."""
OWN_COVERAGE = 0.2
"""Weight of a camera's own coverage: where the rest agrees as well without either of two, the worse one is wrong."""

Mask = Bool[np.ndarray, "_h _w"]


def disagreeing_cameras(masks: Mapping[int, Mask], cameras: Mapping[int, Camera]) -> dict[int, float]:
    """Cameras whose masks the others do not confirm, and which share of each mask the hull covers without them.

    Points of space that all masks hold (the visual hull) project onto the whole of every mask if the masks show one
    thing: "silhouette coherence" (Hernandez, Schmitt and Cipolla, PAMI 2007). While some mask is covered too little,
    the camera is taken out without which the rest agree best, until two are left, of which either may be wrong.
    """
    left = list(masks)
    out: dict[int, float] = {}
    covered = hull_coverage(masks, cameras)
    while len(left) > 2 and min(covered.values()) < AGREEING:
        rest = lambda camera: {other: masks[other] for other in left if other != camera}
        without = {camera: hull_coverage(rest(camera), cameras) for camera in left}
        worst = max(left, key=lambda camera: sum(without[camera].values()) - OWN_COVERAGE * covered[camera])
        out[worst] = covered[worst]
        left.remove(worst)
        covered = without[worst]
    return out


def hull_coverage(masks: Mapping[int, Mask], cameras: Mapping[int, Camera]) -> dict[int, float]:
    """The share of each mask that the visual hull of all of them covers: 1 where they agree."""
    small = {camera: reduced_mask(mask) for camera, mask in masks.items()}
    shrunk = {camera: resized(cameras[camera], (mask.shape[1], mask.shape[0])) for camera, mask in small.items()}
    cube = cube_around([*small.values()], [shrunk[camera] for camera in small])
    pixels = {camera: voxel_pixels(cube, shrunk[camera], mask.shape) for camera, mask in small.items()}
    hull = np.all(
        [pixels[camera].hits(widened_by_half_a_voxel(mask, pixels[camera])) for camera, mask in small.items()], axis=0
    )
    return {
        camera: float((pixels[camera].silhouette_of(hull) & mask).sum() / max(mask.sum(), 1))
        for camera, mask in small.items()
    }


def widened_by_half_a_voxel(mask: Mask, pixels: VoxelPixels) -> Mask:
    """A thin limb may lie between the centres of voxels."""
    return cv2.dilate(mask.astype(np.uint8), disc(2 * (pixels.footprint // 2) + 1)) > 0
