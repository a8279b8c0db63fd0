"""Readers of files against damaged files."""

import os
import tempfile
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from fuzzed_readers import Read, readers

from sogjax.errors import InputError

EXTREME = (b"nan", b"inf", b"-1", b"0", b"1e308", b"9" * 40, b"''", b"null", b"[]", b"{}", b"\x00", b"\xff\xfe")


@dataclass
class FuzzedReader:
    """What a reader did with many damaged files."""

    name: str
    files: int = 0
    refused: int = 0
    crashes: list[str] = field(default_factory=list)
    seconds: float = 0.0


def fuzz_readers(count: int) -> list[FuzzedReader]:
    """Every reader with `count` damaged files; the same ones in every run."""
    with tempfile.TemporaryDirectory() as place:
        good = readers(Path(place))
        with without_the_codecs_lines():
            return [fuzzed(name, path, read, count) for name, (path, read) in good.items()]


@contextmanager
def without_the_codecs_lines() -> Iterator[None]:
    """Libraries for pictures tell every damage on standard error; that is dropped within the block."""
    with Path(os.devnull).open("w") as nowhere:
        kept = os.dup(2)
        os.dup2(nowhere.fileno(), 2)
        try:
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)


def fuzzed(name: str, path: Path, read: Read, count: int) -> FuzzedReader:
    """One reader with `count` damaged versions of a file."""
    good, rng, result = path.read_bytes(), np.random.default_rng(0), FuzzedReader(name)
    begin = time.perf_counter()
    for _ in range(count):
        path.write_bytes(damaged(good, rng))
        result.files += 1
        try:
            read(path)
        except InputError:
            result.refused += 1
        except Exception as error:
            where = traceback.extract_tb(error.__traceback__)[-1]
            result.crashes.append(f"{type(error).__name__}: {error} ({Path(where.filename).name}:{where.lineno})")
    result.seconds = time.perf_counter() - begin
    path.write_bytes(good)
    return result


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """A file with one to three things done to it."""
    for _ in range(rng.integers(1, 4)):
        data = (_other_bytes, _other_lines, _other_number, _cut)[rng.integers(4)](data, rng)
    return data


def _other_bytes(data: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(data)
    for place in rng.integers(0, max(len(data), 1), rng.integers(1, 5)):
        changed[place : place + 1] = bytes([rng.integers(256)])
    return bytes(changed)


def _other_lines(data: bytes, rng: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    first, second = rng.integers(0, len(lines), 2)
    lines[first : first + rng.integers(0, 2)] = [lines[second]] * rng.integers(0, 3)
    return b"\n".join(lines)


def _other_number(data: bytes, rng: np.random.Generator) -> bytes:
    places = [k for k, byte in enumerate(data) if chr(byte).isdigit()]
    if not places:
        return data
    place = places[rng.integers(len(places))]
    return data[:place] + EXTREME[rng.integers(len(EXTREME))] + data[place + 1 :]


def _cut(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: rng.integers(0, len(data) + 1)]
