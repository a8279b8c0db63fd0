"""What keeps a background from being learnt from a clip: a camera that did not stand still, or nothing that moves."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool, Float, UInt8

from sogjax.scene.background_difference import opened
from sogjax.scene.clip_background import SampledCamera
from sogjax.scene.plates import FARTHEST, FEWEST_BLOCKS, block_shifts

COMPARED = 12
"""Samples that are compared with the middle one."""


def picture_shifts(images: UInt8[np.ndarray, "sample rows columns 3"]) -> Float[np.ndarray, "compared 2"]:
    """How far the picture lies from that of the middle sample (pixels to the right and down), for some of the samples.

    The shift of a sample is the median over blocks of the picture, by phase correlation, so neither the subject nor
    its shadow matters; 0 where hardly a block has any pattern.
    """
    chosen = np.unique(np.linspace(0, len(images) - 1, min(COMPARED, len(images))).round().astype(int))
    found = [block_shifts(images[len(images) // 2], images[k]) for k in chosen]
    return np.array([np.median(of_one, axis=0) if len(of_one) >= FEWEST_BLOCKS else np.zeros(2) for of_one in found])


FEWEST_SAMPLES = 10
"""Frames: a background that is to be seen eight times needs more."""
LEAST_MOVING = 3e-3
"""Share of a picture over which something must move. Somebody who held still for 11 frames and swayed left 0.1 %,
somebody who only lifted his arms 3 %."""
SWAYING = 0.016
"""Width, in units of the picture's longer side, of what moves where somebody only sways."""


def shaking(camera: SampledCamera) -> float:
    """How far the camera's picture moved, in pixels of the samples; 0 where that is no more than a stand's."""
    apart = float(np.linalg.norm(picture_shifts(camera.even.images), axis=1).max())
    return apart if apart > FARTHEST else 0.0


def moves(cameras: Mapping[int, SampledCamera]) -> bool:
    """Whether something moves in most cameras."""
    shares = [_more_than_sways(np.any(camera.movements, axis=0)).mean() for camera in cameras.values()]
    return float(np.median(shares)) >= LEAST_MOVING


def _more_than_sways(moving: Bool[np.ndarray, "rows columns"]) -> Bool[np.ndarray, "rows columns"]:
    return opened(moving, 2 * max(round(0.5 * SWAYING * max(moving.shape)), 1) + 1)
