"""Images selected by their presentation times, so that a video of varying rate becomes one of a fixed rate.

Phones and cameras that drop images write such videos: if counted, their images drift away from the others'.
"""

from collections.abc import Sequence
from typing import Generic

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.data.image_stream import Image, ImageStream

MOST_FRAMES = 50
"""Per image on average: with more, a time stamp or the rate is wrong."""
FARTHEST = 0.75
"""Frames that an image may lie away from the time it stands for; a video of even images of any rate stays below."""


def picked_images(times: Float[np.ndarray, "image"], fps: float) -> Int[np.ndarray, "frame"]:
    """For each frame of a fixed rate, counted from the first image, the image nearest in time.

    Args:
        times: of the images, in seconds, ascending.
        fps: frames per second.

    Raises:
        ValueError: there are no images, or `MOST_FRAMES` times as many frames as images.
    """
    if not len(times) or (times[-1] - times[0]) * fps > MOST_FRAMES * len(times):
        raise ValueError(f"{len(times)} images do not make a video of {fps:g} frames per second")
    wanted = _frame_times(times, fps)
    after = np.searchsorted(times, wanted).clip(0, len(times) - 1)
    before = (after - 1).clip(0)
    return np.where(wanted - times[before] <= times[after] - wanted, before, after)


def frames_without_image(
    times: Float[np.ndarray, "image"], fps: float, picked: Int[np.ndarray, "frame"]
) -> Bool[np.ndarray, "frame"]:
    """Whether the image nearest to a frame is that of another time: its own was lost."""
    return np.abs(times[picked] - _frame_times(times, fps)) * fps > FARTHEST


def _frame_times(times: Float[np.ndarray, "image"], fps: float) -> Float[np.ndarray, "frame"]:
    count = int((times[-1] - times[0]) * fps + 0.5) + 1
    return times[0] + np.arange(count) / fps


class PickedImages(Generic[Image]):
    """Some images of a source, each as often as its number stands in a row of numbers that does not fall.

    All images before them are decoded: where the rate varies, no decoder finds an image by its number.
    """

    def __init__(self, images: ImageStream[Image], numbers: Sequence[int]) -> None:
        self._images, self._numbers, self._next = images, iter(numbers), 0
        self._image: Image | None = None

    def read(self) -> Image | None:
        """The image of the next number, or None after the last."""
        number = next(self._numbers, None)
        if number is None:
            return None
        while self._next < number:
            self._images.skip()
            self._next += 1
        if self._next == number:
            self._image = self._images.read()
            self._next += 1
        return self._image

    def skip(self) -> None:
        """Pass over the next image, which may be wanted again later."""
        self.read()

    def close(self) -> None:
        """Release the file."""
        self._images.close()
