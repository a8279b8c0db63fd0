"""Compiled programs kept on disk on request, so that the next start is quicker."""

import hashlib
import os
import platform
from importlib.metadata import version
from pathlib import Path

from sogjax.errors import InputError

VARIABLE = "SOGJAX_COMPILATION_CACHE"
"""The environment variable with the folder."""


def use_compilation_cache() -> None:
    """Keep compiled programs in the folder that the environment variable names, if it is set.

    Each version of jaxlib and each kind of processor has its own subfolder: a program compiled for one may fail on
    another.

    Raises:
        InputError: the folder cannot be made.
    """
    name = os.environ.get(VARIABLE)
    if not name:
        return
    import jax

    folder = Path(name).expanduser() / f"jaxlib-{version('jaxlib')}-{_processor()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{VARIABLE}={name}: no folder can be made there ({reason}); choose another") from error
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def _processor() -> str:
    """A short name for the kind of processor and its features."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = [platform.processor()]
    kinds = ("model name", "flags", "Features", "CPU part")
    described = sorted({line for line in lines if line.startswith(kinds)}) or [platform.machine()]
    return hashlib.sha256("\n".join(described).encode()).hexdigest()[:12]
