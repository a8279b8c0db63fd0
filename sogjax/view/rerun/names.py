"""Names in a Rerun file: its timelines, and the entities of cameras, actors and runs."""

import numpy as np
import rerun as rr

from sogjax.data.motion import Motion

FRAME, TIME, ITERATION = "frame", "time", "iteration"
"""The timelines: the recording's frame, seconds since its frame 0, the solver's iterations over all frames."""


def camera_entity(camera: str) -> str:
    """The entity of a camera."""
    return f"/world/cameras/{entity_part(camera)}"


def actor_entity(actor: str) -> str:
    """The entity of an actor."""
    return f"/world/actors/{entity_part(actor)}"


def run_entity(run: str) -> str:
    """The entity of one run of several."""
    return f"/world/runs/{entity_part(run)}"


def entity_part(name: str) -> str:
    """Any name as one part of an entity's path."""
    return rr.escape_entity_path_part(name)


def time_columns(motion: Motion) -> list[rr.TimeColumn]:
    """The frames of a motion on both timelines."""
    return [rr.TimeColumn(FRAME, sequence=motion.frame), rr.TimeColumn(TIME, duration=motion.time)]


def color_bytes(colors: np.ndarray) -> np.ndarray:
    """Colours in 0..1 as bytes."""
    return np.rint(255.0 * np.clip(np.asarray(colors), 0.0, 1.0)).astype(np.uint8)
