"""Reading npz files that come from elsewhere: no pickles, bounded, one sentence where a key is wrong."""

import io
import math
import warnings
import zipfile
import zlib
from pathlib import Path
from tokenize import TokenError
from typing import IO

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped

from sogjax.errors import InputError
from sogjax.io.files import atomic_path

Arrays = dict[str, np.ndarray]


class NpzArrays(Arrays):
    """The arrays of a file; one that it does not have is an error that names the file."""

    def __init__(self, path: Path, arrays: Arrays) -> None:
        super().__init__(arrays)
        self.path = path

    def __missing__(self, key: str) -> np.ndarray:
        raise _missing_array(self.path, self, key)


Shape = tuple[int | None, ...]
"""The lengths of an array's axes; None: any."""

MAX_BYTES = 4 * 2**30
"""Bytes that the arrays of one file may take in memory."""

_DAMAGED_HEADER = (TokenError, SyntaxError, TypeError, LookupError, RecursionError, MemoryError, Warning)
"""What numpy raises, besides ValueError, on a header that it cannot parse."""
_UNREADABLE = (OSError, ValueError, zipfile.BadZipFile, zlib.error, EOFError, KeyError, MemoryError, RuntimeError)


def read_npz(path: Path) -> NpzArrays:
    """All arrays of an npz file.

    Raises:
        InputError: no such file, no npz, pickled objects inside, or more than `MAX_BYTES`.
    """
    if not path.is_file():
        raise InputError(f"{path}: there is no such file; correct the path")
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
            if size > MAX_BYTES:
                raise InputError(f"{path}: holds {size} bytes of arrays, more than {MAX_BYTES}; cut it into parts")
            for member in archive.infolist():
                with archive.open(member) as file:
                    _check_claim(path, file, member.file_size)
        with np.load(path, allow_pickle=False) as arrays:
            return NpzArrays(path, {key: arrays[key] for key in arrays.files})
    except InputError:
        raise
    except _UNREADABLE as error:
        raise InputError(f"{path}: is not readable as npz without pickles ({error}); write it again") from error


def save_npz(path: Path, arrays: Arrays, packed: bool = True) -> None:
    """Write arrays as a whole file or not at all.

    They are `packed`, or else as large as in memory: pictures that are read again soon are written in a tenth of the
    time.

    Raises:
        InputError: the folder cannot be written, or the disk is full.
    """
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        (np.savez_compressed if packed else np.savez)(file, **arrays)  # pyright: ignore[reportArgumentType]


def check_npy(path: Path) -> None:
    """Check the size in an npy header against the file's size before memory is allocated."""
    try:
        with path.open("rb") as file:
            _check_claim(path, file, path.stat().st_size)
    except (OSError, ValueError, EOFError) as error:
        raise InputError(f"{path}: is not readable as npy ({error}); write it again") from error


def npy_header(file: IO[bytes] | io.BufferedIOBase) -> tuple[tuple[int, ...], np.dtype]:
    """Shape and type of the array in an npy file, which is read up to its first number.

    Raises:
        ValueError: no npy, a header that is damaged, or pickled objects inside.
    """
    version = np.lib.format.read_magic(file)  # pyright: ignore[reportArgumentType]
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"npy version {version} is unknown")
    form = np.lib.format
    read_header = form.read_array_header_1_0 if version == (1, 0) else form.read_array_header_2_0
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # numpy tries damaged headers again, as if Python 2 had written them
            shape, _, dtype = read_header(file)  # pyright: ignore[reportArgumentType]
    except _DAMAGED_HEADER as error:
        raise ValueError("its header is damaged") from error
    if dtype.hasobject:
        raise ValueError("it holds pickled objects")
    if any(length < 0 for length in shape):
        raise ValueError("its header claims a negative number of values")
    return shape, dtype


def _check_claim(path: Path, file: IO[bytes] | io.BufferedIOBase, size: int) -> None:
    shape, dtype = npy_header(file)
    claimed = math.prod(shape) * dtype.itemsize
    if claimed > size:
        raise InputError(f"{path}: claims {claimed} bytes of {dtype}, but holds {size}; write it again")


def float_array(path: Path, arrays: Arrays, key: str, shape: Shape) -> Float[np.ndarray, "..."]:
    """The numbers `key`, of `shape`, as floats; NaN and infinity pass."""
    values = _array(path, arrays, key, shape, "iuf", "numbers")
    return values if values.dtype.kind == "f" else values.astype(float)


def finite_array(path: Path, arrays: Arrays, key: str, shape: Shape) -> Float[np.ndarray, "..."]:
    """The finite numbers `key`, of `shape`, as floats."""
    values = float_array(path, arrays, key, shape)
    if not np.isfinite(values).all():
        where = tuple(int(i) for i in np.argwhere(~np.isfinite(values))[0])
        raise InputError(f"{path}: {key!r} is {values[where]} at {where}, not a finite number; correct it")
    return values


def int_array(path: Path, arrays: Arrays, key: str, shape: Shape) -> Int[np.ndarray, "..."]:
    """The whole numbers `key`, of `shape`."""
    return _array(path, arrays, key, shape, "iu", "whole numbers").astype(np.int64)


def bool_array(path: Path, arrays: Arrays, key: str, shape: Shape) -> Bool[np.ndarray, "..."]:
    """The truth values `key`, of `shape`."""
    return _array(path, arrays, key, shape, "b", "true or false")


def text_array(path: Path, arrays: Arrays, key: str, shape: Shape) -> Shaped[np.ndarray, "..."]:
    """The texts `key`, of `shape`."""
    if arrays.get(key, np.zeros(0)).size == 0 and 0 in shape:
        return np.empty(0, "U1")
    return _array(path, arrays, key, shape, "U", "text")


def number(path: Path, arrays: Arrays, key: str) -> float:
    """The single number `key`."""
    return float(_array(path, arrays, key, (), "iuf", "a number"))


def _array(path: Path, arrays: Arrays, key: str, shape: Shape, kinds: str, what: str) -> np.ndarray:
    if key not in arrays:
        raise _missing_array(path, arrays, key)
    values = arrays[key]
    if values.dtype.kind not in kinds:
        raise InputError(f"{path}: {key!r} is of type {values.dtype}; it should hold {what}")
    fits = values.ndim == len(shape) and all(n in (None, m) for n, m in zip(shape, values.shape, strict=True))
    if not fits:
        wanted = ", ".join("any" if n is None else str(n) for n in shape)
        raise InputError(f"{path}: {key!r} has the shape {values.shape}; it should be ({wanted})")
    return values


def _missing_array(path: Path, arrays: Arrays, key: str) -> InputError:
    return InputError(f"{path}: has no array {key!r}; add it (there are: {', '.join(sorted(arrays))})")
