"""A motion that is written to disk while it is found."""

import shutil
from pathlib import Path

import numpy as np

from sogjax.io.array_log import ArrayLog, read_log
from sogjax.io.motion import FORMAT_VERSION, Motion, arrays_of

PER_FRAME = (
    "frame",
    "time",
    "pose",
    "joint_params",
    "world_from_joint",
    "blob_means",
    "similarity",
    "energy",
    "iterations",
    "converged",
)
"""The fields of a `Motion` that have a row for each frame."""
SOMETIMES_PER_FRAME = ("limb_doubt", "explained", "overlap")
"""Further ones, which a motion need not have."""


class MotionLog:
    """The motion of one actor so far, in a folder that `load_motion` reads.

    Args:
        folder: of the log.
        kept: frames of an existing log, after which this one continues; 0: start again.

    Raises:
        InputError: the folder cannot be written, here or later.
    """

    def __init__(self, folder: Path, kept: int = 0):
        self.folder = folder
        self._kept = kept
        self._log: ArrayLog | None = None

    def append(self, motion: Motion) -> None:
        """Write the frames that follow; the folder is made with the first ones."""
        arrays = arrays_of(motion)
        rows = {name: arrays.pop(name) for name in (*PER_FRAME, *SOMETIMES_PER_FRAME) if name in arrays}
        if self._log is None:
            constant = arrays | {"format_version": np.array(FORMAT_VERSION)}
            self._log = ArrayLog(self.folder, constant, rows, self._kept)
        else:
            self._log.append(rows)

    def motion(self, mapped: bool) -> Motion:
        """All that was written; `mapped`: the arrays stay on disk, as long as the folder does."""
        arrays = read_log(self.folder, mapped)
        arrays["fps"] = float(arrays["fps"])  # pyright: ignore[reportArgumentType]
        for name in {"up", "actor"} & arrays.keys():
            arrays[name] = str(arrays[name])  # pyright: ignore[reportArgumentType]
        arrays.pop("format_version")
        return Motion(**arrays)  # pyright: ignore[reportArgumentType]

    def close(self) -> None:
        """Close the file; the folder stays."""
        if self._log is not None:
            self._log.close()

    def remove(self) -> None:
        """Remove the folder, when its motion has been written as a whole."""
        self.close()
        shutil.rmtree(self.folder, ignore_errors=True)
