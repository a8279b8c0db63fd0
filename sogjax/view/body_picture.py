"""A body as coloured discs, from the front and from its left side."""

import cv2
import numpy as np
from jaxtyping import Float, UInt8

HEIGHT = 640
"""Pixels."""
BORDER = 24
BACKGROUND = (120, 120, 120)
DISC = 1.1774
"""Radius of a disc in units of sigma: where a Gaussian has fallen to a half."""
SUBPIXEL_BITS = 4


def body_picture(
    means: Float[np.ndarray, "blob 3"], sigmas: Float[np.ndarray, "blob"], colors: Float[np.ndarray, "blob 3"]
) -> UInt8[np.ndarray, "h w 3"]:
    """Front and side view (BGR) of blobs in a body's own frame: x forward, y left, z up (metres; sRGB 0..1)."""
    low, high = (means - DISC * sigmas[:, None]).min(axis=0), (means + DISC * sigmas[:, None]).max(axis=0)
    scale = (HEIGHT - 2 * BORDER) / max(float(high[2] - low[2]), 1e-3)
    # right and towards the viewer: seen from the front, the body's left is on the right
    views = [((1, 1.0), (0, 1.0)), ((0, -1.0), (1, 1.0))]
    return np.hstack([_view(means, sigmas, colors, scale, float(high[2]), *view) for view in views])


def _view(
    means: np.ndarray,
    sigmas: np.ndarray,
    colors: np.ndarray,
    scale: float,
    top: float,
    right: tuple[int, float],
    towards: tuple[int, float],
) -> UInt8[np.ndarray, "h w 3"]:
    across, depth = right[1] * means[:, right[0]], towards[1] * means[:, towards[0]]
    left = float((across - DISC * sigmas).min())
    width = round(scale * (float((across + DISC * sigmas).max()) - left)) + 2 * BORDER
    canvas = np.full((HEIGHT, width, 3), BACKGROUND, np.uint8)
    fixed = lambda value: round(float(value) * 2**SUBPIXEL_BITS)
    for k in np.argsort(depth):
        centre = (fixed(BORDER + scale * (across[k] - left)), fixed(BORDER + scale * (top - means[k, 2])))
        blue, green, red = (round(float(255 * np.clip(value, 0.0, 1.0))) for value in colors[k, ::-1])
        radius = fixed(DISC * scale * sigmas[k])
        cv2.circle(canvas, centre, radius, (blue, green, red), -1, cv2.LINE_AA, SUBPIXEL_BITS)
        cv2.circle(canvas, centre, radius, (40, 40, 40), 1, cv2.LINE_AA, SUBPIXEL_BITS)
    return canvas
