"""A stream into a Rerun file that is either complete or absent, and the names in it: timelines and entities."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from io import FileIO
from pathlib import Path
from threading import Thread

import rerun as rr

from sogjax.io.files import atomic_path
from sogjax.io.motion import Motion

FRAME, TIME, ITERATION = "frame", "time", "iteration"
"""The timelines: the recording's frame, seconds since its frame 0, the solver's iterations over all frames."""


def camera_entity(camera: str) -> str:
    """The entity of a camera."""
    return f"/world/cameras/{entity_part(camera)}"


def actor_entity(actor: str) -> str:
    """The entity of an actor."""
    return f"/world/actors/{entity_part(actor)}"


def run_entity(run: str) -> str:
    """The entity of one run of several."""
    return f"/world/runs/{entity_part(run)}"


def entity_part(name: str) -> str:
    """Any name as one part of an entity's path."""
    return rr.escape_entity_path_part(name)


def time_columns(motion: Motion) -> list[rr.TimeColumn]:
    """The frames of a motion on both timelines."""
    return [rr.TimeColumn(FRAME, sequence=motion.frame), rr.TimeColumn(TIME, duration=motion.time)]


@contextmanager
def rerun_stream(path: Path, name: str) -> Iterator[rr.RecordingStream]:
    """What is logged within the block is in the file at its end, under a recording of that name.

    Raises:
        InputError: the file could not be written.
    """
    with atomic_path(Path(path)) as temporary, _written_by_ourselves(temporary) as target:
        stream = rr.RecordingStream("sogjax")
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)
        stream.save(target)
        stream.send_recording_name(name)
        try:
            yield stream
            stream.flush()
        finally:
            stream.disconnect()


@contextmanager
def _written_by_ourselves(path: Path) -> Iterator[Path]:
    """A pipe for Rerun to write into; a thread copies its other end to the file.

    On a full disk Rerun prints a message, leaves part of the file, and may hang (0.41); a pipe takes everything.
    """
    open_files = Path("/dev/fd")
    if not open_files.is_dir():  # Windows
        yield path
        return
    errors: list[OSError] = []
    with path.open("wb", buffering=0) as file:
        end, begin = os.pipe()
        thread = Thread(target=_copy, args=(end, file, errors), name="rerun file", daemon=True)
        thread.start()
        try:
            yield open_files / str(begin)
        finally:
            os.close(begin)
            thread.join()
            os.close(end)
    if errors:
        raise errors[0]  # atomic_path knows the file's own name


def _copy(end: int, file: FileIO, errors: list[OSError]) -> None:
    """Copy everything to a file; if that fails, keep reading and discard the rest."""
    while content := os.read(end, 2**20):
        left = memoryview(content)
        try:
            while left and not errors:
                left = left[file.write(left) :]
        except OSError as error:
            errors.append(error)
