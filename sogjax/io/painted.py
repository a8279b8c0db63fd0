"""What users paint of what stands in front of people: one picture a camera, `occluders/CAMERA.png`."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool

from sogjax.errors import InputError
from sogjax.io.image_file import read_painted
from sogjax.io.recording import Recording

ALL = 0.98
"""Part of a picture that may be painted: a camera of which all is hidden sees nobody."""


def painted_masks(recording: Recording) -> list[Bool[np.ndarray, "_height _width"] | None]:
    """Where each camera's view is hidden, however near something is; None where nothing was painted.

    Raises:
        InputError: a picture cannot be read, or hides all that its camera sees.
    """
    files = recording.occluders
    return [_painted(files[name]) if name in files else None for name in recording.rig.names]


def _painted(path: Path) -> Bool[np.ndarray, "_height _width"]:
    mask = read_painted(path)
    if (share := float(mask.mean())) > ALL:
        raise InputError(
            f"{path}: {share:.0%} of it is white, so its camera sees nobody; paint only what stands in front white and "
            "the rest black, or take the camera out of `cameras` in recording.yaml"
        )
    return mask
