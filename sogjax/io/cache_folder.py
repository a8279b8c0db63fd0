"""Where what can be made again is kept between runs: rendered recordings, compiled programs, learnt backgrounds."""

import contextlib
import os
import time
from pathlib import Path

from sogjax.errors import InputError

VARIABLE = "SOGJAX_CACHE"
"""The environment variable that names another folder."""
OFF = "off"
"""Value of a variable that names a folder of its own: nothing is kept."""
SWEPT, SWEPT_EVERY = "swept", 86400.0
"""Name of the file that says when a folder was last looked through, and seconds until that is done again."""


def default_cache_dir() -> Path:
    """The folder that SOGJAX_CACHE names, else one in the system's folder for caches.

    Raises:
        InputError: no home folder is known, as in containers whose user has no name, and no variable names a folder.
    """
    system = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    if (own := named_folder(VARIABLE)) is not None:
        return own
    try:
        return Path(system) / "sogjax" if system else Path.home() / ".cache" / "sogjax"
    except RuntimeError as error:
        raise InputError(
            f"nothing can be kept, since no home folder is known; {VARIABLE}=FOLDER in the environment names another"
        ) from error


def named_folder(variable: str) -> Path | None:
    """The folder that an environment variable names, `~` for the home; None: it names none.

    Raises:
        InputError: it begins with `~`, and no home folder is known.
    """
    name = os.environ.get(variable)
    try:
        return Path(name).expanduser() if name else None
    except RuntimeError as error:
        raise InputError(f"{variable}={name}: no home folder is known; write the folder without ~") from error


def sweep(folder: Path, pattern: str, largest: int) -> None:
    """Delete files without content, and those not used for longest where a folder holds more than so many bytes.

    Looks once a day; does nothing where it may not.
    """
    mark = folder / SWEPT
    with contextlib.suppress(OSError):
        if mark.exists() and time.time() - mark.stat().st_mtime < SWEPT_EVERY:
            return
        mark.touch()
        files = [(path, path.stat()) for path in folder.glob(pattern)]
        found = sorted((max(status.st_atime, status.st_mtime), status.st_size, path) for path, status in files)
        excess = sum(size for _, size, _ in found) - largest
        if excess > 0:
            excess += largest // 4
        for _, size, path in found:
            if size == 0 or excess > 0:
                path.unlink(missing_ok=True)
                excess -= size
