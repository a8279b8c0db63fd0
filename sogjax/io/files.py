"""Files: written in one piece or not at all, named without leading out of their folder, read up to a size."""

import csv
import errno
import io
import json
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from sogjax.errors import InputError

Parsed = TypeVar("Parsed")

_DISK_TROUBLE = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS}


@contextmanager
def atomic_path(path: Path) -> Iterator[Path]:
    """A temporary path in the same folder and with the same suffix as `path`, renamed to it on success.

    The folder is made where it is missing. When the body raises, nothing is left behind and an older file at
    `path` stays as it was.

    Raises:
        InputError: the folder cannot be made or written, `path` is a folder, or the disk is full.
    """
    path = Path(path)
    if path.is_dir():
        raise InputError(f"{path}: is a folder, so no file can be written there; give the path of a file")
    temporary = path.with_name(f".{path.stem[:80]}.{uuid.uuid4().hex[:8]}.tmp{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.touch(exist_ok=False)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{path}: the folder {path.parent} cannot be written ({reason}); choose another") from error
    try:
        with disk_trouble_told(path):
            yield temporary
            _rename(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _rename(temporary: Path, path: Path) -> None:
    try:
        temporary.replace(path)
    except FileNotFoundError as error:
        raise InputError(f"{path}: was removed, or its folder was, while being written; write it again") from error


def write_file(path: Path, content: str | bytes) -> None:
    """Write a whole file, or leave what is there as it was.

    Raises:
        InputError: as `atomic_path`.
    """
    with atomic_path(path) as temporary:
        temporary.write_bytes(content.encode() if isinstance(content, str) else content)


def csv_text(lines: Iterable[Iterable[object]]) -> str:
    """A table as CSV."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(lines)
    return text.getvalue()


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write a mapping as readable JSON, in one piece or not at all; NaN becomes null."""
    write_file(path, json.dumps(_without_nan(dict(content)), indent=2) + "\n")


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


@contextmanager
def disk_trouble_told(path: Path) -> Iterator[None]:
    """Turn a full or broken disk into one sentence about `path`.

    Raises:
        InputError: instead of the system's error.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in (*_DISK_TROUBLE, None):  # numpy's own errors have none
            raise
        raise InputError(f"{path}: could not be written ({error.strerror or error}); choose another disk") from error


def objection(name: str) -> str | None:
    """Why a name cannot be the name of a file in any folder; None where it can.

    Names that Windows alone keeps for itself (CON, or with a colon) pass: writing fails there, and harms nothing.
    """
    if "/" in name or "\\" in name:
        return "a name without slashes"
    if not name.isprintable():
        return "a name of printable characters"
    if name.startswith(".") or name != name.strip():
        return "a name that does not begin with a dot and has no space at either end"
    if len(name.encode(errors="replace")) > 100:  # file systems allow 255, and prefixes and extensions are added
        return "a name of at most 100 bytes"
    return None


def read_bounded(path: Path, max_bytes: int) -> bytes:
    """The content of a file.

    Raises:
        InputError: it cannot be read, or has more than `max_bytes`.
    """
    try:
        with path.open("rb") as file:
            content = file.read(max_bytes + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the path") from error
    if len(content) > max_bytes:
        raise InputError(f"{path}: is larger than {max_bytes} bytes; give a file of the right kind")
    return content


def read_text(path: Path, max_bytes: int) -> str:
    """The text of a file.

    Raises:
        InputError: it cannot be read, has more than `max_bytes` or is no text.
    """
    try:
        return read_bounded(path, max_bytes).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not text ({error.reason}); give a file of the right kind") from error


def read_parsed(path: Path, what: str, parse: Callable[[str], Parsed], remedy: str, max_bytes: int) -> Parsed:
    """What `parse` makes of the text of a file of the format `what`.

    Raises:
        InputError: it cannot be read, has more than `max_bytes`, is no text, or `parse` refuses it.
    """
    content = read_bounded(path, max_bytes)
    try:
        return parse(content.decode("utf-8-sig"))
    except (ValueError, SyntaxError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{path}: is not readable as {what} ({reason}); {remedy}") from error


def visible_files(folder: Path) -> list[Path]:
    """What is in a folder, sorted by name, without hidden files; nothing where there is no such folder."""
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if not path.name.startswith("."))
