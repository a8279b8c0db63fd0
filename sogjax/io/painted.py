"""What users paint of what stands in front of people: one picture a camera, `occluders/CAMERA.png`."""

import numpy as np
from jaxtyping import Bool

from sogjax.io.image_file import read_painted
from sogjax.io.recording import Recording


def painted_masks(recording: Recording) -> list[Bool[np.ndarray, "_height _width"] | None]:
    """Where each camera's view is hidden, however near something is; None where nothing was painted.

    Raises:
        InputError: a picture cannot be read.
    """
    files = recording.occluders
    return [read_painted(files[name]) if name in files else None for name in recording.rig.names]
