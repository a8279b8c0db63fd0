"""Compiled programs kept on disk, so that the next start is quicker.

jax keeps them. Here is what it leaves to others: a folder for each jaxlib and kind of processor, a trial whether this
machine takes back what it kept, a bound on the size of all, and files that cannot be read, which are deleted, since jax
compiles their programs again but writes none where a file lies already.
"""

import contextlib
import glob
import hashlib
import os
import platform
import re
import sys
import warnings
from collections.abc import Iterator
from functools import partial
from importlib.metadata import entry_points, version
from pathlib import Path
from typing import Any

from sogjax.errors import InputError
from sogjax.io.cache_folder import OFF, default_cache_dir, named_folder, sweep
from sogjax.io.files import atomic_path
from sogjax.run.compile_once import compile_once

VARIABLE = "SOGJAX_COMPILATION_CACHE"
"""The environment variable with the folder, or `off`; without it programs lie beside other things that are kept."""
LARGEST = 1_000_000_000
"""Bytes to which kept programs are cut back once a day; a recording of its own takes about ten million."""
TRIED, REFUSED = "tried", "refused"
"""Names of files in the folder: kept programs were taken there; were not, and why."""
COMPILER_VARIABLE, LEVEL = "XLA_FLAGS", "--xla_backend_optimization_level"
COMPILER_OPTIONS = {
    LEVEL: "1",
    "--xla_cpu_use_fusion_emitters": "false",
    "--xla_cpu_enable_concurrency_optimized_scheduler": "false",
    "--xla_cpu_parallel_codegen_split_count": "1",
}
"""How XLA compiles for the CPU: with the default (level 3 of LLVM, both others true, a program in pieces for threads) a
step takes half as long again to compile, and runs no faster."""
LAPACK_VARIABLE = "OPENBLAS_NUM_THREADS"
"""Threads of LAPACK, which factorises what is too small for several: those that wait for work took more time of the
processors than all else that the shape of an actor is fitted with."""
KNOWN = {
    "0.10.": tuple(COMPILER_OPTIONS),
    "0.11.": tuple(option for option in COMPILER_OPTIONS if option != "--xla_cpu_use_fusion_emitters"),
}
"""The options that a jaxlib knows whose version begins so; XLA ends the process at one that it does not know."""
_NOT_OF_THIS_MACHINE = "AOT result"
"""Part of what is written to standard error about a program that may not run on this processor."""
_DAMAGED = re.compile(r"Error (reading|writing) persistent compilation cache entry for '([^']+)'")
"""How jax's warnings begin, with the program's name."""


def use_compiler_options() -> None:
    """Let XLA compile quickly for the CPU, but for what the environment says; to be called before jax compiles.

    With a plugin for another device, only LAPACK's threads are limited.
    """
    os.environ.setdefault(LAPACK_VARIABLE, "1")
    if entry_points(group="jax_plugins"):
        return
    flags = os.environ.get(COMPILER_VARIABLE, "")
    known = next((options for start, options in KNOWN.items() if version("jaxlib").startswith(start)), (LEVEL,))
    chosen = [f"{option}={COMPILER_OPTIONS[option]}" for option in known if option not in flags]
    os.environ[COMPILER_VARIABLE] = " ".join([flags, *chosen]).strip()


def use_compilation_cache() -> None:
    """Keep compiled programs, and use those that are kept, unless the environment variable says `off`.

    Where the folder cannot be written, or kept programs are not taken, everything is compiled anew.

    Raises:
        InputError: the folder that the variable names cannot be made.
    """
    name = os.environ.get(VARIABLE, "")
    if name.lower() == OFF or (not name and os.environ.get("JAX_COMPILATION_CACHE_DIR")):
        return
    folder = programs_folder()
    if folder is None:
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        if not name:
            return
        reason = error.strerror or str(error)
        raise InputError(f"{VARIABLE}={name}: no folder can be made there ({reason}); choose another") from error
    if not os.access(folder, os.W_OK) or refusal(folder):
        return
    sweep(folder.parent, "*/*-cache", LARGEST)
    _use(str(folder))
    forget_unread(folder)
    if not (folder / TRIED).exists() and not _taken_back(folder):
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


def _processor() -> str:
    """A short name for the kind of processor and its features."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = [platform.processor()]
    kinds = ("model name", "flags", "Features", "CPU part")
    described = sorted({line for line in lines if line.startswith(kinds)}) or [platform.machine()]
    return hashlib.sha256("\n".join(described).encode()).hexdigest()[:12]


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
        os.environ.pop(key.upper(), None)
        if value is not None:
            os.environ[key.upper()] = str(value)
        if "jax" in sys.modules:
            sys.modules["jax"].config.update(key, value)
    if "jax" in sys.modules:
        from jax.experimental.compilation_cache.compilation_cache import reset_cache

        reset_cache()  # jax looks up the folder once only
        compile_once()


def forget_unread(folder: Path) -> None:
    """From now on delete what jax says it cannot read in a folder, instead of showing the warning.

    That a program is compiled once more is nothing that a person has to know.
    """
    warnings.filterwarnings("always", message="Error reading persistent compilation cache")
    before = warnings.showwarning
    others = before.args[1] if isinstance(before, partial) else before
    warnings.showwarning = partial(_delete_or_show, folder, others)


def _delete_or_show(folder: Path, show: Any, message: Warning | str, *further: Any, **named: Any) -> None:
    """In place of `warnings.showwarning`: delete the program that a warning says cannot be read, or show another."""
    if (unread := _DAMAGED.match(str(message))) is not None and unread[1] == "reading":
        _delete_programs(folder, unread[2])
    else:
        show(message, *further, **named)


def _delete_programs(folder: Path, name: str) -> None:
    """Delete all programs of a name: which of them cannot be read is not told."""
    for path in folder.glob(f"{glob.escape(name)}-*cache"):
        with contextlib.suppress(OSError):
            path.unlink()


def _taken_back(folder: Path) -> bool:
    """Whether a program that was just kept is taken back, which is noted; not where the disk was in the way."""
    said = complaints()
    refused = [line for line in said if _NOT_OF_THIS_MACHINE in line]
    for damaged in filter(None, map(_DAMAGED.match, said)):
        _delete_programs(folder, damaged[2])
    if refused or not said:
        with contextlib.suppress(InputError, OSError), atomic_path(folder / (REFUSED if refused else TRIED)) as file:
            file.write_text("\n".join(refused), encoding="utf-8")
    return not said


def complaints() -> list[str]:
    """What is said of the disk and of the machine, line by line, where a program is kept and taken back."""
    import jax
    import jax.numpy as jnp

    with warnings.catch_warnings(record=True) as found, _standard_error() as lines:
        warnings.simplefilter("always")
        one = jnp.ones(3)
        for _ in range(2):  # the second function is the same program, but jax does not know that
            jax.jit(lambda x: jnp.sin(x) * 2.0 + 1.0)(one).block_until_ready()
    of_the_disk = [text for warning in found if _DAMAGED.match(text := str(warning.message))]
    return of_the_disk + [line for line in lines if _NOT_OF_THIS_MACHINE in line]


@contextlib.contextmanager
def _standard_error() -> Iterator[list[str]]:
    """The lines that the process writes to standard error within the block, those of compiled code as well."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)  # what is too much is lost instead of waited for
    sys.stderr.flush()
    before, lines = os.dup(2), []
    os.dup2(writing, 2)
    try:
        yield lines
    finally:
        sys.stderr.flush()
        os.dup2(before, 2)
        os.close(before)
        os.close(writing)
        with os.fdopen(reading, encoding="utf-8", errors="replace") as said:
            lines += said.read().splitlines()
