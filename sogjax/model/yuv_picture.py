"""A picture in a video's own colours: what the codec stores, before anything is converted to red, green and blue."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import UInt8

ColorStandard = Literal["601", "709"]
"""Rec. ITU-R BT.601 or BT.709: how much red, green and blue weigh in the brightness."""


@dataclass(frozen=True)
class YuvPicture:
    """Brightness at full size, two differences of colour at half of it (4:2:0) with 128 for grey; sides are even."""

    luma: UInt8[np.ndarray, "height width"]
    blue_difference: UInt8[np.ndarray, "half_height half_width"]
    red_difference: UInt8[np.ndarray, "half_height half_width"]
    standard: ColorStandard
    full_range: bool
    """Whether black and white are 0 and 255; else 16 and 235, and the differences of colour have 224 steps."""
    bgr: Callable[[], UInt8[np.ndarray, "height width 3"]]
    """Makes the whole picture, for what needs it."""

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width."""
        return self.luma.shape[0], self.luma.shape[1]
