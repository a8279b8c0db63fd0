"""Executables kept on disk, so that the next process neither traces nor compiles what this one did.

An executable is named by all that it follows from: the function, the shapes of its arrays and everything else that it
is given, the package's files, the versions of what traces it, jax's settings. What is given must consist of values and
of classes and functions of these packages; a function that is given anything else, or that calls back into Python, is
left to jax.
"""

import contextlib
import io
import os
import pickle
import threading
import weakref
from collections.abc import Callable
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jax._src.config import trace_context

import sogjax
from sogjax.model.program import keep_programs, keeper
from sogjax.run.compilation_cache import programs_folder
from sogjax.run.compile_once import reading, watches
from sogjax.run.executable_file import (
    Array,
    Program,
    callable_program,
    digest_of,
    executable_content,
    read_executable,
    write_content,
)

KNOWN = ("sogjax", "jax", "jaxlib", "equinox", "numpy", "optimistix", "builtins", "collections", "functools", "copyreg")
"""Packages whose classes and functions are the same as long as their versions, or files, are."""
TRACING = ("jax", "jaxlib", "equinox", "optimistix", "lineax", "jaxtyping", "opt_einsum", "numpy")
"""Those that a program follows from."""
SETTINGS = ("JAX_", "XLA_", "EQX_")
"""How variables of the environment begin that may change a program."""


def hold_programs() -> None:
    """Read and keep programs where compiled ones are kept, if they are; to be called when jax is imported."""
    folder, present = programs_folder(), keeper()
    if isinstance(present, KeptPrograms) and present.folder == folder:
        return
    if folder is not None and os.environ.get("JAX_COMPILATION_CACHE_DIR") == str(folder) and watches():
        keep_programs(KeptPrograms(folder))


class UnknownError(Exception):
    """Something is given that is not the same in the next process, as far as its name says."""


class KeptPrograms:
    """A folder with programs."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._held: dict[Any, Program | None] = {}
        self._modules: dict[int, tuple[weakref.ref[eqx.Module], bytes | None]] = {}
        self._locks: dict[Any, threading.Lock] = {}
        self._lock = threading.Lock()
        self._files = _files()  # as they are when the package is imported
        self._package = digest_of(path.read_bytes() for path, _, _ in self._files)

    @cached_property
    def _on_one_cpu(self) -> bool:
        """Whether programs run on the one CPU that they are compiled for."""
        return jax.default_backend() == "cpu" and jax.device_count() == 1

    def program(
        self, function: Callable[..., Any], options: dict[str, Any], given: tuple[tuple, dict]
    ) -> Program | None:
        """The program of a function for what it is given, read or compiled and kept; None: it cannot be kept."""
        if not self._on_one_cpu or not function.__module__.startswith("sogjax."):
            return None
        key = self._key(function, options, given)
        if key is None:
            return None
        place = trace_context(), key
        with self._lock:
            if place in self._held:
                return self._held[place]
            lock = self._locks.setdefault(place, threading.Lock())
        with lock:
            found = self._held[place] if place in self._held else self._made(key, function, options, given)
            self._held[place] = found
        return found

    @property
    def num_held(self) -> int:
        """How many programs are in memory."""
        return len(self._held)

    def forget(self) -> None:
        """Hold nothing in memory."""
        with self._lock:
            self._held.clear()
            self._locks.clear()

    def _key(self, function: Callable[..., Any], options: dict[str, Any], given: tuple[tuple, dict]) -> bytes | None:
        """What tells a program from all others of this process; None: it is given something unknown."""
        named = function.__module__, function.__qualname__, function.__code__.co_firstlineno
        (arguments, keywords), told = given, []
        for value in (*arguments, *keywords.values()):
            told.append(self._described_once(value) if isinstance(value, eqx.Module) else _described(value))
        return None if None in told else _described((named, options, len(arguments), [*keywords], told))

    def _described_once(self, module: eqx.Module) -> bytes | None:
        """What describes a module, which never changes: a tracker takes a tenth of a frame's time to be described."""
        place = id(module)
        known = self._modules.get(place)
        if known is None or known[0]() is not module:
            gone = weakref.ref(module, lambda _: self._modules.pop(place, None))
            known = self._modules[place] = gone, _described(module)
        return known[1]

    def _path(self, key: bytes) -> Path:
        settings = sorted((name, value) for name, value in os.environ.items() if name.startswith(SETTINGS))
        follows = repr([(name, version(name)) for name in TRACING] + settings + _flags()).encode()
        return self.folder / f"traced-{digest_of([self._package, follows, key]).hex()[:40]}-cache"

    def _made(
        self, key: bytes, function: Callable[..., Any], options: dict[str, Any], given: tuple[tuple, dict]
    ) -> Program | None:
        path = self._path(key)
        with contextlib.suppress(Exception):  # whatever a file of another writer has, the program can be compiled
            return read_executable(path)
        leaves, static = eqx.partition(given, eqx.is_array)
        arrays, structure = jax.tree.flatten(leaves)
        found: list[Any] = []

        def of_arrays(*arrays: jax.Array) -> list[jax.Array]:
            arguments, keywords = eqx.combine(jax.tree.unflatten(structure, arrays), static)
            results = function(*arguments, **keywords)
            found.append(jax.tree.map(lambda leaf: Array() if eqx.is_array(leaf) else leaf, results))
            return [leaf for leaf in jax.tree.leaves(results) if eqx.is_array(leaf)]

        of_arrays.__name__ = function.__name__  # as profiles show it
        jitted = jax.jit(of_arrays, compiler_options=options or None)
        with reading() as last_read:
            executable = jitted.lower(*map(jnp.asarray, arrays)).compile()
            try:
                content = executable_content(executable, found[0], last_read())
            except Exception:  # jax writes no program that calls back, and says so in many ways
                return None
        if _described(found[0]) is not None and _files() == self._files:
            write_content(path, content)
        return callable_program(executable, found[0])


def _files() -> list[tuple[Path, int, int]]:
    """The package's files, when they changed last, and their sizes."""
    root = Path(sogjax.__file__).parent
    paths = sorted(path for kind in ("*.py", "*.yaml") for path in root.rglob(kind))
    return [(path, status.st_mtime_ns, status.st_size) for path in paths for status in [path.stat()]]


def _without_arrays(given: Any) -> Any:
    """The same with shape, type and weakness of each array in its place."""
    kind = lambda leaf: (leaf.shape, str(jax.dtypes.canonicalize_dtype(leaf.dtype)), getattr(leaf, "weak_type", False))
    return jax.tree.map(lambda leaf: kind(leaf) if eqx.is_array(leaf) else leaf, given)


class _Describing(pickle.Pickler):
    """Writes values, and the names of classes and functions that are known."""

    def __init__(self, file: io.BytesIO) -> None:
        super().__init__(file, protocol=5)
        self.fast = True  # what is equal is written alike, be it one thing or two

    def reducer_override(self, value: Any) -> Any:
        module = getattr(value, "__module__", None) if callable(value) else None
        named = isinstance(value, type) or hasattr(value, "__code__")
        if named and module is not None and module.partition(".")[0] not in KNOWN:
            raise UnknownError(f"{module}.{value}")
        return NotImplemented


def _described(value: Any) -> bytes | None:
    """The same bytes for the same values, in every process; None: something is no value of a known kind."""
    file = io.BytesIO()
    try:
        _Describing(file).dump(_without_arrays(value))
    except Exception:  # pickle has many ways to say so
        return None
    return file.getvalue()


def _flags() -> list[tuple[str, str]]:
    """Jax's settings, but for where programs are kept."""
    return sorted((key, str(value)) for key, value in jax.config.values.items() if "cache" not in key)
