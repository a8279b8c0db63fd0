"""Numbers out of the nested lists of a parsed file."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError


def numbers(where: str, table: Mapping[str, Any], key: str, shape: tuple[int | None, ...]) -> Float[np.ndarray, "..."]:
    """The numbers under `key`, of `shape` (None: any length); NaN and infinity pass.

    Raises:
        InputError: no such key, or something else there; `where` begins the sentence.
    """
    if key not in table:
        raise InputError(f"{where}: has no {key!r}; add it, or calibrate the camera again")
    try:
        values = np.array(table[key], float)
    except (TypeError, ValueError, OverflowError):
        values = np.empty(())
    fits = values.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, values.shape, strict=True))
    if not fits:
        wanted = " x ".join("n" if n is None else str(n) for n in shape)
        raise InputError(f"{where}: {key} = {_short(table[key])} is not {wanted} numbers; correct it")
    return values


def image_size(where: str, table: Mapping[str, Any], key: str) -> tuple[int, int]:
    """Width and height in pixels.

    Raises:
        InputError: no two whole numbers.
    """
    size = numbers(where, table, key, (2,))
    if not (np.isfinite(size).all() and (size == np.round(size)).all()):
        raise InputError(f"{where}: {key} = {table[key]} is not two whole numbers; give width and height in pixels")
    return int(size[0]), int(size[1])


def _short(value: object) -> str:
    try:
        text = " ".join(repr(value).split())
    except (ValueError, RecursionError):  # a number of thousands of digits, a list nested as deep
        text = f"a {type(value).__name__}"
    return text if len(text) <= 200 else f"{text[:197]}..."
