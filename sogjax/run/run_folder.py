"""The folder of a run: one run at a time, nothing overwritten unasked, nothing left of an older run."""

import json
import os
import shutil
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from sogjax.errors import InputError
from sogjax.io.files import write_file
from sogjax.io.frame_motions import FRAMES
from sogjax.io.source import find_sources
from sogjax.run.clock import seconds_so_far
from sogjax.run.fingerprint import RunFingerprint, difference
from sogjax.run.run_files import GUESS, KEPT, NOTE, half_written, in_the_way, left_in
from sogjax.run.terminal import say

try:
    import fcntl
except ImportError:  # Windows: two runs in one folder are not noticed there
    fcntl = None

LOCK = ".lock"
REPLACING_THEIR_OWN = ("demo",)
"""Commands whose own earlier runs are replaced unasked, since they can be repeated."""


class RunFolder:
    """A folder that is claimed by this run.

    Raises:
        InputError: it holds the results of another run, which may be neither overwritten nor resumed.
    """

    def __init__(self, path: Path, overwrite: bool, resume: bool, command: str):
        self.path = path
        if overwrite and resume:
            raise InputError("overwrite=true resume=true: exclude each other; leave one of them out")
        self.note = read_note(NOTE.of(path))
        """Note of a run that has ended."""
        self.kept = KEPT.of(path)
        """Where the records of a run lie that has not ended, each written as soon as it is known."""
        begun_by = (self.note or self._begun).get("command")
        self._resume = resume
        self.began = self._cleared = False
        """Whether this process began a run here; whether the results of an earlier one are gone."""
        overwrite = overwrite or (command in REPLACING_THEIR_OWN and begun_by == command)
        found = in_the_way(path, self.note.get("files", []))
        if not found or overwrite:
            return
        names = ", ".join(file.name for file in found[:3]) + (", ..." if len(found) > 3 else "")
        unfinished = self.kept.is_dir()
        if resume and not (unfinished or self.note):
            raise InputError(
                f"{path}: holds results ({names}) but not the state needed to resume; choose another folder with "
                "out=DIR, or give overwrite=true instead of resume=true"
            )
        if not resume:
            remedy = "resume=true to resume it, or overwrite=true" if unfinished else "overwrite=true"
            raise InputError(
                f"{path}: holds the results of an earlier run ({names}); choose another folder with out=DIR, or give "
                f"{remedy}"
            )

    @property
    def _begun(self) -> dict[str, Any]:
        """Note of a run that was stopped."""
        return read_note(NOTE.of(self.kept))

    @property
    def ended(self) -> bool:
        """Whether the run to resume has already ended."""
        return self._resume and bool(self.note)

    def goes_on(self, fingerprint: RunFingerprint) -> bool:
        """Whether this run resumes one that was begun here with the same settings and files.

        Raises:
            InputError: it was begun with other settings or files.
        """
        if not self._resume:
            return False
        before = (self.note or self._begun).get("origin")
        if before is None:
            say(f"{self.path}: nothing to resume; starting with the first frame")
            return False
        self._check_same(before, fingerprint)
        for path in half_written(self.path):
            path.unlink(missing_ok=True)
        if self.note and self.kept.is_dir():
            _remove_kept(self.kept)
        return True

    def begin(self, command: str, fingerprint: RunFingerprint) -> None:
        """Begin a run; the results of an earlier one stay until `clear`."""
        self.began = True
        if self.kept.is_dir():
            _remove_kept(self.kept)
        GUESS.of(self.path).unlink(missing_ok=True)
        write_note(NOTE.of(self.kept), {"command": command, "origin": fingerprint})

    def _check_same(self, before: RunFingerprint, now: RunFingerprint) -> None:
        what = difference(before, now)
        if what is not None:
            raise InputError(
                f"{self.path}: the run that was begun there cannot be resumed, because {what}; give the same settings "
                "and files, choose another folder with out=DIR, or start over with overwrite=true"
            )

    def clear(self, needed: Sequence[Path] = ()) -> None:
        """Remove the results of an earlier run, except files that this one reads."""
        if self._cleared:
            return
        self._cleared = True
        kept = {path.resolve() for path in (*needed, self.kept, GUESS.of(self.path))}  # the guess is this run's
        NOTE.of(self.path).unlink(missing_ok=True)  # first: without it nothing is taken for whole
        for path in [*left_in(self.path, self.note.get("files", [])), *half_written(self.path)]:
            if path.resolve() in kept:
                continue
            if path.is_dir() and not path.is_symlink():
                _remove_kept(path)
            else:
                path.unlink(missing_ok=True)

    def finish(self, command: str, fingerprint: RunFingerprint, files: Sequence[Path]) -> None:
        """Write down that the run has ended, its files, and the seconds of its stages on the clock that runs."""
        for path in half_written(self.path):
            path.unlink(missing_ok=True)
        note = {"command": command, "files": [path.name for path in files], "origin": fingerprint}
        seconds = seconds_so_far()
        write_note(NOTE.of(self.path), note | ({"seconds": seconds} if seconds else {}))
        self.forget()

    def forget(self) -> None:
        """Remove what was kept of a run that has not ended."""
        shutil.rmtree(self.kept, ignore_errors=True)


@contextmanager
def run_folder(
    path: Path, overwrite: bool = False, resume: bool = False, command: str = "track"
) -> Iterator[RunFolder]:
    """The folder of this run, created if missing; no other run may use it within the block.

    Args:
        path: the folder.
        overwrite: whether the results of an earlier run may be replaced.
        resume: whether to resume an earlier run.
        command: that runs.

    Raises:
        InputError: it cannot be written, another run uses it, it holds results that must not be overwritten, or it
            is a recording.
    """
    _check_no_recording(path)
    with results_folder(path), _locked(path):
        folder = RunFolder(path, overwrite, resume, command)
        try:
            yield folder
        except BaseException:
            if folder.began and not (folder.kept / FRAMES).is_dir():
                folder.forget()  # it did not come to its first frame
            raise


def _check_no_recording(path: Path) -> None:
    """Results beside videos would be taken for a recording's own files.

    Raises:
        InputError: the folder has images of cameras.
    """
    try:
        find_sources(path)
    except InputError:
        return
    raise InputError(f"out={path}: is the folder of a recording; give results one of their own, as out={path}/results")


def _remove_kept(path: Path) -> None:
    """Remove what a run kept; a folder stays if it holds subfolders that are somebody else's."""
    for known in (FRAMES, "cells", "pictures", "relearnt", "first", "remade", "recolored", "adjusted"):
        if (path / known).is_dir() and not (path / known).is_symlink():
            shutil.rmtree(path / known, ignore_errors=True)
    for file in path.iterdir():
        if not file.is_dir() or file.is_symlink():
            file.unlink()
    with suppress(OSError):
        path.rmdir()


def read_note(path: Path) -> dict[str, Any]:
    """What `write_note` wrote; empty if there is no such file."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def write_note(path: Path, note: dict[str, Any]) -> None:
    """Write a note on a run, as JSON."""
    write_file(path, json.dumps(note, indent=1) + "\n")


@contextmanager
def results_folder(path: Path) -> Iterator[Path]:
    """The folder for results, created if missing; problems show before the work begins.

    If the work ends with an error, folders created for it are removed unless they hold something.

    Raises:
        InputError: it cannot be created or written.
    """
    made = [folder for folder in (path, *path.parents) if not folder.exists()]
    try:
        _make_writable(path)
        yield path
    except BaseException:
        for folder in made:
            with suppress(OSError):
                folder.rmdir()
        raise


def _make_writable(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = path / f".probe-{uuid.uuid4().hex}"
        probe.touch()
        probe.unlink()
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{path}: cannot write there ({reason}); choose another folder with out=DIR") from error


def free_path(key: str, value: str | Path, overwrite: bool) -> Path:
    """The path of an output, if it is free or may be replaced.

    Raises:
        InputError: a file exists there.
    """
    path = Path(value)
    if path.exists() and not overwrite:
        raise InputError(f"{key}={path}: already exists; choose another name, or give overwrite=true to replace it")
    return path


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Hold the folder's lock, which the system releases however the process ends.

    Raises:
        InputError: another run holds it.
    """
    if fcntl is None:
        yield
        return
    path = folder / LOCK
    file = _lock(path)
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        os.close(file)


def _lock(path: Path) -> int:
    """The open, locked file; tried again if another run removed it meanwhile."""
    assert fcntl is not None
    while True:
        file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            holder = os.read(file, 32).decode(errors="replace") or "?"
            os.close(file)
            raise InputError(
                f"{path.parent}: another run (process {holder}) is writing there; wait until it has ended, or choose "
                "another folder with out=DIR"
            ) from error
        except OSError:  # a file system without locks
            return file
        with suppress(FileNotFoundError):
            if path.stat().st_ino == os.fstat(file).st_ino:
                os.truncate(file, 0)
                os.write(file, str(os.getpid()).encode())
                return file
        os.close(file)
