"""What a run keeps on disk beside its motion, so that it can be resumed with the same result."""

import json
import shutil
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body, save_body
from sogjax.io.array_log import ArrayLog, read_log
from sogjax.io.files import atomic_path
from sogjax.io.motion import FRAMES_AT_ONCE
from sogjax.io.npz_file import finite_array, read_npz
from sogjax.model.body import Body
from sogjax.run.origin import Origin
from sogjax.run.prefix import Prefix, readable, rows_of
from sogjax.tracking.frame import TrackedFrame

FOLDER = "run.partial"
NOTE, START, ACTOR = "run.json", "start.npz", "actor"
SETTLED, SAMPLED = "settled.npz", "sampled.npz"


class KeptRun:
    """The folder `run.partial`: the origin of a run, its actors, its first pose, and the result of each frame.

    Each is written as soon as it is known, so a run can be killed at any moment and resumed.

    Args:
        folder: of the results.
        lasts: whether it is there after the process, so that another one can resume.

    Raises:
        InputError: the folder cannot be written, here or later.
    """

    def __init__(self, folder: Path, lasts: bool = True):
        self.folder, self.lasts = folder / FOLDER, lasts
        self._log: ArrayLog | None = None
        self.is_settled = False
        """Whether all frames are known as they hold."""
        self.num_kept = 0
        """Frames that an earlier process tracked."""

    @property
    def note(self) -> dict[str, Any]:
        """The command that began the run and its origin; empty if none was begun."""
        return read_note(self.folder / NOTE)

    def begin(self, command: str, origin: Origin) -> None:
        """Write down the command and the origin of the run."""
        write_note(self.folder / NOTE, {"command": command, "origin": origin})

    def keep_actors(self, bodies: Sequence[Body]) -> None:
        """Keep estimated actors exactly; their files hold rounded colours."""
        arrays = {}
        for k, body in enumerate(bodies):
            save_body(self.folder / f"{ACTOR}_{k}.yaml", body)
            arrays |= {f"{k}_{n}": np.asarray(leaf) for n, leaf in enumerate(jax.tree.leaves(body))}
        _save(self.folder / f"{ACTOR}s.npz", arrays)

    def actors(self) -> list[Body] | None:
        """The actors that were kept."""
        file = self.folder / f"{ACTOR}s.npz"
        exact = _read(file)
        if exact is None:
            return None
        bodies = []
        while (path := self.folder / f"{ACTOR}_{len(bodies)}.yaml").is_file():
            leaves, structure = jax.tree.flatten(load_body(path))
            kept = [_leaf(file, exact, f"{len(bodies)}_{n}", leaf) for n, leaf in enumerate(leaves)]
            bodies.append(jax.tree.unflatten(structure, kept))
        return bodies

    def keep_start(self, start: Float[Array, "dof"], frame: int) -> None:
        """Keep the rough pose of the frame where tracking begins, counted from the recording's first."""
        _save(self.folder / START, {"start": np.asarray(start), "frame": np.array(frame)})

    def start(self) -> tuple[Float[Array, "dof"], int] | None:
        """The rough pose that was kept, and its frame."""
        kept = _read(self.folder / START)
        if kept is None:
            return None
        pose = finite_array(self.folder / START, kept, "start", (None,))
        frame = finite_array(self.folder / START, kept, "frame", ())
        return jnp.asarray(pose), int(frame)

    def prefix(self, num_readable: int, total: int, num_before: int = 0) -> Prefix | None:
        """The frames to resume after: at most `num_readable` of `total`, a multiple of the frames written at once.

        So the frames after them are written in the same blocks as in an uninterrupted run. Unless they are more than
        the `num_before` frames that are tracked backwards, all is done again.
        """
        rows = None
        with suppress(InputError):
            rows = read_log(self.folder)
        if rows is None or not readable(rows):
            return None
        whole = min(num_readable, len(rows["pose"]))
        count = whole if whole == total else whole - whole % FRAMES_AT_ONCE
        if count <= num_before:
            return None
        self.num_kept = count
        return Prefix({name: column[:count] for name, column in rows.items()})

    def settle(self, frames: Prefix) -> None:
        """Keep all frames of the run as they hold: nothing is tracked after this, and nothing appended."""
        _save(self.folder / SETTLED, frames.rows)
        self.is_settled = True

    def settled(self, total: int) -> Prefix | None:
        """The frames that were settled, `total` of them, if the run came so far."""
        rows = None
        with suppress(InputError):
            rows = _read(self.folder / SETTLED)
        if rows is None or not readable(rows) or len(rows["pose"]) != total:
            return None
        self.is_settled = True
        return Prefix(rows)

    def keep_sampled(self, poses: Mapping[int, Float[Array, "dof"]]) -> None:
        """Keep the poses, by frame, with which the background was learnt again."""
        _save(self.folder / SAMPLED, {str(frame): np.asarray(pose) for frame, pose in poses.items()})

    def sampled(self) -> dict[int, Float[Array, "dof"]] | None:
        """Those poses, if they were kept."""
        file = self.folder / SAMPLED
        with suppress(InputError, ValueError):
            kept = _read(file)
            if kept is not None:
                return {int(name): jnp.asarray(finite_array(file, kept, name, (None,))) for name in kept}
        return None

    def append(self, frames: Sequence[TrackedFrame]) -> None:
        """Keep the results of the frames that follow; those that are settled are not kept twice."""
        if self.is_settled:
            return
        rows = rows_of(frames)
        if self._log is None:
            self._log = ArrayLog(self.folder, {}, rows, self.num_kept)
        else:
            self._log.append(rows)

    def close(self) -> None:
        """Close the file; the folder stays."""
        if self._log is not None:
            self._log.close()

    def remove(self) -> None:
        """Remove the folder once the run has ended."""
        self.close()
        shutil.rmtree(self.folder, ignore_errors=True)


def read_note(path: Path) -> dict[str, Any]:
    """What `write_note` wrote; empty if there is no such file."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def write_note(path: Path, note: dict[str, Any]) -> None:
    """Write a note on a run, as JSON."""
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(note, indent=1) + "\n", encoding="utf-8")


def _save(path: Path, arrays: dict[str, np.ndarray]) -> None:
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez(file, **arrays)  # pyright: ignore[reportArgumentType]


def _leaf(path: Path, arrays: dict[str, np.ndarray], key: str, like: Any) -> Array:
    """An array of an actor, with the shape and type of `like`."""
    kept = arrays.get(key)
    if kept is None or (kept.shape, kept.dtype) != (like.shape, like.dtype):
        raise InputError(f"{path}: {key!r} does not match the actor beside it; start over with overwrite=true")
    return jnp.asarray(kept)


def _read(path: Path) -> dict[str, np.ndarray] | None:
    return read_npz(path) if path.is_file() else None
