"""How likely each pixel of a picture shows something before the background, to look at."""

import cv2
import jax
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.images.background import CameraBackground
from sogjax.images.background_cells import BackgroundCells
from sogjax.images.foreground import TEMPER, EmptyScene, log_odds
from sogjax.images.plate_difference import working_size

_log_odds = jax.jit(log_odds)


def foreground_probability(
    image: UInt8[np.ndarray, "height width 3"], background: CameraBackground
) -> Float[np.ndarray, "rows columns"]:
    """For each pixel (BGR) at the working size, as the tracker has it for cells; a half where nothing is known."""
    size = working_size(image.shape[1], image.shape[0])
    small = lambda part: cv2.resize(part, size, interpolation=cv2.INTER_AREA)
    known = small(background.known.astype(np.float32)) > 0.999
    empty = BackgroundCells(
        small(background.picture)[None, ..., ::-1], small(background.spread)[None] / 255.0, known[None]
    )
    seen = (small(image)[None, ..., ::-1] / 255.0).astype(np.float32)
    odds = _log_odds(seen, EmptyScene.from_background(empty), None)
    return np.asarray(1.0 / (1.0 + np.exp(-odds[0] / TEMPER)), np.float32)
