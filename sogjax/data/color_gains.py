"""Exposure and white balance evened out between cameras: factors of red, green and blue light."""

from functools import lru_cache

import cv2
import jax.numpy as jnp
import numpy as np
from jaxtyping import UInt8

from sogjax.model.color import from_linear_light, linear_light

ColorGains = tuple[float, float, float]
"""Factors of red, green and blue, in linear light."""


def evened(image: UInt8[np.ndarray, "height width 3"], gains: ColorGains | None) -> UInt8[np.ndarray, "height width 3"]:
    """A picture (BGR) as it were with other exposure and white balance; None: as it is."""
    return image if gains is None else cv2.LUT(image, _table(gains))


@lru_cache
def _table(gains: ColorGains) -> UInt8[np.ndarray, "1 256 3"]:
    """For every byte of blue, green and red the byte that it becomes."""
    grey = jnp.repeat(jnp.arange(256, dtype=jnp.float32)[:, None] / 255.0, 3, axis=1)
    light = linear_light(grey) * jnp.asarray(gains[::-1], jnp.float32)[None]
    return np.rint(255.0 * np.asarray(from_linear_light(jnp.clip(light, 0.0, 1.0)))).astype(np.uint8)[None]
