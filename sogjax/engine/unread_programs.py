"""Kept programs that cannot be read are deleted: jax compiles them, but writes none where a file lies already."""

import contextlib
import glob
import re
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

NOT_READ, NOT_WRITTEN = (
    re.compile(rf"Error {what} persistent compilation cache entry for '([^']+)'") for what in ("reading", "writing")
)
"""How jax's warnings begin, with the program's name."""


def forget_unread(folder: Path) -> None:
    """From now on delete what jax says it cannot read in a folder, instead of showing the warning.

    That a program is compiled once more is nothing that a person has to know.
    """
    warnings.filterwarnings("always", message=NOT_READ.pattern)
    before = warnings.showwarning
    warnings.showwarning = _Deleting(folder, before.others if isinstance(before, _Deleting) else before)


def delete_programs(folder: Path, name: str) -> None:
    """Delete all programs of a name: which of them cannot be read is not told."""
    for path in folder.glob(f"{glob.escape(name)}-*cache"):
        with contextlib.suppress(OSError):
            path.unlink()


@dataclass(frozen=True)
class _Deleting:
    """In place of `warnings.showwarning`."""

    folder: Path
    others: Callable[..., None]
    """Shows all other warnings."""

    def __call__(self, message: Warning | str, *further: Any, **named: Any) -> None:
        if (unread := NOT_READ.match(str(message))) is not None:
            delete_programs(self.folder, unread[1])
        else:
            self.others(message, *further, **named)
