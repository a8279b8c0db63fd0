"""What keeps a background from being learnt from a clip, in sentences."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool

from sogjax.images.camera_shake import picture_shifts
from sogjax.images.clip_background import SampledCamera
from sogjax.images.plate_difference import opened

FEWEST_SAMPLES = 10
"""Frames: a background that is to be seen eight times needs more."""
FARTHEST = 1.0
"""Pixels of the working picture that a camera on a stand may shift."""
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
