"""Kept programs that cannot be read are deleted: jax compiles them, but writes none where a file lies already.

Compiled programs kept on disk, so that the next start is quicker.
"""

import contextlib
import glob
import hashlib
import os
import platform
import re
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import entry_points, version
from pathlib import Path
from typing import Any

from sogjax.errors import InputError
from sogjax.io.cache_folder import OFF, default_cache_dir, named_folder, sweep
from sogjax.io.files import atomic_path

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


VARIABLE = "SOGJAX_COMPILATION_CACHE"
"""The environment variable with the folder, or `off`; without it programs lie beside other things that are kept."""
LARGEST = 1_000_000_000
"""Bytes to which kept programs are cut back once a day; a recording of its own takes about three million."""
TRIED, REFUSED = "tried", "refused"
"""Names of files in the folder: kept programs were taken there; were not, and why."""
_NOT_OF_THIS_MACHINE = "AOT result"
"""Part of what is written to standard error about a program that may not run on this processor."""


COMPILER_VARIABLE = "XLA_FLAGS"
LEVEL = "--xla_backend_optimization_level"


def use_compiler_options() -> None:
    """Let XLA compile for the CPU at LLVM's level 1, unless the environment names a level.

    A step is compiled in 14 % less time than at the default (3) and runs as fast or faster. To be called before
    jax compiles anything. With a plugin for another device, nothing is changed.
    """
    flags = os.environ.get(COMPILER_VARIABLE, "")
    if LEVEL not in flags and not entry_points(group="jax_plugins"):
        os.environ[COMPILER_VARIABLE] = f"{flags} {LEVEL}=1".strip()


def use_compilation_cache() -> None:
    """Keep compiled programs, and use those that are kept, unless the environment variable says `off`.

    Where the folder cannot be written, or kept programs are not taken, everything is compiled anew.

    Raises:
        InputError: the folder that the variable names cannot be made.
    """
    name = os.environ.get(VARIABLE, "")
    if name.lower() == OFF or (not name and os.environ.get("JAX_COMPILATION_CACHE_DIR")):
        return
    own = programs_folder()
    if own is None:
        return
    try:
        own.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        if not name:
            return
        reason = error.strerror or str(error)
        raise InputError(f"{VARIABLE}={name}: no folder can be made there ({reason}); choose another") from error
    if not os.access(own, os.W_OK) or refusal(own):
        return
    sweep(own.parent, "*/*-cache", LARGEST)
    _use(str(own))
    forget_unread(own)
    if not (own / TRIED).exists() and not _taken_back(own):
        _use(None)


def programs_folder() -> Path | None:
    """Where programs of this jaxlib and processor are kept, as one compiled for another may fail; None: nowhere.

    Raises:
        InputError: the folder that the variable names cannot be known.
    """
    chosen = named_folder(VARIABLE)
    if chosen is None:
        try:
            chosen = default_cache_dir() / "programs"
        except InputError:
            return None
    return chosen / f"jaxlib-{version('jaxlib')}-{_processor()}"


def refusal(folder: Path) -> str:
    """What was said of programs of this folder that are not of this machine; empty: nothing."""
    try:
        text = (folder / REFUSED).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return ""
    return text if _NOT_OF_THIS_MACHINE in text else ""


def why_not_kept() -> str:
    """Why a command keeps no programs, and what can be done."""
    if os.environ.get(VARIABLE, "").lower() == OFF:
        return f"{VARIABLE}={OFF}"
    folder = programs_folder()
    remedy = f"{VARIABLE}=FOLDER may name another folder"
    if folder is None:
        return f"no home folder is known; {remedy}"
    if said := refusal(folder):
        return f"{folder / REFUSED} says: {' '.join(said.split())}; delete that file to have it tried again"
    return f"not possible in {folder}; {remedy}"


def _use(folder: str | None) -> None:
    """Tell jax, now or when it is imported; processes that are started from this one know it, too."""
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
    if "jax" in sys.modules:
        from jax.experimental.compilation_cache.compilation_cache import reset_cache

        reset_cache()  # jax looks up the folder once only


def _taken_back(folder: Path) -> bool:
    """Whether a program that was just kept is taken back, which is noted; not where the disk was in the way."""
    said = complaints()
    refused = [line for line in said if _NOT_OF_THIS_MACHINE in line]
    for line in said:
        if (damaged := NOT_READ.match(line) or NOT_WRITTEN.match(line)) is not None:
            delete_programs(folder, damaged[1])
    if refused or not said:
        with contextlib.suppress(InputError, OSError), atomic_path(folder / (REFUSED if refused else TRIED)) as file:
            file.write_text("\n".join(refused), encoding="utf-8")
    return not said


def complaints() -> list[str]:
    """What is said, line by line, where a program is kept and taken back."""
    import jax
    import jax.numpy as jnp

    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        one = jnp.ones(3)
        try:
            with tempfile.TemporaryFile() as said:
                with _standard_error_to(said.fileno()):
                    for _ in range(2):  # the second function is the same program, but jax does not know that
                        jax.jit(lambda x: jnp.sin(x) * 2.0 + 1.0)(one).block_until_ready()
                said.seek(0)
                lines = said.read().decode(errors="replace").splitlines()
        except OSError as error:  # no room for temporary files
            return [*_of_the_disk(found), str(error)]
    return [*_of_the_disk(found), *(line for line in lines if _NOT_OF_THIS_MACHINE in line)]


def _of_the_disk(found: Sequence[warnings.WarningMessage]) -> list[str]:
    told = [str(each.message) for each in found]
    return [text for text in told if NOT_READ.match(text) or NOT_WRITTEN.match(text)]


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
