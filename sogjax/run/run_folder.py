"""The folder of a run: one run at a time, nothing overwritten unasked, nothing left of an older run."""

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from sogjax.errors import InputError
from sogjax.io.export.write import WRITERS
from sogjax.io.files import objection
from sogjax.io.source import find_sources
from sogjax.run.clock import seconds_so_far
from sogjax.run.kept_run import FOLDER, NOTE, KeptRun, read_note, write_note
from sogjax.run.origin import Origin, difference
from sogjax.run.outputs import results_folder
from sogjax.run.terminal import say

try:
    import fcntl
except ImportError:  # Windows: two runs in one folder are not noticed there
    fcntl = None

LOCK = ".lock"
REPLACING_THEIR_OWN = ("demo",)
"""Commands whose own earlier runs are replaced unasked, since they can be repeated."""
PARTIAL = ("motion.partial", "motion_*.partial", FOLDER)
"""Folders of a run that has not ended."""
RESULTS = (
    *(f"motion{ending}" for ending in WRITERS),
    *("config.yaml", "metrics.json", "overlay.mp4", "motion.rrd", "worst.png", NOTE),
)
"""Names of files that every run leaves."""
OF_ACTORS = tuple(f"motion_*{ending}" for ending in WRITERS)
"""Names of several actors' files. A user's own files may match: only those listed in a run's note are removed."""
_HALF_WRITTEN = re.compile(
    r"\.(motion|overlay|config|metrics|worst|run|actor)(_.*)?\.[0-9a-f]{8}\.tmp(\..*)?|\.probe-[0-9a-f]*"
)


class RunFolder:
    """A folder that is claimed by this run.

    Raises:
        InputError: it holds the results of another run, which may be neither overwritten nor resumed.
    """

    def __init__(self, path: Path, overwrite: bool, resume: bool, command: str):
        self.path = path
        if overwrite and resume:
            raise InputError("overwrite=true resume=true: exclude each other; leave one of them out")
        self.note = read_note(path / NOTE)
        """Note of a run that has ended."""
        self.kept = KeptRun(path)
        """State of a run that was stopped."""
        begun_by = (self.note or self.kept.note).get("command")
        self._resume = resume
        self.began = False
        """Whether this process began a run here."""
        overwrite = overwrite or (command in REPLACING_THEIR_OWN and begun_by == command)
        found = earlier_results(path, self.note) or sorted(_named(path, OF_ACTORS))
        if not found or overwrite:
            return
        names = ", ".join(file.name for file in found[:3]) + (", ..." if len(found) > 3 else "")
        unfinished = (path / FOLDER).is_dir()
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
    def ended(self) -> bool:
        """Whether the run to resume has already ended."""
        return self._resume and bool(self.note)

    def goes_on(self, origin: Origin) -> bool:
        """Whether this run resumes one that was begun here with the same settings and files.

        Raises:
            InputError: it was begun with other settings or files.
        """
        if not self._resume:
            return False
        before = (self.note or self.kept.note).get("origin")
        if before is None:
            say(f"{self.path}: nothing to resume; starting with the first frame")
            return False
        self._check_same(before, origin)
        for path in half_written(self.path):
            path.unlink(missing_ok=True)
        for path in _named(self.path, PARTIAL) if self.note else ():
            _remove_partial(path)
        return True

    def begin(self, command: str, origin: Origin, needed: Sequence[Path] = ()) -> None:
        """Begin a run.

        Args:
            command: that begins it.
            origin: what the run depends on.
            needed: files that it reads; nothing else of an earlier run is left.
        """
        self._clear(needed)
        self.began = True
        self.kept.begin(command, origin)

    def _check_same(self, before: Origin, now: Origin) -> None:
        what = difference(before, now)
        if what is not None:
            raise InputError(
                f"{self.path}: the run that was begun there cannot be resumed, because {what}; give the same settings "
                "and files, choose another folder with out=DIR, or start over with overwrite=true"
            )

    def _clear(self, needed: Sequence[Path]) -> None:
        """Remove the files of an earlier run, except those that this one reads."""
        kept = {path.resolve() for path in needed}
        (self.path / NOTE).unlink(missing_ok=True)  # first: without it nothing is taken for whole
        for path in [*earlier_results(self.path, self.note), *half_written(self.path)]:
            if path.resolve() in kept:
                continue
            if path.is_dir() and not path.is_symlink():
                _remove_partial(path)
            else:
                path.unlink(missing_ok=True)

    def finish(self, command: str, origin: Origin, files: Sequence[Path]) -> None:
        """Write down that the run has ended, its files, and the seconds of its stages on the clock that runs."""
        for path in half_written(self.path):
            path.unlink(missing_ok=True)
        names = [path.name for path in files]
        note = {"command": command, "files": names, "origin": origin}
        seconds = seconds_so_far()
        write_note(self.path / NOTE, note | ({"seconds": seconds} if seconds else {}))


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
            if folder.began and not any(path.glob("motion*.partial")):
                folder.kept.remove()  # it did not come to its first frame
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


def earlier_results(folder: Path, note: dict) -> list[Path]:
    """What an earlier run left in a folder: its unfinished state, and files known by name or from its note.

    Anybody may have written the note, so only files in this very folder count.
    """
    if not folder.is_dir():
        return []
    listed = note.get("files", [])
    names = [name for name in listed if isinstance(name, str) and objection(name) is None] if listed else []
    files = _named(folder, RESULTS) | {folder / name for name in names}
    partial = {path for path in _named(folder, PARTIAL) if path.is_dir()}
    return sorted(partial | {path for path in files if path.is_file() or path.is_symlink()})


def _named(folder: Path, patterns: Sequence[str]) -> set[Path]:
    return {path for pattern in patterns for path in folder.glob(pattern)}


def half_written(folder: Path) -> list[Path]:
    """Files under temporary names, left by a run that was killed."""
    return [path for path in folder.iterdir() if _HALF_WRITTEN.fullmatch(path.name) and not path.is_dir()]


def _remove_partial(path: Path) -> None:
    """Remove the folder of an unfinished run; it stays if it holds subfolders of somebody else's."""
    for file in path.iterdir():
        if not file.is_dir() or file.is_symlink():
            file.unlink()
    with suppress(OSError):
        path.rmdir()


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
