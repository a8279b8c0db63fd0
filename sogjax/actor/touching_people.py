"""People who never stand apart: a part of the visual hull that holds several, cut between their upright axes."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import gaussian_filter, maximum_filter

from sogjax.scene.visual_hull import VOXELS, from_upright, upright

BLUR = 0.07
"""Metres over which the volume above each place of the floor is averaged: about half a trunk."""
BESIDE = 0.3
"""Metres between two people's axes, at least."""
VALLEY = 0.85
"""Volume above the way between two people, at its least, as a share of that above the smaller one, at most."""
AS_TALL, AS_LARGE = 0.75, 0.3
"""Each one's height as a share of the tallest, and volume as a share of an equal one: an arm held out is nobody."""

Voxels = Bool[np.ndarray, "voxel"]


def cut_apart(bodies: Sequence[Voxels], count: int, spacing: float, up: Float[np.ndarray, "3"]) -> list[Voxels]:
    """So many people, cut from fewer parts of a hull; the parts as they are, where they do not look like so many.

    Seen from above, the upper half of the hull has most volume over each one's trunk. What is nearer to one of these
    places is his.
    """
    if not bodies:
        return []
    whole = np.any(bodies, axis=0)
    block = upright(whole, up)
    heights = np.nonzero(block)[2]
    axes = _axes(block[:, :, (heights.min() + heights.max()) // 2 :].sum(axis=2), count, spacing)
    if len(axes) < count:
        return list(bodies)
    places = np.moveaxis(np.indices((VOXELS, VOXELS)), 0, -1)
    nearest = np.argmin([np.sum((places - axis) ** 2, axis=-1) for axis in axes], axis=0)
    people = [whole & from_upright(np.repeat((nearest == k)[:, :, None], VOXELS, axis=2), up) for k in range(count)]
    tall = [np.ptp(np.nonzero(upright(person, up))[2]) for person in people]
    large = [int(person.sum()) for person in people]
    fits = min(tall) >= AS_TALL * max(tall) and min(large) >= AS_LARGE * whole.sum() / count
    return people if fits else list(bodies)


def _axes(volume: Int[np.ndarray, "x y"], count: int, spacing: float) -> list[np.ndarray]:
    """The places over which there is most, from the largest on; less is over what lies between any two of them."""
    smooth = gaussian_filter(volume.astype(float), BLUR / spacing)
    width = 2 * round(BESIDE / spacing) + 1
    peaks = np.argwhere((smooth == maximum_filter(smooth, width)) & (smooth > 0.0))
    chosen: list[np.ndarray] = []
    for peak in peaks[np.argsort(-smooth[tuple(peaks.T)], kind="stable")]:
        if len(chosen) < count and all(
            _between(smooth, peak, other) < VALLEY * smooth[tuple(peak)] for other in chosen
        ):
            chosen.append(peak)
    return chosen


def _between(values: Float[np.ndarray, "x y"], one: np.ndarray, other: np.ndarray) -> float:
    """The least value on the way from one place to another."""
    steps = np.linspace(one, other, 2 * int(np.abs(other - one).max()) + 1)
    return float(values[tuple(np.rint(steps).astype(int).T)].min())
