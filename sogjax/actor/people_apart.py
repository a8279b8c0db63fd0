"""Several people in one frame: parts of the visual hull that stand apart, and where each camera shows which."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from scipy.ndimage import binary_dilation, gaussian_filter, label

from sogjax.actor.frame_choice import SMALLEST_BODY, Mask, widened
from sogjax.images.segmentation import MANY
from sogjax.images.visual_hull import VOXELS, Cube, VoxelPixels, voxel_pixels, without_floor
from sogjax.model.camera import Camera

GAP = 0.25
"""Vertical gap between the parts of one body that is closed, metres: a belt in the background's colours."""
LEAST_HEIGHT = 0.4
"""Height of a part of the hull, as a share of the tallest one's, from which on it may be somebody else."""
HIDDEN = 0.1
"""Share of a silhouette that another one covers, above which a camera's mask is not used."""
COLOR_BINS = 6
"""Of each channel, in the histogram of somebody's colours."""


@dataclass(frozen=True)
class PersonSeen:
    """One of several people in one frame; everything by camera is in cells."""

    frame: int
    place: Float[np.ndarray, "3"]
    """Centre of the part of the hull, metres, world."""
    regions: dict[int, Mask]
    """Where each camera shows nobody else: the silhouette, a little widened. A camera in which another one hides the
    person, or is hidden by him, is absent."""
    masks: dict[int, Mask]
    """What is not the background there."""
    colors: Float[np.ndarray, "bin"]
    """Share of each colour, all cameras together."""


def people_apart(
    frame: int,
    masks: Mapping[int, Mask],
    unknown: Mapping[int, Mask],
    pictures: Mapping[int, UInt8[np.ndarray, "rows columns 3"]],
    cameras: Mapping[int, Camera],
    cube: Cube,
    up: Float[np.ndarray, "3"],
) -> list[PersonSeen]:
    """The people who stand apart from each other in one frame, in no particular order.

    Args:
        frame: its number.
        masks: what is not the background, shadows or not, by camera.
        unknown: where nothing is known of the background.
        pictures: the cells' colours.
        cameras: for pictures of the masks' size.
        cube: in which all of them are.
        up: the world's vertical.
    """
    pixels = {k: voxel_pixels(cube, cameras[k], mask.shape) for k, mask in masks.items()}
    misses = np.sum([~pixels[k].hits(widened(masks[k] | unknown[k])) for k in masks], axis=0)
    hull = without_floor(misses <= (1 if len(masks) >= MANY else 0), up)
    bodies = _bodies(hull.reshape(3 * (VOXELS,)), cube.spacing, int(np.argmax(np.abs(up))))
    regions = {k: _regions([pixels[k].silhouette_of(body) for body in bodies], pixels[k]) for k in masks}
    people = []
    for number, body in enumerate(bodies):
        own = {k: region for k in masks if (region := regions[k][number]) is not None}
        limited = {k: masks[k] & region for k, region in own.items()}
        place = cube.points[body].mean(axis=0)
        people.append(PersonSeen(frame, place, own, limited, color_histogram(pictures, limited)))
    return people


def color_histogram(
    pictures: Mapping[int, UInt8[np.ndarray, "_rows _columns 3"]],
    masks: Mapping[int, Bool[np.ndarray, "_rows _columns"]],
) -> Float[np.ndarray, "bin"]:
    """The share of each colour in the masks of all cameras, a little blurred; zeros where they are empty."""
    total = np.zeros(3 * (COLOR_BINS,))
    for k, mask in masks.items():
        bins = (pictures[k][mask].astype(int) * COLOR_BINS) >> 8
        np.add.at(total, tuple(bins.T), 1.0)
    return (gaussian_filter(total, 0.6) / max(total.sum(), 1.0)).ravel()


def _bodies(hull: Bool[np.ndarray, "x y z"], spacing: float, axis: int) -> list[Bool[np.ndarray, "voxel"]]:
    """The separate parts of a hull that are as tall and as large as somebody."""
    structure = np.ones([2 * round(0.5 * GAP / spacing) + 1 if k == axis else 1 for k in range(3)], bool)
    connected: Any = label(binary_dilation(hull, structure))
    labels: Int[np.ndarray, "x y z"] = np.where(hull, connected[0], 0)
    parts = [labels == number for number in range(1, connected[1] + 1)]
    volumes = [int(part.sum()) for part in parts]
    heights = [int(np.ptp(np.nonzero(part)[axis])) if part.any() else 0 for part in parts]
    large = [
        part.ravel()
        for part, volume, height in zip(parts, volumes, heights, strict=True)
        if volume > SMALLEST_BODY * max(volumes) and height > LEAST_HEIGHT * max(heights)
    ]
    return large


def _regions(silhouettes: Sequence[Mask], pixels: VoxelPixels) -> list[Mask | None]:
    """Around each silhouette of one camera, what is nearer to it than to the others; None: others cover too much."""
    width = 2 * pixels.footprint + 2
    distances = [cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 3) for mask in silhouettes]
    regions: list[Mask | None] = []
    for number, (mask, distance) in enumerate(zip(silhouettes, distances, strict=True)):
        others = [other for k, other in enumerate(distances) if k != number]
        nearest = np.min(others, axis=0) if others else np.full(mask.shape, np.inf)
        covered = float((mask & (nearest <= 1.0)).sum() / max(mask.sum(), 1))
        shown = mask.any() and covered <= HIDDEN
        regions.append((distance <= width) & (distance <= nearest) if shown else None)
    return regions
