"""Small pictures of every n-th frame, taken while a clip is decoded anyway, for the page of a run."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from sogjax.io.recording import Recording
from sogjax.io.video import read_frames
from sogjax.view.tiles import shrink

FOLDER = "pictures"
"""Their folder in that of a run that has not ended."""
WIDTH = 640
"""Pixels, at most."""
MOST_CAMERAS = 4
_JPEG = [cv2.IMWRITE_JPEG_QUALITY, 85]

Picture = UInt8[np.ndarray, "_h _w 3"]
"""BGR."""


@dataclass
class SmallPictures:
    """Pictures of some frames and cameras as JPEG; in a folder, they outlive the process.

    Threads that decode a clip offer it every picture; it takes those that it wants and does not have.
    """

    recording: Recording
    frames: Sequence[int]
    """The recording's numbers, ascending."""
    folder: Path | None = None
    """Where they are kept; None: in memory only."""
    _taken: dict[tuple[int, int], bytes] = field(default_factory=dict)

    def __post_init__(self) -> None:
        step = max(len(self.recording.rig) / MOST_CAMERAS, 1.0)
        self.cameras = [int(k * step) for k in range(min(MOST_CAMERAS, len(self.recording.rig)))]
        """The cameras, spread evenly over all."""
        self._wanted = {(camera, frame) for camera in self.cameras for frame in self.frames}

    def lacks(self, camera: int, frame: int) -> bool:
        """Whether a picture is wanted and not there yet."""
        place = camera, frame
        return place in self._wanted and place not in self._taken and not self._is_kept(*place)

    def take(self, camera: int, frame: int, image: Picture) -> None:
        """Take a picture; where the disk is full it stays in memory."""
        width, height = image.shape[1], image.shape[0]
        scale = min(WIDTH / width, 1.0)
        small = shrink(image, (max(round(scale * width), 1), max(round(scale * height), 1)))
        content = cv2.imencode(".jpg", small, _JPEG)[1].tobytes()
        try:
            if self.folder is not None:
                self.folder.mkdir(exist_ok=True, parents=True)
                partly = self._path(camera, frame).with_suffix(".part")
                partly.write_bytes(content)
                partly.replace(self._path(camera, frame))
                return
        except OSError:
            pass
        self._taken[camera, frame] = content

    def of_frame(self, frame: int) -> list[Picture | None]:
        """The pictures of a frame, for all cameras of the rig; None where there is none."""
        return [self._picture(camera, frame) for camera in range(len(self.recording.rig))]

    def read_lacking(self) -> None:
        """Read the clip for pictures that no pass came by, as where all of its cells were kept.

        Raises:
            InputError: a video cannot be read.
        """
        lacking = [
            frame
            for frame in self.frames
            if any(self.lacks(k, frame) and self._can_be_there(k, frame) for k in self.cameras)
        ]
        if not lacking:
            return
        first, wanted = lacking[0], frozenset(lacking)
        for frame, images in enumerate(read_frames(self.recording, first, lacking[-1] + 1), first):
            for camera in self.cameras if frame in wanted else ():
                if images[camera] is not None:
                    self.take(camera, frame, images[camera])

    def _can_be_there(self, camera: int, frame: int) -> bool:
        name = self.recording.rig.names[camera]
        return self.recording.has_image(name, frame) and not self.recording.is_missing(name, frame)

    def _is_kept(self, camera: int, frame: int) -> bool:
        return self.folder is not None and self._path(camera, frame).is_file()

    def _path(self, camera: int, frame: int) -> Path:
        assert self.folder is not None
        return self.folder / f"{frame}_{camera}.jpg"

    def _picture(self, camera: int, frame: int) -> Picture | None:
        content = self._taken.get((camera, frame))
        if content is None and self._is_kept(camera, frame):
            content = self._path(camera, frame).read_bytes()
        return None if content is None else cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR)  # pyright: ignore[reportReturnType]
