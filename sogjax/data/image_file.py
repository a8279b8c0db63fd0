"""Reading single images and masks, and writing masks."""

from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from sogjax.data.atomic import atomic_path
from sogjax.errors import InputError

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg")


def read_image(path: Path) -> UInt8[np.ndarray, "height width 3"]:
    """The image in `path`, BGR; a picture that says it was taken sideways is turned upright.

    Raises:
        InputError: no such file, or no image.
    """
    return _decode(path, cv2.IMREAD_COLOR)


def read_mask(path: Path) -> Bool[np.ndarray, "height width"]:
    """Where the image in `path` is white (brighter than half).

    Raises:
        InputError: no such file, or no image.
    """
    return _decode(path, cv2.IMREAD_GRAYSCALE) > 127


def write_mask(path: Path, mask: Bool[np.ndarray, "height width"]) -> None:
    """Write a mask as PNG, white where it is true, in one piece or not at all.

    Raises:
        InputError: the folder cannot be written.
    """
    with atomic_path(path) as temporary:
        temporary.write_bytes(cv2.imencode(".png", mask.astype(np.uint8) * 255)[1].tobytes())


def _decode(path: Path, flags: int) -> np.ndarray:
    try:
        image = cv2.imdecode(np.frombuffer(path.read_bytes(), np.uint8), flags)
    except (OSError, cv2.error) as error:
        reason = getattr(error, "strerror", None) or "it is empty or too large"
        raise InputError(f"{path}: cannot be read as an image ({reason}); replace it") from error
    if image is None:
        raise InputError(f"{path}: cannot be read as an image; replace it by a png or jpg that opens")
    return image
