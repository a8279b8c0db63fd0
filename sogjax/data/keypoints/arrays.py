"""Keypoints as npy arrays: MediaPipe's by FreeMoCap (camera, frame, point, x y), or one file a camera."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.data.keypoints.people import cleaned
from sogjax.data.npz_file import check_npy
from sogjax.errors import InputError

MEDIAPIPE = 33
_WITH_HANDS_AND_FACE = (543, 553)
"""Points of MediaPipe's holistic model without and with the irises: the body's 33 come first."""

MAX_BYTES = 4 * 2**30


def read_keypoint_array(path: Path) -> Float[np.ndarray, "camera frame all_keypoints 3"]:
    """Keypoints of one person: x, y in pixels and confidence, which is 1 where the file gives none.

    An array of one camera has no camera axis in the file. NaN stands for a keypoint that was not found.

    Raises:
        InputError: no npy, pickled objects inside, or an array of another form.
    """
    check_npy(path)
    if path.stat().st_size > MAX_BYTES:
        raise InputError(f"{path}: is larger than {MAX_BYTES} bytes; give a file of keypoints")
    try:
        values = np.load(path, allow_pickle=False, mmap_mode="r")
    except (OSError, ValueError, EOFError) as error:
        raise InputError(f"{path}: is not readable as npy ({error}); write it again") from error
    form = "(camera, frame, point, 2 or 3) or (frame, point, 2 or 3)"
    if values.dtype.kind not in "fiu" or values.ndim not in (3, 4) or values.shape[-1] not in (2, 3, 4):
        raise InputError(
            f"{path}: is of the shape {values.shape} and type {values.dtype}; keypoints are {form} numbers"
        )
    values = values[None] if values.ndim == 3 else values
    if values.shape[2] in _WITH_HANDS_AND_FACE:
        values = values[:, :, :MEDIAPIPE]
    points = np.array(values[..., :2], np.float64)
    # A third number is MediaPipe's depth; only a fourth is a confidence.
    scores = np.array(values[..., 3]) if values.shape[-1] == 4 else np.ones(values.shape[:-1])
    scores = np.where(np.isfinite(points).all(-1), scores, 0.0)
    return cleaned(np.concatenate([points, scores[..., None]], axis=-1))
