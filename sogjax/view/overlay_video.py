"""The overlay video, written as the motion comes."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from types import TracebackType

import numpy as np

from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.io.video import VideoWriter
from sogjax.view.bones import Bones, bones_from_motion
from sogjax.view.overlay import WIDTH, Overlay


class OverlayVideo:
    """A video (mp4) of motions over the pictures of all cameras, within a `with` block; whole or not there.

    Args:
        path: the video.
        recording: what is tracked.
        width: largest width in pixels.
    """

    def __init__(self, path: Path, recording: Recording, width: int = WIDTH):
        self._rig, self._width = recording.rig, width
        self._video = VideoWriter(Path(path), recording.fps)
        self._bones: list[Bones] | None = None
        self._empty = Overlay(recording.rig, [], width=width)

    def __enter__(self) -> "OverlayVideo":
        self._video.__enter__()
        return self

    def tile(self, camera: int, image: np.ndarray) -> np.ndarray:
        """A camera's picture (BGR) at the size that is shown; thread-safe."""
        return self._empty.tile(camera, image)

    def write(self, motions: Sequence[Motion], tiles: Iterable[Sequence[np.ndarray | None]]) -> None:
        """Append the frames of motions, one for each actor, that follow; `tiles` of all cameras for each of them."""
        if self._bones is None:
            self._bones = [bones_from_motion(motion) for motion in motions]
        overlay = Overlay(self._rig, motions, width=self._width, bones=self._bones)
        for frame, pictures in zip(motions[0].frame, tiles, strict=True):
            self._video.write(overlay.draw(pictures, int(frame)))

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._video.__exit__(kind, error, traceback)
