"""Arrays that grow row by row on disk and can be read at any moment, also after the writer was killed.

A folder with two files: `constant.npz` has what is known from the beginning, `rows.npy` one structured row an entry.
Rows are only ever appended; the header of `rows.npy`, whose length does not change, is brought up to date after them.
"""

import os
from contextlib import ExitStack
from io import BytesIO
from pathlib import Path

import numpy as np

from sogjax.errors import InputError
from sogjax.io.files import atomic_path, disk_trouble_told
from sogjax.io.npz_file import npy_header, read_npz

CONSTANT, ROWS = "constant.npz", "rows.npy"

Arrays = dict[str, np.ndarray]


class ArrayLog:
    """Writes such a folder, which is created or overwritten; the file stays open until `close`.

    Args:
        folder: to write.
        constant: what is known from the beginning.
        first_rows: the rows to write first; they say the names, types and shapes of all.
        kept: rows of an existing log, after which this one continues; rows behind these are dropped.

    Raises:
        InputError: the folder cannot be written, here or later.
    """

    def __init__(self, folder: Path, constant: Arrays, first_rows: Arrays, kept: int = 0):
        self._path = folder / ROWS
        self._dtype = np.dtype([(name, rows.dtype, rows.shape[1:]) for name, rows in first_rows.items()])
        self._count = kept
        if not kept:
            self._path.unlink(missing_ok=True)
            with atomic_path(folder / CONSTANT) as temporary, temporary.open("wb") as file:
                np.savez(file, **constant)  # pyright: ignore[reportArgumentType]
        with ExitStack() as on_error, disk_trouble_told(self._path):
            # Without a buffer nothing waits to be written when a disk is full or a process is killed.
            self._file = on_error.enter_context(self._path.open("r+b" if kept else "wb", buffering=0))
            self._first_row = self._write_header()
            self._file.truncate(self._end)
            self.append(first_rows)
            on_error.pop_all()

    def append(self, rows: Arrays) -> None:
        """Write more rows, of the same names, types and shapes as the first ones."""
        records = np.empty(len(next(iter(rows.values()))), self._dtype)
        for name, values in rows.items():
            records[name] = values
        with disk_trouble_told(self._path):
            self._file.seek(self._end)
            self._write(records.tobytes())
            os.fsync(self._file)  # else a loss of power may leave a header that counts rows which are not there
            self._count += len(records)
            self._write_header()

    def close(self) -> None:
        """Close the file; what was written stays."""
        self._file.close()

    @property
    def _end(self) -> int:
        """Where the next row belongs, in bytes; what stands there was never counted."""
        return self._first_row + self._count * self._dtype.itemsize

    def _write_header(self) -> int:
        """Say how many rows there are; returns where the first one begins."""
        described = np.lib.format.dtype_to_descr(self._dtype)
        header = BytesIO()
        np.lib.format.write_array_header_1_0(
            header, {"descr": described, "fortran_order": False, "shape": (self._count,)}
        )
        self._file.seek(0)
        self._write(header.getvalue())
        return len(header.getvalue())

    def _write(self, content: bytes) -> None:
        """Write all of it: without a buffer, one call may write only a part."""
        left = memoryview(content)
        while left:
            left = left[self._file.write(left) :]


def read_log(folder: Path) -> Arrays:
    """The constant arrays and the columns of the rows.

    Raises:
        InputError: no such folder, or files that do not open.
    """
    constant = read_npz(folder / CONSTANT)
    path = folder / ROWS
    try:
        rows = _whole_rows(path)
    except (OSError, ValueError, EOFError) as error:
        raise InputError(f"{path}: is not readable ({error}); track again") from error
    return constant | {name: rows[name] for name in rows.dtype.names or ()}


def _whole_rows(path: Path) -> np.ndarray:
    """The rows that the header counts, without those lost to a power failure."""
    with path.open("rb") as file:
        shape, dtype = npy_header(file)
        begin = file.tell()
    if len(shape) != 1:
        raise ValueError("it holds no rows of numbers")
    count = min(shape[0], (path.stat().st_size - begin) // max(dtype.itemsize, 1))
    return np.fromfile(path, dtype, count, offset=begin)
