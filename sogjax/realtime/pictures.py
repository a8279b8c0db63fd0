"""What goes through the pipeline: a camera's picture, and the pictures of one moment."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import UInt8

from sogjax.model.yuv_picture import YuvPicture

Picture = UInt8[np.ndarray, "height width 3"] | YuvPicture
"""BGR, or in a video's own colours."""


@dataclass(frozen=True)
class Taken:
    """A picture as a camera hands it over; times are seconds of `time.monotonic`."""

    picture: Picture
    exposed: float
    """When it was taken; the time of arrival, where the camera does not tell."""
    arrived: float
    number: int | None = None
    """The frame of a replayed recording."""


@runtime_checkable
class Camera(Protocol):
    """Gives the pictures of one camera as they come; used by one thread."""

    @property
    def name(self) -> str:
        """What the calibration calls it."""
        ...

    def read(self) -> Taken | None:
        """The next picture, waited for; None: there are no more.

        Raises:
            InputError: the camera stopped, or its pictures are of another size.
        """
        ...

    def close(self) -> None:
        """Release it; a `read` that waits ends soon."""
        ...


@dataclass(frozen=True)
class Seen:
    """What is kept of a camera's picture."""

    camera: int
    cells: UInt8[np.ndarray, "rows columns 3"]
    exposed: float
    arrived: float
    number: int | None = None
    picture: Picture | None = None
    """Only where somebody keeps pictures."""


@dataclass
class FrameSet:
    """The pictures of one moment."""

    exposed: float
    arrived: float
    """When the first of them came."""
    pictures: dict[int, Seen] = field(default_factory=dict)
    """By camera."""
    handed_over: float = 0.0

    @property
    def number(self) -> int | None:
        """The frame of a replayed recording."""
        return next(iter(self.pictures.values())).number

    def stacked(
        self, num_cameras: int, shape: Sequence[int]
    ) -> tuple[UInt8[np.ndarray, "camera rows columns 3"], np.ndarray]:
        """The cells of all cameras, and which of these have a picture."""
        cells, present = np.zeros((num_cameras, *shape, 3), np.uint8), np.zeros(num_cameras, bool)
        for camera, seen in self.pictures.items():
            cells[camera], present[camera] = seen.cells, True
        return cells, present
