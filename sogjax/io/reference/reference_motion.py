"""What is known of a motion that another system measured: points and joint angles by name, over its own time."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError


@dataclass(frozen=True)
class ReferenceMotion:
    """The motion of one person by another system; NaN where something is not known."""

    path: Path
    fps: float
    time: Float[np.ndarray, "frame"]
    """Seconds, increasing."""
    points: dict[str, Float[np.ndarray, "frame 3"]] = field(default_factory=dict)
    """Metres in a world with y up, by the file's names."""
    angles: dict[str, Float[np.ndarray, "frame"]] = field(default_factory=dict)
    """Degrees, unwrapped, by the file's names."""
    turns: dict[str, Float[np.ndarray, "frame 3 3"]] = field(default_factory=dict)
    """World from bone, with the file's own axes of the bones, by its names."""
    notes: tuple[str, ...] = ()
    """What was assumed in reading it."""


def checked(reference: ReferenceMotion) -> ReferenceMotion:
    """The motion itself.

    Raises:
        InputError: it has fewer than two frames, or times that do not increase.
    """
    if len(reference.time) < 2:
        raise InputError(f"{reference.path}: has fewer than two frames; give the file of a whole motion")
    if not np.isfinite(reference.time).all() or (np.diff(reference.time) <= 0).any():
        raise InputError(f"{reference.path}: its times do not increase from frame to frame; export it again")
    return reference
