"""Single images and masks, and exposure and white balance evened out between cameras."""

from functools import lru_cache
from pathlib import Path

import cv2
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, UInt8

from sogjax.errors import InputError
from sogjax.io.files import write_file
from sogjax.model.color import from_linear_light, linear_light

IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg")
MAX_PIXELS = 2**27
"""The most that a picture may have; its header is checked against this before memory is allocated."""
ColorGains = tuple[float, float, float]
"""Factors of red, green and blue, in linear light."""


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


def read_painted(path: Path) -> Bool[np.ndarray, "height width"]:
    """Where the image in `path`, grey or in colours, is painted white (brighter than half) and is not transparent.

    Raises:
        InputError: no such file, or no image.
    """
    image = _decode(path, cv2.IMREAD_UNCHANGED)
    image = image.reshape(*image.shape[:2], -1).astype(np.float32) / np.iinfo(image.dtype).max
    seen = image[..., -1] if image.shape[-1] in (2, 4) else np.ones(image.shape[:2], np.float32)
    return image[..., :3].mean(axis=-1) * seen > 0.5 if image.shape[-1] != 2 else image[..., 0] * seen > 0.5


def write_mask(path: Path, mask: Bool[np.ndarray, "height width"]) -> None:
    """Write a mask as PNG, white where it is true, in one piece or not at all.

    Raises:
        InputError: the folder cannot be written.
    """
    write_image(path, mask.astype(np.uint8) * 255)


def write_image(path: Path, image: UInt8[np.ndarray, "height width *channel"]) -> None:
    """Write a picture (grey or BGR) as JPEG where the path ends in .jpg, else as PNG, in one piece or not at all.

    Raises:
        InputError: the folder cannot be written.
    """
    write_file(path, cv2.imencode(".jpg" if path.suffix == ".jpg" else ".png", image)[1].tobytes())


def _decode(path: Path, flags: int) -> np.ndarray:
    try:
        content = _content(path)
        width, height = claimed_size(content)
        if width * height > MAX_PIXELS:
            raise InputError(f"{path}: claims {width}x{height} pixels, more than {MAX_PIXELS}; make it smaller")
        image = cv2.imdecode(np.frombuffer(content, np.uint8), flags)
    except (OSError, cv2.error) as error:
        reason = getattr(error, "strerror", None) or "it is empty or too large"
        raise InputError(f"{path}: cannot be read as an image ({reason}); replace it") from error
    if image is None:
        raise InputError(f"{path}: cannot be read as an image; replace it by a png or jpg that opens")
    return image


def _content(path: Path) -> bytes:
    most = 2**29
    if path.stat().st_size > most:
        raise InputError(f"{path}: has more than {most} bytes, too many for a picture; make it smaller")
    return path.read_bytes()


def claimed_size(content: bytes) -> tuple[int, int]:
    """Width and height as the header of a png or jpg says; (0, 0) where there is none, or another format."""
    if content[:8] == b"\x89PNG\r\n\x1a\n" and len(content) >= 24:
        return int.from_bytes(content[16:20], "big"), int.from_bytes(content[20:24], "big")
    return _jpeg_size(content) if content[:2] == b"\xff\xd8" else (0, 0)


def _jpeg_size(content: bytes) -> tuple[int, int]:
    """The largest size in the frame headers (SOF0 to SOF15) of a jpg, passing from segment to segment."""
    place, largest = 2, (0, 0)
    while place + 9 <= len(content):
        if content[place] != 0xFF:
            place += 1
            continue
        marker = content[place + 1]
        if marker == 0xFF or marker == 0x01 or 0xD0 <= marker <= 0xD8:
            place += 1 if marker == 0xFF else 2
            continue
        if marker in (0xD9, 0xDA):
            break
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height, width = (int.from_bytes(content[place + k : place + k + 2], "big") for k in (5, 7))
            largest = max(largest, (width, height), key=lambda size: size[0] * size[1])
        place += 2 + max(int.from_bytes(content[place + 2 : place + 4], "big"), 2)
    return largest


def evened(image: UInt8[np.ndarray, "height width 3"], gains: ColorGains | None) -> UInt8[np.ndarray, "height width 3"]:
    """A picture (BGR) as it were with other exposure and white balance; None: as it is."""
    return image if gains is None else cv2.LUT(image, _table(gains))


@lru_cache
def _table(gains: ColorGains) -> UInt8[np.ndarray, "1 256 3"]:
    """The byte that every byte of blue, green and red becomes."""
    grey = jnp.repeat(jnp.arange(256, dtype=jnp.float32)[:, None] / 255.0, 3, axis=1)
    light = linear_light(grey) * jnp.asarray(gains[::-1], jnp.float32)[None]
    return np.rint(255.0 * np.asarray(from_linear_light(jnp.clip(light, 0.0, 1.0)))).astype(np.uint8)[None]
