"""A few frames spread over a whole recording, camera by camera, passing over those between them."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import UInt8

from sogjax.errors import InputError
from sogjax.io.image_file import evened
from sogjax.io.recording import Recording
from sogjax.io.source import open_source


def spread_frames(num_frames: int, most: int) -> list[int]:
    """At most so many of the frames of a clip, evenly spread, the first and the last among them."""
    return np.unique(np.linspace(0, num_frames - 1, min(most, num_frames)).round().astype(int)).tolist()


def camera_samples(
    recording: Recording,
    camera: str,
    frames: Sequence[int],
    prepare: Callable[[UInt8[np.ndarray, "_h _w 3"]], UInt8[np.ndarray, "_rows _columns 3"]],
    threads: int = 1,
) -> dict[int, UInt8[np.ndarray, "_rows _columns 3"]]:
    """What `prepare` makes of some frames of one camera, by frame (counted from the recording's first, ascending).

    Frames of which it has no picture are absent. The file is read once, from the first of the frames to the last.

    Raises:
        InputError: it cannot be read or ends early.
    """
    wanted = [frame for frame in frames if recording.has_image(camera, frame)]
    if not wanted:
        return {}
    first = recording.first_frame + recording.frame_offset[camera]
    source = open_source(recording.sources[camera], wanted[0] + first, threads, recording.picked.get(camera))
    found, position = {}, wanted[0]
    try:
        for frame in wanted:
            for _ in range(position, frame):
                source.skip()
            image, position = source.read(), frame + 1
            if image is None and recording.fewest_cameras is not None:
                break
            if image is None or (image.shape[1], image.shape[0]) != recording.rig.image_size(camera):
                what = "ends early" if image is None else "changes its size"
                raise InputError(
                    f"{recording.sources[camera]}: {what} at frame {recording.first_frame + frame}; convert it again"
                )
            if not recording.is_missing(camera, frame):
                found[frame] = prepare(evened(image, recording.color_gains.get(camera)))
    finally:
        source.close()
    return found
