"""Files with executables and where their results belong, which are written as jax writes them and read safely."""

import contextlib
import hashlib
import os
import pickle
import threading
import zlib
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
from jax._src import compilation_cache as of_jax
from jax.experimental import serialize_executable
from jax.experimental.serialize_executable import deserialize_and_load

from sogjax.errors import InputError
from sogjax.io.files import atomic_path

Program = Callable[[list[jax.Array]], Any]

_WRITING = threading.Lock()
"""While one thread has jax write something else, no other has it write."""


class Array:
    """Stands for an array among results."""


def executable_content(executable: Any, results: Any, read: bytes | None) -> bytes:
    """What is written of an executable; `results` has `Array` in the places of what it computes.

    `read` is what jax kept of it, if it was not compiled anew.

    Raises:
        Exception: jax cannot write it, as it calls back into Python, which it says in many ways.
    """
    return pickle.dumps((_written(executable, read), results))


def read_executable(path: Path) -> Program:
    """A program that was written.

    Raises:
        Exception: there is none, it is damaged, or jax cannot read it, which it says in many ways.
    """
    executable, results = pickle.loads(_read(path))
    _prepare_lapack()
    return callable_program(deserialize_and_load(*executable), results)


def callable_program(executable: Callable[..., list[jax.Array]], results: Any) -> Program:
    """What runs an executable, and puts the arrays that it computes where they belong among the results."""
    leaves, structure = jax.tree.flatten(results)
    places = [k for k, leaf in enumerate(leaves) if isinstance(leaf, Array)]

    def run(arrays: list[jax.Array]) -> Any:
        filled = leaves.copy()
        for place, array in zip(places, executable(*arrays), strict=True):
            filled[place] = array
        return jax.tree.unflatten(structure, filled)

    return run


def digest_of(parts: Iterable[bytes]) -> bytes:
    """Of some parts, none of which runs into the next."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(len(part).to_bytes(8, "big") + part)
    return digest.digest()


def write_content(path: Path, content: bytes) -> None:
    """Keep something, where that is possible, so that damage is noticed: a damaged executable may do anything."""
    packed = zlib.compress(content, 1)
    with contextlib.suppress(InputError, OSError), atomic_path(path) as file:
        file.write_bytes(digest_of([packed]) + packed)


def _read(path: Path) -> bytes:
    """What was kept.

    Raises:
        OSError, ValueError: there is nothing, or it is damaged.
    """
    content = path.read_bytes()
    digest, packed = content[:32], content[32:]
    if digest_of([packed]) != digest:
        raise ValueError(f"{path} is damaged")
    with contextlib.suppress(OSError):  # another user's
        os.utime(path)
    return zlib.decompress(packed)


def _written(executable: Any, read: bytes | None) -> tuple[bytes, Any, Any]:
    """What `serialize` writes of an executable; `read` is what jax kept of it, if it was not compiled anew.

    One that was read cannot be written again: kernels are missing then. jax has no way to say what to write instead.
    """
    if read is None:
        with _WRITING:
            return serialize_executable.serialize(executable)
    program, _ = of_jax.extract_executable_and_time(of_jax.decompress_executable(read))

    class Writing(serialize_executable._JaxPjrtPickler):
        """Writes what was read in place of the executable."""

        def persistent_id(self, obj: Any) -> Any:
            found = super().persistent_id(obj)
            return ("exec", program) if found is not None and found[0] == "exec" else found

    with _WRITING:
        before = serialize_executable._JaxPjrtPickler
        serialize_executable._JaxPjrtPickler = Writing
        try:
            return serialize_executable.serialize(executable)
        finally:
            serialize_executable._JaxPjrtPickler = before


@cache
def _prepare_lapack() -> None:
    """Let executables find LAPACK, which jax does when it lowers a program that needs it: without, they crash."""
    from jax._src.lax import linalg

    if hasattr(linalg, "initialize_lapack"):
        linalg.initialize_lapack()
    else:
        jax.jit(jnp.linalg.cholesky).lower(jnp.eye(2))
