"""Keypoints of a recording: where other programs' detectors saw the joints of people in each picture."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sogjax.data.keypoints.scheme import KeypointScheme


@dataclass(frozen=True)
class Keypoints:
    """Keypoints of the people in the pictures of a recording.

    The people of a picture are in no order: the first of one camera need not be the first of another, nor of the next
    frame.
    """

    scheme: KeypointScheme
    cameras: tuple[str, ...]
    points: Float[np.ndarray, "camera frame person keypoint 3"]
    """x and y in pixels of the recorded (distorted) pictures, (0, 0) being the centre of the first pixel, and
    confidence from 0 to 1; all three 0 where a keypoint was not found. Read-only."""
    warnings: tuple[str, ...] = ()
    """One sentence each: what was left out, and why."""

    def __post_init__(self) -> None:
        self.points.setflags(write=False)

    @property
    def num_frames(self) -> int:
        """Number of frames."""
        return self.points.shape[1]

    @property
    def pixels(self) -> Float[np.ndarray, "camera frame person keypoint 2"]:
        """Where they are, 0 where there is none."""
        return self.points[..., :2]

    @property
    def confidence(self) -> Float[np.ndarray, "camera frame person keypoint"]:
        """How sure the detector was, 0 where there is none."""
        return self.points[..., 2]

    @property
    def seeing(self) -> tuple[str, ...]:
        """The cameras that have any keypoints."""
        pairs = zip(self.cameras, self.confidence, strict=True)
        return tuple(name for name, confidence in pairs if (confidence > 0.0).any())

    def select(self, cameras: Sequence[str]) -> "Keypoints":
        """Those of some cameras, in their order."""
        indices = [self.cameras.index(name) for name in cameras]
        return Keypoints(self.scheme, tuple(cameras), self.points[indices], self.warnings)

    def between(self, first: int, stop: int) -> "Keypoints":
        """Those of the frames from `first` on and before `stop`."""
        return Keypoints(self.scheme, self.cameras, self.points[:, first:stop], self.warnings)
