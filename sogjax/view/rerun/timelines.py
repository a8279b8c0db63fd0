"""Names in a Rerun file: its timelines and the entities of cameras."""

import numpy as np
import rerun as rr

from sogjax.data.motion import Motion

FRAME, TIME, ITERATION = "frame", "time", "iteration"
"""The timelines: the recording's frame, seconds since its frame 0, the solver's iterations over all frames."""


def camera_entity(camera: str) -> str:
    """The entity of a camera."""
    return f"/world/cameras/{camera}"


def time_columns(motion: Motion) -> list[rr.TimeColumn]:
    """The frames of a motion on both timelines."""
    return [rr.TimeColumn(FRAME, sequence=motion.frame), rr.TimeColumn(TIME, duration=motion.time)]


def color_bytes(colors: np.ndarray) -> np.ndarray:
    """Colours in 0..1 as bytes."""
    return np.rint(255.0 * np.clip(np.asarray(colors), 0.0, 1.0)).astype(np.uint8)
