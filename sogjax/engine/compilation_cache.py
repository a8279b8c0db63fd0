"""Compiled programs kept on disk, so that the next start is quicker."""

import contextlib
import hashlib
import os
import platform
import sys
import tempfile
import warnings
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

from sogjax.data.cache_folder import OFF, default_cache_dir, sweep
from sogjax.errors import InputError

VARIABLE = "SOGJAX_COMPILATION_CACHE"
"""The environment variable with the folder, or `off`; without it programs lie beside other things that are kept."""
LARGEST = 1_000_000_000
"""Bytes that kept programs may take; a recording of its own takes about three million."""
TRIED, REFUSED = "tried", "refused"
"""Names of files in the folder: kept programs were taken there; were not, and why."""
_NOT_READ = "Error reading persistent compilation cache entry"
_NOT_OF_THIS_MACHINE = "AOT result"
"""Part of what is written to standard error about a program that may not run on this processor."""


def use_compilation_cache() -> None:
    """Keep compiled programs, and use those that are kept, unless the environment variable says `off`.

    Each version of jaxlib and each kind of processor has its own subfolder: a program compiled for one may fail on
    another. Where the folder cannot be written, or kept programs are not taken, everything is compiled anew.

    Raises:
        InputError: the folder that the variable names cannot be made.
    """
    name = os.environ.get(VARIABLE, "")
    if name.lower() == OFF or (not name and os.environ.get("JAX_COMPILATION_CACHE_DIR")):
        return
    folder = Path(name).expanduser() if name else default_cache_dir() / "programs"
    own = folder / f"jaxlib-{version('jaxlib')}-{_processor()}"
    try:
        own.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        if not name:
            return
        reason = error.strerror or str(error)
        raise InputError(f"{VARIABLE}={name}: no folder can be made there ({reason}); choose another") from error
    if not os.access(own, os.W_OK) or (own / REFUSED).exists():
        return
    sweep(folder, "*/*-cache", LARGEST)
    _use(str(own))
    if not (own / TRIED).exists():
        reason = refusal()
        with contextlib.suppress(OSError):
            (own / (REFUSED if reason else TRIED)).write_text(reason, encoding="utf-8")
        if reason:
            _use(None)


def _use(folder: str | None) -> None:
    """Tell jax, now or when it is imported; processes that are started from this one know it, too."""
    # A program that cannot be read is compiled: nothing that a person has to know.
    warnings.filterwarnings("ignore", message=_NOT_READ)
    options = {
        "jax_compilation_cache_dir": folder,
        "jax_persistent_cache_min_compile_time_secs": 0.0,
        "jax_persistent_cache_min_entry_size_bytes": -1,
    }
    for key, value in options.items():
        if value is None:
            os.environ.pop(key.upper(), None)
        else:
            os.environ[key.upper()] = str(value)
        if "jax" in sys.modules:
            sys.modules["jax"].config.update(key, value)


def refusal() -> str:
    """Why a program that was just kept is not taken back without a complaint; empty: it is."""
    import jax
    import jax.numpy as jnp

    one = jnp.ones(3)
    with tempfile.TemporaryFile() as said, warnings.catch_warnings(record=True) as complaints:
        warnings.simplefilter("always")
        with _standard_error_to(said.fileno()):
            for _ in range(2):  # the second function is the same program, but jax does not know that
                jax.jit(lambda x: jnp.sin(x) * 2.0 + 1.0)(one).block_until_ready()
        said.seek(0)
        lines = said.read().decode(errors="replace").splitlines()
    reasons = [str(each.message) for each in complaints if _NOT_READ in str(each.message)]
    return "\n".join(reasons + [line for line in lines if _NOT_OF_THIS_MACHINE in line])


@contextlib.contextmanager
def _standard_error_to(file: int) -> Iterator[None]:
    """Send what is written to the process's standard error, by compiled code as well, to an open file instead."""
    sys.stderr.flush()
    before = os.dup(2)
    os.dup2(file, 2)
    try:
        yield
    finally:
        sys.stderr.flush()
        os.dup2(before, 2)
        os.close(before)


def _processor() -> str:
    """A short name for the kind of processor and its features."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = [platform.processor()]
    kinds = ("model name", "flags", "Features", "CPU part")
    described = sorted({line for line in lines if line.startswith(kinds)}) or [platform.machine()]
    return hashlib.sha256("\n".join(described).encode()).hexdigest()[:12]
