"""Arrays that grow row by row on disk and can be read at any moment, also after the writer was killed.

A folder with two files: `constant.npz` has what is known from the beginning, `rows.npy` one structured row an entry.
Rows are only ever appended; the header of `rows.npy`, whose length does not change, is brought up to date after them.
"""

from pathlib import Path
from types import TracebackType

import numpy as np

from sogjax.data.atomic import atomic_path, disk_trouble_told
from sogjax.data.npz_file import check_npy, read_npz
from sogjax.errors import InputError

CONSTANT, ROWS = "constant.npz", "rows.npy"

Arrays = dict[str, np.ndarray]


class ArrayLog:
    """Writes such a folder, which is made, or begun anew; the file stays open until `close`.

    Raises:
        InputError: the folder cannot be written, here or later.
    """

    def __init__(self, folder: Path, constant: Arrays, first_rows: Arrays):
        with atomic_path(folder / CONSTANT) as temporary, temporary.open("wb") as file:
            np.savez(file, **constant)  # pyright: ignore[reportArgumentType]
        self._path = folder / ROWS
        self._dtype = np.dtype([(name, rows.dtype, rows.shape[1:]) for name, rows in first_rows.items()])
        self._count = 0
        with disk_trouble_told(self._path):
            self._file = self._path.open("wb")
        self.append(first_rows)

    def append(self, rows: Arrays) -> None:
        """Write more rows, of the same names, types and shapes as the first ones."""
        records = np.empty(len(next(iter(rows.values()))), self._dtype)
        for name, values in rows.items():
            records[name] = values
        with disk_trouble_told(self._path):
            if self._count == 0:
                self._write_header()
            self._file.seek(0, 2)
            self._file.write(records.tobytes())
            self._file.flush()
            self._count += len(records)
            self._write_header()

    def close(self) -> None:
        """Close the file; what was written stays."""
        self._file.close()

    def __enter__(self) -> "ArrayLog":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _write_header(self) -> None:
        described = np.lib.format.dtype_to_descr(self._dtype)
        self._file.seek(0)
        np.lib.format.write_array_header_1_0(
            self._file, {"descr": described, "fortran_order": False, "shape": (self._count,)}
        )
        self._file.flush()


def read_log(folder: Path, mapped: bool = False) -> Arrays:
    """The constant arrays and the columns of the rows; `mapped` columns are read from disk where they are used.

    Raises:
        InputError: no such folder, or files that do not open.
    """
    constant = read_npz(folder / CONSTANT)
    path = folder / ROWS
    check_npy(path)
    try:
        rows = np.load(path, mmap_mode="r" if mapped else None, allow_pickle=False)
        return constant | {name: rows[name] for name in rows.dtype.names or ()}
    except (OSError, ValueError, EOFError) as error:
        raise InputError(f"{path}: is not readable ({error}); track again") from error
