"""What a run keeps on disk beside its motion, so that it can be resumed with the same result."""

import json
import shutil
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.data.actor_file import load_body, save_body
from sogjax.data.array_log import ArrayLog, read_log
from sogjax.data.atomic import atomic_path
from sogjax.data.motion import FRAMES_AT_ONCE
from sogjax.data.npz_file import finite_array, read_npz
from sogjax.engine.origin import Origin
from sogjax.errors import InputError
from sogjax.model.body import Body
from sogjax.model.sog import Sog
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameResult, TrackedFrame, TrackState
from sogjax.tracking.limb_doubt import Judgement

FOLDER = "run.partial"
NOTE, START, ACTOR = "run.json", "start.npz", "actor"
TERM = "term_"
"""Before the name of a term of the energy, in the names of columns."""
COLUMNS = ("pose", "energy", "iterations", "evaluations", "converged", "num_near", "num_matching", "num_blocks")
JUDGEMENT = {"limb_doubt": "doubt", "limb_usual": "usual", "explained": "explained", "overlap": "overlap"}
"""Columns of runs whose frames are judged."""
CAPACITY, CAPACITIES = "capacity_{}", ("near", "matching", "blocks")
_NEEDED = {*COLUMNS, *(CAPACITY.format(name) for name in CAPACITIES)}


@dataclass(frozen=True)
class Prefix:
    """The frames that were already tracked."""

    rows: dict[str, np.ndarray]
    """What was kept of each frame."""

    @property
    def num_frames(self) -> int:
        """How many."""
        return len(self.rows["pose"])

    @classmethod
    def from_frames(cls, frames: Iterable[TrackedFrame]) -> "Prefix":
        """Of frames that were tracked backwards: in the order of the clip, without their image blobs."""
        rows = [rows_of([frame]) for frame in frames][::-1]
        return cls({name: np.concatenate([row[name] for row in rows]) for name in rows[0]})

    def pose(self, frame: int) -> Float[Array, "dof"]:
        """Of one frame."""
        return jnp.asarray(self.rows["pose"][frame])

    @property
    def capacities(self) -> Capacities:
        """Of the last one."""
        return Capacities(*(int(self.rows[CAPACITY.format(name)][-1]) for name in CAPACITIES))

    @property
    def most_capacities(self) -> Capacities:
        """That suffice for every frame: those tracked backwards may have needed more than the last one."""
        return Capacities(*(int(self.rows[CAPACITY.format(name)].max()) for name in CAPACITIES))

    def state(self, start: Float[Array, "dof"]) -> TrackState:
        """The tracker's state after these frames, if it began at `start`."""
        state = TrackState.from_pose(start)
        for pose in self.rows["pose"][-2:]:
            state = state.advanced(jnp.asarray(pose))
        usual = self.rows.get("limb_usual")
        return state if usual is None else replace(state, usual=jnp.asarray(usual[-1]))

    def result(self, frame: int, images: Sog) -> FrameResult:
        """The result of one frame; image blobs are not kept."""
        values = {name: jnp.asarray(column[frame]) for name, column in self.rows.items()}
        judged = {name: values[key] for key, name in JUDGEMENT.items() if key in values}
        return FrameResult(
            terms={name.removeprefix(TERM): value for name, value in values.items() if name.startswith(TERM)},
            limbs=Judgement(**judged) if judged else None,
            images=images,
            **{name: values[name] for name in COLUMNS},
        )


class KeptRun:
    """The folder `run.partial`: the origin of a run, its actors, its first pose, and the result of each frame.

    Each is written as soon as it is known, so a run can be killed at any moment and resumed.

    Args:
        folder: of the results.

    Raises:
        InputError: the folder cannot be written, here or later.
    """

    def __init__(self, folder: Path):
        self.folder = folder / FOLDER
        self._log: ArrayLog | None = None
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

    def prefix(self, readable: int, total: int, num_before: int = 0) -> Prefix | None:
        """The frames to resume after: at most `readable` of `total`, a multiple of the frames written at once.

        So the frames after them are written in the same blocks as in an uninterrupted run. Unless they are more than
        the `num_before` frames that are tracked backwards, all is done again.
        """
        rows = None
        with suppress(InputError):
            rows = read_log(self.folder)
        if rows is None or not rows.keys() >= _NEEDED or _of_another_layout(rows):
            return None
        whole = min(readable, len(rows["pose"]))
        count = whole if whole == total else whole - whole % FRAMES_AT_ONCE
        if count <= num_before:
            return None
        self.num_kept = count
        return Prefix({name: column[:count] for name, column in rows.items()})

    def append(self, frames: Sequence[TrackedFrame]) -> None:
        """Keep the results of the frames that follow."""
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


def _of_another_layout(rows: dict[str, np.ndarray]) -> bool:
    """Whether the rows are of a program that judged frames by less."""
    return "limb_usual" in rows and (rows["limb_usual"].ndim != 3 or "explained" not in rows)


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


def rows_of(frames: Sequence[TrackedFrame]) -> dict[str, np.ndarray]:
    """What is kept of frames, a row each."""
    results = [frame.result for frame in frames]
    column = lambda parts, name: np.stack([np.asarray(getattr(part, name)) for part in parts])
    capacity = lambda name: np.array([getattr(frame.capacities, name) for frame in frames])
    judged = [result.limbs for result in results if result.limbs is not None]
    return (
        {name: column(results, name) for name in COLUMNS}
        | {key: column(judged, name) for key, name in JUDGEMENT.items() if judged}
        | {TERM + name: np.stack([np.asarray(r.terms[name]) for r in results]) for name in results[0].terms}
        | {CAPACITY.format(name): capacity(name) for name in CAPACITIES}
    )


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
