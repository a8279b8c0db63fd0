"""Where a picture differs from the empty scene, as opposed to being in shadow or exposed differently."""

from dataclasses import dataclass
from functools import reduce

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

WORKING_SIZE = 648
"""Pixels. Pictures are scaled down until their longer side is at most this: averaging removes noise."""
CHANGED = 8.0
"""Squared differences to the background above this, in units of the noise, are a change."""
UNDECIDED = 0.5 * CHANGED
"""What is said of a pixel whose background is unknown: neither a change nor none."""
DIFFERENT = 4.5
"""Squared differences, in units of the noise, that are left when the background may be darker or a little brighter:
above this, the colour is another one."""
SHADOW_RANGE = (0.4, 1.1)
"""Share of the background's light that a shadow or reflected light leaves."""
LIT_AGAIN = 1.7
"""Share of its light, at most, in which a background shows that was learnt from the clip, maybe in a shadow that has
gone with its owner."""
EDGE_NOISE = 0.08
"""Noise beside edges of the background, as a share of their contrast: a little misalignment and compression."""
SHADOW_CORRELATION = 0.65
"""A darker place whose pattern is that of the background to this degree is a shadow."""
PATTERN_WINDOW = 11
"""Pixels of the working picture; also how far a shadow's edge blurs the comparison."""
SATURATED = (4.0, 250.0)


@dataclass(frozen=True)
class Difference:
    """A picture beside its background, at the working size."""

    image: UInt8[np.ndarray, "rows columns 3"]
    """BGR."""
    change: Float[np.ndarray, "rows columns"]
    """Mean squared difference, in units of the noise."""
    unexplained: Float[np.ndarray, "rows columns"]
    """The part of it that a shadow does not explain."""
    changed: Bool[np.ndarray, "rows columns"]
    """Subject or shadow, without what is certainly a shadow by its pattern."""
    different: Bool[np.ndarray, "rows columns"]
    """Subject: the colour is another one."""
    unknown: Bool[np.ndarray, "rows columns"]
    """Where the background says nothing."""

    @property
    def open(self) -> Bool[np.ndarray, "rows columns"]:
        """Where the subject may be."""
        return self.changed | self.unknown


def working_size(width: int, height: int) -> tuple[int, int]:
    """Width and height of the working picture."""
    factor = min(1.0, WORKING_SIZE / max(width, height))
    return round(factor * width), round(factor * height)


def reduced_mask(mask: Bool[np.ndarray, "height width"]) -> Bool[np.ndarray, "rows columns"]:
    """A mask at the working size."""
    size = working_size(mask.shape[1], mask.shape[0])
    return cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_AREA) > 0.5


def background_difference(
    image: UInt8[np.ndarray, "height width 3"],
    background: UInt8[np.ndarray, "background_height background_width 3"],
    unknown: Bool[np.ndarray, "_rows _columns"] | None = None,
    learnt: bool = False,
) -> Difference:
    """Compare a picture with the empty scene, seen by the same camera under an exposure that may differ.

    Where the scene is not `known` (None: it is everywhere), the picture counts as changed, as the subject may be there,
    but not as different.

    A shadow is the background, darker: Horprasert, Harwood and Davis, "A Statistical Approach for Real-time Robust
    Background Subtraction and Shadow Detection" (1999). Where a brown trouser leg before a brown floor looks like one,
    the pattern may tell: a shadow keeps the floor's. Where the background is `unknown`, nothing is said. One that
    was `learnt` from the clip may have lain in a shadow then, and be lit now.
    """
    brightest = LIT_AGAIN if learnt else SHADOW_RANGE[1]
    size = working_size(image.shape[1], image.shape[0])
    small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    light = small.astype(np.float32)
    expected = _same_exposure(light, cv2.resize(background, size, interpolation=cv2.INTER_AREA).astype(np.float32))
    noise = 1.48 * float(np.median(np.abs(light - expected))) + 0.7
    contrast = cv2.morphologyEx(expected, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
    variance = noise**2 + (EDGE_NOISE * contrast) ** 2
    change = _averaged((light - expected) ** 2 / variance)
    brightness = _brightness(light, expected, 1.0 / variance)
    unexplained = _unexplained(light, expected, np.clip(brightness, SHADOW_RANGE[0], brightest), variance)
    different = opened(unexplained > DIFFERENT, 3)
    shadow = _keeps_pattern(light, expected, noise) & ((brightness < 1.0) | learnt) & ~different
    changed = opened(change > CHANGED, 3) & ~opened(shadow, 5)
    if unknown is None:
        return Difference(small, change, unexplained, changed, different, np.zeros_like(changed))
    unknown = cv2.resize(unknown.astype(np.float32), size, interpolation=cv2.INTER_AREA) > 0.5
    change, unexplained = np.where(unknown, UNDECIDED, change), np.where(unknown, 0.0, unexplained)
    return Difference(small, change, unexplained, changed & ~unknown, different & ~unknown, unknown)


def opened(mask: Bool[np.ndarray, "rows columns"], width: int) -> Bool[np.ndarray, "rows columns"]:
    """The mask without anything narrower than `width` pixels."""
    return cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, disc(width)) > 0


def closed(mask: Bool[np.ndarray, "rows columns"], width: int) -> Bool[np.ndarray, "rows columns"]:
    """The mask without gaps narrower than `width` pixels."""
    return cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, disc(width)) > 0


def widened(mask: Bool[np.ndarray, "rows columns"], pixels: int) -> Bool[np.ndarray, "rows columns"]:
    """The mask and what is at most so many pixels beside it."""
    return cv2.dilate(mask.astype(np.uint8), disc(2 * pixels + 1)) > 0


def without_holes(mask: Bool[np.ndarray, "rows columns"]) -> Bool[np.ndarray, "rows columns"]:
    """The mask with what it encloses."""
    framed = np.pad(mask, 1).astype(np.uint8)
    labels = cv2.connectedComponents(1 - framed, connectivity=4)[1]
    return (labels != labels[0, 0])[1:-1, 1:-1]


def disc(width: int) -> np.ndarray:
    """A round element for OpenCV's morphology."""
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (width, width))


def channel_max(picture: np.ndarray) -> np.ndarray:
    """The largest channel of each pixel, several times faster than numpy's maximum along an axis that short."""
    return reduce(cv2.max, cv2.split(picture))


def same_exposure(
    light: np.ndarray, background: np.ndarray, every: int = 3
) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "3"]]:
    """Gain and offset of each channel that make the empty scene most like a picture's background.

    What differs for another reason is left out by itself; of rows and columns only one in `every` is looked at.
    """
    seen, empty = (
        np.ascontiguousarray(part[::every, ::every].reshape(-1, 3).T, dtype=float) for part in (light, background)
    )
    low, high = SATURATED
    usable = ((seen > low) & (seen < high) & (empty > low) & (empty < high)).all(axis=0)
    gain, offset = np.ones(3), np.zeros(3)
    for _ in range(4):
        rest = np.abs(seen - gain[:, None] * empty - offset[:, None]).max(axis=0)
        kept = usable & (rest <= max(3.0 * float(np.median(rest)), 4.0))
        if kept.sum() < 100:
            break
        seen_there, empty_there = seen[:, kept], empty[:, kept]
        spread = np.maximum(empty_there.var(axis=1), 1e-6)
        middle_seen, middle_empty = seen_there.mean(axis=1), empty_there.mean(axis=1)
        covariance = ((seen_there - middle_seen[:, None]) * (empty_there - middle_empty[:, None])).mean(axis=1)
        gain = np.where(spread > 1.0, np.clip(covariance / spread, 0.3, 3.0), 1.0)
        offset = middle_seen - gain * middle_empty
    return gain, offset


def _same_exposure(
    light: Float[np.ndarray, "rows columns 3"], background: Float[np.ndarray, "rows columns 3"]
) -> Float[np.ndarray, "rows columns 3"]:
    """The background under the picture's exposure."""
    gain, offset = same_exposure(light, background)
    return np.clip(gain * background + offset, 0.0, 255.0).astype(np.float32)


def _averaged(squares: Float[np.ndarray, "rows columns 3"]) -> Float[np.ndarray, "rows columns"]:
    return cv2.blur(_summed(squares) / 3.0, (3, 3))


def _brightness(
    light: Float[np.ndarray, "rows columns 3"],
    expected: Float[np.ndarray, "rows columns 3"],
    weights: Float[np.ndarray, "rows columns 3"],
) -> Float[np.ndarray, "rows columns"]:
    """Brightness of each pixel and its neighbours together, in units of the background's."""
    weighted = expected * weights
    above, below = (cv2.blur(_summed(part * weighted), (3, 3)) for part in (light, expected))
    return above / (below + 1e-6)


def _summed(channels: Float[np.ndarray, "rows columns 3"]) -> Float[np.ndarray, "rows columns"]:
    """The sum of the channels, several times faster than numpy's along an axis that short."""
    return cv2.transform(channels, np.ones((1, 3), np.float32))  # pyright: ignore[reportReturnType]


def _unexplained(
    light: Float[np.ndarray, "rows columns 3"],
    expected: Float[np.ndarray, "rows columns 3"],
    share: Float[np.ndarray, "rows columns"],
    variance: Float[np.ndarray, "rows columns 3"],
) -> Float[np.ndarray, "rows columns"]:
    """Squared differences that are left where the background has a share of its light."""
    return _averaged((light - share[..., None] * expected) ** 2 / variance)


def _keeps_pattern(
    light: Float[np.ndarray, "rows columns 3"], expected: Float[np.ndarray, "rows columns 3"], noise: float
) -> Bool[np.ndarray, "rows columns"]:
    """Where the picture has the background's pattern, and there is one."""
    window = (PATTERN_WINDOW, PATTERN_WINDOW)
    grey = [cv2.cvtColor(part, cv2.COLOR_BGR2GRAY) for part in (light, expected)]
    seen, empty = (part - cv2.blur(part, window) for part in grey)
    power, contrast = cv2.blur(seen * seen, window), cv2.blur(empty * empty, window)
    correlation = cv2.blur(seen * empty, window) / np.sqrt(power * contrast + 1e-3)
    return (correlation > SHADOW_CORRELATION) & (contrast > (2.0 * noise) ** 2)
