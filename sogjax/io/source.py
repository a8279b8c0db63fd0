"""The images of one camera, one after the other: a video, or a folder of numbered images."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.image_folder import Bgr, ImageFolder, ImageStream, PickedImages, numbered_images, visible_files
from sogjax.io.plane_video import plane_video
from sogjax.io.video_file import VideoFile, look_at_video
from sogjax.model.yuv_picture import YuvPicture

VIDEO_SUFFIXES = (".mp4", ".avi", ".mkv", ".mov")

SYNCHRONIZED = "synchronized_videos"
"""FreeMoCap's folder of videos."""


@dataclass(frozen=True)
class SourceInfo:
    """What a camera's images are: rate (None for image folders), number, and (width, height)."""

    fps: float | None
    num_frames: int
    size: tuple[int, int]
    times: Float[np.ndarray, "frame"] | None = None
    """When each image is to be shown, in seconds, if the file says so and is not too large to read."""

    @property
    def longest_gap(self) -> float:
        """The longest time between two images, in units of the middle one: 2 where one is missing, 1 if not known."""
        gaps = np.diff(np.zeros(0) if self.times is None else self.times)
        middle = float(np.median(gaps)) if len(gaps) else 0.0
        return float(gaps.max()) / middle if middle > 0.0 else 1.0


def find_sources(folder: Path) -> dict[str, Path]:
    """By camera the video in `videos/` (of a FreeMoCap recording `synchronized_videos/`) or the folder in `images/`.

    Raises:
        InputError: there are none, or a camera has two.
    """
    found = videos_in(folder / "videos") or videos_in(folder / SYNCHRONIZED)
    found += [path for path in visible_files(folder / "images") if path.is_dir()]
    sources: dict[str, Path] = {}
    for path in found:
        camera = path.name if path.is_dir() else path.stem
        if camera in sources:
            raise InputError(f"{folder}: camera {camera!r} has both {sources[camera]} and {path}; remove one")
        sources[camera] = path
    if not sources:
        endings = " ".join(VIDEO_SUFFIXES)
        raise InputError(
            f"{folder}: has no videos; put videos/CAMERA.mp4 ({endings}) or images/CAMERA/000000.png there"
        )
    return sources


def videos_in(folder: Path) -> list[Path]:
    """The videos in a folder, sorted by name."""
    return [path for path in visible_files(folder) if path.is_file() and path.suffix.lower() in VIDEO_SUFFIXES]


def open_source(path: Path, start: int = 0, threads: int = 1, picked: Sequence[int] | None = None) -> ImageStream[Bgr]:
    """The images of a video or of an image folder from its frame `start` on; `threads` decode a video.

    Where images are `picked`, frame k is the file's image `picked[k]`; the numbers must not fall.

    Raises:
        InputError: the video or folder cannot be opened.
    """
    if picked is not None:
        return PickedImages(open_source(path, 0, threads), picked[start:])
    return ImageFolder(path, start) if path.is_dir() else VideoFile(path, start, threads)


def open_with_least_work(
    path: Path, start: int = 0, threads: int = 1, picked: Sequence[int] | None = None
) -> ImageStream[Bgr | YuvPicture]:
    """The same, but the images of a video stay in its own colours where they can be read so.

    Raises:
        InputError: the video or folder cannot be opened.
    """
    video = None if path.is_dir() else plane_video(path, 0 if picked is not None else start, threads)
    if video is None:
        return open_source(path, start, threads, picked)
    return video if picked is None else PickedImages(video, picked[start:])


def look_at_source(path: Path) -> SourceInfo:
    """Rate, length and size of a camera's images; the first image is decoded.

    Raises:
        InputError: nothing can be read.
    """
    source = open_source(path)
    try:
        image = source.read()
    finally:
        source.close()
    if image is None:
        raise InputError(f"{path}: holds no image that can be decoded; record or convert it again")
    size = (image.shape[1], image.shape[0])
    if path.is_dir():
        return SourceInfo(None, len(numbered_images(path)), size)
    facts = look_at_video(path)
    return SourceInfo(facts.fps, facts.num_frames, size, facts.times)


def fingerprint(source: Path) -> str:
    """Of a video or a folder of images: names, sizes and times of last change of its files."""
    return files_fingerprint(numbered_images(source) if source.is_dir() else [source])


def files_fingerprint(files: Sequence[Path]) -> str:
    """Of files: their names, sizes and times of last change."""
    looked = [(file.name, (state := file.stat()).st_size, state.st_mtime_ns) for file in files]
    return hashlib.sha256(json.dumps(looked).encode()).hexdigest()
