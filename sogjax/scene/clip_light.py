"""The samples of one camera in one light: a picture that grows brighter or warmer is brought back."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.scene.plate_difference import same_exposure

MEDIAN_OF = 15
"""Samples that the reference is the median of."""
LOOKED_AT = 4000
"""About so many pixels tell the light."""
NOTICED = 1.0
"""Grey levels: smaller changes of light are left alone."""

Samples = UInt8[np.ndarray, "sample rows columns 3"]


@dataclass(frozen=True)
class EvenSamples:
    """Samples in the light of their median, and how far the light moved."""

    images: Samples
    reference: UInt8[np.ndarray, "rows columns 3"]
    """Median over time: mostly background, where the subject does not stand for long."""
    drift: Float[np.ndarray, "rows columns"]
    """Standard deviation over time of what the light alone did to a grey level."""


def even_samples(images: Samples) -> EvenSamples:
    """Bring every sample into the light of the median by a gain and an offset for each channel."""
    reference = _median(images)
    every = max(round(np.sqrt(reference[..., 0].size / LOOKED_AT)), 1)
    fits = [same_exposure(image, reference, every=every) for image in images]
    evened = np.stack([_without(image, *fit) for image, fit in zip(images, fits, strict=True)])
    again = reference if np.array_equal(evened, images) else _median(evened)
    gains, offsets = (np.array(part) for part in zip(*fits, strict=True))
    return EvenSamples(evened, again, _drift(again, gains - 1.0, offsets))


def _drift(
    light: UInt8[np.ndarray, "rows columns 3"],
    slopes: Float[np.ndarray, "sample 3"],
    offsets: Float[np.ndarray, "sample 3"],
) -> Float[np.ndarray, "rows columns"]:
    """Root mean square over time and channels of `slope * light + offset`, the change of each level."""
    square, mixed, constant = (slopes**2).mean(axis=0), (slopes * offsets).mean(axis=0), (offsets**2).mean(axis=0)
    levels = np.arange(256.0)[:, None]
    table = (square * levels**2 + 2.0 * mixed * levels + constant).astype(np.float32)
    return np.sqrt(cv2.LUT(light, table[None]).mean(axis=-1))


def _without(
    image: UInt8[np.ndarray, "rows columns 3"], gain: Float[np.ndarray, "3"], offset: Float[np.ndarray, "3"]
) -> UInt8[np.ndarray, "rows columns 3"]:
    levels = np.arange(256.0)[:, None]
    table = (levels - offset) / gain
    if np.abs(table - levels).max() < NOTICED:
        return image
    return cv2.LUT(image, np.rint(table).clip(0, 255).astype(np.uint8)[None])


def _median(images: Samples) -> UInt8[np.ndarray, "rows columns 3"]:
    chosen = images[np.unique(np.linspace(0, len(images) - 1, min(MEDIAN_OF, len(images))).round().astype(int))]
    flat = np.ascontiguousarray(chosen.reshape(len(chosen), -1).T)
    return np.partition(flat, len(chosen) // 2, axis=-1)[:, len(chosen) // 2].reshape(images.shape[1:])
