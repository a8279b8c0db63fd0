"""How far one picture of a still scene lies beside another one, by blocks, so that who walks about does not matter."""

import cv2
import numpy as np
from jaxtyping import Float, UInt8

BLOCKS = 5
"""The picture is cut into so many columns, and as many rows as that width allows; the subject covers some of them."""
CLEAR = 0.15
"""Response of the phase correlation from which on a block tells its shift."""
FEWEST_BLOCKS = 4
FARTHEST = 1.0
"""Pixels of the working picture that a camera on a stand may shift."""


def block_shifts(
    first: UInt8[np.ndarray, "rows columns 3"], second: UInt8[np.ndarray, "rows columns 3"]
) -> Float[np.ndarray, "block 2"]:
    """How far blocks of the second picture lie from those of the first (pixels to the right and down).

    Only those with a pattern that both show.
    """
    grey = [cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY).astype(np.float32) for picture in (first, second)]
    size = max(grey[0].shape[1] // BLOCKS // 2, 8) * 2  # OpenCV finds half a pixel too much for odd sizes
    window = cv2.createHanningWindow((size, size), cv2.CV_32F)
    found = []
    for row in range(0, grey[0].shape[0] - size + 1, size):
        for column in range(0, grey[0].shape[1] - size + 1, size):
            before, after = (np.ascontiguousarray(one[row : row + size, column : column + size]) for one in grey)
            shift, response = cv2.phaseCorrelate(before, after, window)
            if response > CLEAR:
                found.append(shift)
    return np.array(found).reshape(-1, 2)
