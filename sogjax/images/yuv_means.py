"""Red, green and blue of a mean, from the means of brightness and differences of colour.

The conversion is linear, so that the mean of the converted pixels is the converted mean: except where pixels of a cell
are brighter or more colourful than red, green and blue can be, which are cut off one by one in a picture.
"""

from functools import lru_cache

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.data.yuv_picture import ColorStandard

WEIGHTS: dict[ColorStandard, tuple[float, float]] = {"601": (0.299, 0.114), "709": (0.2126, 0.0722)}
"""Of red and blue in the brightness; the rest is green's."""
DROPPED = 0.5
"""Grey levels that FFmpeg's converter loses on average with every product, whose fractions it drops. They are taken off
here too, so that cells do not depend on how a video was read."""


def rgb_of_means(
    luma: Float[np.ndarray, "rows columns"],
    blue_difference: Float[np.ndarray, "rows columns"],
    red_difference: Float[np.ndarray, "rows columns"],
    standard: ColorStandard,
    full_range: bool,
) -> UInt8[np.ndarray, "rows columns 3"]:
    """RGB of cells from the means of a video's own channels."""
    channels = cv2.merge([luma, blue_difference, red_difference])
    rgb = cv2.transform(channels, _conversion(standard, full_range))
    return np.rint(np.clip(rgb, 0.0, 255.0)).astype(np.uint8)


@lru_cache
def _conversion(standard: ColorStandard, full_range: bool) -> Float[np.ndarray, "3 4"]:
    """To red, green and blue, with an offset in the last column (ITU-T H.273, Section 8.3)."""
    red, blue = WEIGHTS[standard]
    green = 1.0 - red - blue
    bright, colorful, black = (1.0, 1.0, 0.0) if full_range else (255.0 / 219.0, 255.0 / 224.0, 16.0)
    of_blue, of_red = 2.0 * (1.0 - blue) * colorful, 2.0 * (1.0 - red) * colorful
    matrix = np.array(
        [
            [bright, 0.0, of_red],
            [bright, -of_blue * blue / green, -of_red * red / green],
            [bright, of_blue, 0.0],
        ]
    )
    products = np.array([1.0, 2.0, 1.0]) + (0.0 if full_range else 1.0)
    offset = -matrix @ np.array([black, 128.0, 128.0]) - DROPPED * products
    return np.column_stack([matrix, offset]).astype(np.float32)
