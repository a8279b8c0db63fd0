"""Learning the background of a camera from frames spread over a clip (see docs/guide/background.md).

The samples are brought into one light first; then each pixel's background is a colour that it showed often enough.
What keeps it from being learnt is a camera that did not stand still, or nothing that moves.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from sogjax.scene.background import NOISE_FLOOR, BackgroundImage, local_contrast
from sogjax.scene.background_difference import EDGE_NOISE, channel_max, disc, opened, same_exposure
from sogjax.scene.neighbour_growth import grown, modes_of
from sogjax.scene.plates import FARTHEST, FEWEST_BLOCKS, block_shifts, median_picture

MEDIAN_OF = 15
"""Samples that the reference is the median of."""
LOOKED_AT = 4000
"""About so many pixels tell the light."""
NOTICED = 1.0
"""Grey levels: smaller changes of light are left alone."""

Picture = UInt8[np.ndarray, "rows columns 3"]
Mask = Bool[np.ndarray, "rows columns"]


@dataclass(frozen=True)
class EvenSamples:
    """Samples in the light of their median, and how far the light moved."""

    images: Sequence[Picture]
    """Those whose light needed no evening are the very samples, perhaps mapped from disk."""
    reference: UInt8[np.ndarray, "rows columns 3"]
    """Median over time: mostly background, where the subject does not stand for long."""
    drift: Float[np.ndarray, "rows columns"]
    """Standard deviation over time of what the light alone did to a grey level."""


def even_samples(images: Sequence[Picture]) -> EvenSamples:
    """Bring every sample into the light of the median by a gain and an offset for each channel."""
    reference = _median(images)
    every = max(round(np.sqrt(reference[..., 0].size / LOOKED_AT)), 1)
    fits = [same_exposure(image, reference, every=every) for image in images]
    evened = [_without(image, *fit) for image, fit in zip(images, fits, strict=True)]
    again = reference
    if any(after is not before for after, before in zip(evened, images, strict=True)):
        again = _median(evened)
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


def _median(images: Sequence[Picture]) -> Picture:
    chosen = np.unique(np.linspace(0, len(images) - 1, min(MEDIAN_OF, len(images))).round().astype(int))
    return median_picture([images[k] for k in chosen])


MOST_SAMPLES = 60
"""Frames of a clip that are looked at."""
FEWEST_AGREEING = 8
"""Samples that must show the same colour before it counts as a background that was uncovered."""
SPANS = 8
"""Parts of a clip in which movement is looked for."""
MOVING_WIDTH = 0.008
"""Width of what moves, in units of the picture's longer side; anything narrower is an edge, or flickers."""


@dataclass(frozen=True)
class SampledCamera:
    """The samples of one camera, in one light, and what can be told of each pixel alone."""

    frames: tuple[int, ...]
    """The frames of the samples, counted from the recording's first."""
    even: EvenSamples
    noise: float
    """Standard deviation of a channel where nothing happens, grey levels."""
    tolerance: UInt8[np.ndarray, "rows columns"]
    """Difference up to which two samples of a pixel may show the same thing, grey levels."""
    movements: tuple[Mask, ...]
    """Where something moves, for each of `SPANS` parts of the clip."""

    @classmethod
    def from_images(cls, images: Mapping[int, Picture]) -> "SampledCamera":
        """What the pictures of some frames tell."""
        even = even_samples([*map(np.asarray, images.values())])
        noise = _noise(even)
        contrast = local_contrast(even.reference)
        tolerance = np.clip(4.0 + 3.0 * noise + EDGE_NOISE * contrast, 0, 60).astype(np.uint8)
        spans = np.array_split(np.arange(len(images)), min(SPANS, len(images)))
        overlapping = [np.arange(max(span[0] - 1, 0), span[-1] + 1) for span in spans]
        moving = tuple(_moving([even.images[k] for k in span], tolerance) for span in overlapping)
        return cls(tuple(images), even, noise, tolerance, moving)


def learnt_background(
    camera: SampledCamera,
    zone: Mask,
    still: Mask | None = None,
    left_out: Mapping[int, Mask] | None = None,
    mostly: bool = False,
) -> BackgroundImage:
    """The background of one camera.

    Outside of the zone it is the mean of all samples. Inside it is what was uncovered: a colour that at least
    `FEWEST_AGREEING` samples show and that continues the background around it, or is seen at the same times.

    Args:
        camera: its samples.
        zone: where the subject may stand (`moving_zones`).
        still: where in it what never changes may be the subject (`still_zones`, `standing_zones`); None: everywhere.
        left_out: by frame where the tracked body is, widened; these pixels are not looked at. Everything else then
            is background, wherever enough samples agree.
        mostly: whether a colour that is only seen at the same times must be there more often than any other.
    """
    images = camera.even.images
    if left_out:
        zone = zone | np.any([*left_out.values()], axis=0)
    picture, spread = _means(images)
    known = np.ones(zone.shape, bool)
    if zone.any():
        pixels = np.flatnonzero(zone)
        samples = np.stack([np.ascontiguousarray(image.reshape(-1, 3).take(pixels, axis=0).T) for image in images])
        usable = np.ones((len(images), samples.shape[2]), bool)
        for k, frame in enumerate(camera.frames):
            if left_out is not None and frame in left_out:
                usable[k] = ~left_out[frame][zone]
        modes = modes_of(samples, usable, camera.tolerance[zone])
        if left_out is None:
            hidden = np.ones_like(zone) if still is None else still
            chosen = grown(modes, zone, hidden, picture, camera.tolerance, FEWEST_AGREEING, mostly)
        else:
            chosen = np.where(modes.counts[0] >= FEWEST_AGREEING, 0, -1)
        pick = np.maximum(chosen, 0)
        at = np.arange(len(chosen))
        picture[zone], spread[zone] = modes.colors[pick, :, at], modes.deviations[pick, at]
        known[zone] = chosen >= 0
    spread = np.sqrt(spread**2 + NOISE_FLOOR**2 + camera.even.drift**2)
    return BackgroundImage(np.rint(picture).clip(0, 255).astype(np.uint8), spread, known, "clip")


def _noise(even: EvenSamples) -> float:
    """The noise of a channel, by the median of the differences from the reference: that is where nothing happens."""
    chosen = np.stack([image[::2, ::2] for image in even.images[:: max(len(even.images) // 12, 1)]])
    apart = cv2.absdiff(chosen, np.broadcast_to(even.reference[::2, ::2], chosen.shape).copy())
    return float(1.48 * np.median(apart.mean(axis=0)))


def _moving(images: Sequence[Picture], tolerance: UInt8[np.ndarray, "rows columns"]) -> Mask:
    """Where the samples differ by more than noise, over more than an edge's width."""
    low, high = images[0].copy(), images[0].copy()
    for image in images[1:]:
        cv2.min(low, image, low)
        cv2.max(high, image, high)
    differs = channel_max(high - low) > 2.0 * tolerance
    width = 2 * max(round(0.5 * MOVING_WIDTH * max(differs.shape)), 1) + 1
    return cv2.morphologyEx(differs.astype(np.uint8), cv2.MORPH_OPEN, disc(width)) > 0


def _means(
    images: Sequence[Picture],
) -> tuple[Float[np.ndarray, "rows columns 3"], Float[np.ndarray, "rows columns"]]:
    """Mean and standard deviation over time."""
    total, squares = np.zeros(images[0].shape, np.float32), np.zeros(images[0].shape, np.float32)
    for image in images:
        cv2.accumulate(image, total)
        cv2.accumulateSquare(image, squares)
    mean = total / len(images)
    return mean, np.sqrt(np.maximum(squares / len(images) - mean**2, 0.0).mean(axis=-1))


COMPARED = 12
"""Samples that are compared with the middle one."""


def picture_shifts(images: Sequence[Picture]) -> Float[np.ndarray, "compared 2"]:
    """How far the picture lies from that of the middle sample (pixels to the right and down), for some of the samples.

    The shift of a sample is the median over blocks of the picture, by phase correlation, so neither the subject nor
    its shadow matters; 0 where hardly a block has any pattern.
    """
    chosen = np.unique(np.linspace(0, len(images) - 1, min(COMPARED, len(images))).round().astype(int))
    found = [block_shifts(images[len(images) // 2], images[k]) for k in chosen]
    return np.array([np.median(of_one, axis=0) if len(of_one) >= FEWEST_BLOCKS else np.zeros(2) for of_one in found])


FEWEST_SAMPLES = 10
"""Frames: a background that is to be seen eight times needs more."""
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
