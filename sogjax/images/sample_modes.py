"""The colours that a pixel shows again and again: the densest groups of its samples."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

MODES = 3
"""Groups that are looked for in each pixel."""


@dataclass(frozen=True)
class Modes:
    """Up to `MODES` groups of the samples of some pixels, the densest first."""

    colors: Float[np.ndarray, "mode 3 pixel"]
    """Mean of the members, BGR."""
    deviations: Float[np.ndarray, "mode pixel"]
    """Standard deviation of a channel among the members, grey levels."""
    members: Bool[np.ndarray, "mode sample pixel"]
    """Which samples belong to it; none where there is no such group."""

    @property
    def counts(self) -> np.ndarray:
        """How many samples belong to each."""
        return self.members.sum(axis=1)


def modes_of(
    samples: UInt8[np.ndarray, "sample 3 pixel"],
    usable: Bool[np.ndarray, "sample pixel"],
    tolerance: UInt8[np.ndarray, "pixel"],
) -> Modes:
    """The densest groups: samples whose every channel is within `tolerance` of the one with the most neighbours."""
    neighbours = np.where(usable, neighbour_counts(samples, usable, tolerance), 0)
    left, found = usable.copy(), []
    for _ in range(MODES):
        counts = np.where(left, neighbours, 0)
        centre = np.take_along_axis(samples, counts.argmax(axis=0)[None, None].repeat(3, axis=1), axis=0)[0]
        distance = _distance(samples, centre)
        members = left & (distance <= tolerance)
        found.append((*_mean_and_deviation(samples, members), members))
        left = left & (distance > 1.5 * tolerance)
    colors, deviations, members = (np.stack(part) for part in zip(*found, strict=True))
    return Modes(colors, deviations, members)


def neighbour_counts(
    samples: UInt8[np.ndarray, "sample 3 pixel"],
    usable: Bool[np.ndarray, "sample pixel"],
    tolerance: UInt8[np.ndarray, "pixel"],
) -> UInt8[np.ndarray, "sample pixel"]:
    """How many samples of the same pixel are within the tolerance of each, itself among them."""
    counts = usable.astype(np.uint8)
    for i in range(len(samples)):
        for j in range(i + 1, len(samples)):
            apart = cv2.absdiff(samples[i], samples[j])
            near = np.maximum(np.maximum(apart[0], apart[1]), apart[2]) <= tolerance
            near &= usable[i] & usable[j]
            counts[i] += near
            counts[j] += near
    return counts


def _distance(
    samples: UInt8[np.ndarray, "sample 3 pixel"], centre: UInt8[np.ndarray, "3 pixel"]
) -> UInt8[np.ndarray, "sample pixel"]:
    return np.stack([cv2.absdiff(sample, centre).max(axis=0) for sample in samples])


def _mean_and_deviation(
    samples: UInt8[np.ndarray, "sample 3 pixel"], members: Bool[np.ndarray, "sample pixel"]
) -> tuple[Float[np.ndarray, "3 pixel"], Float[np.ndarray, "pixel"]]:
    total, squares = np.zeros(samples.shape[1:], np.float32), np.zeros(samples.shape[1:], np.float32)
    for sample, member in zip(samples, members, strict=True):
        light = sample * member.astype(np.float32)
        total += light
        squares += light * light
    count = np.maximum(members.sum(axis=0), 1).astype(np.float32)
    mean = total / count
    return mean, np.sqrt(np.maximum(squares / count - mean * mean, 0.0).mean(axis=0))
