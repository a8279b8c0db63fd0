"""Tracked frames as they are kept: columns of numbers, a row each."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.model.sog import Sog
from sogjax.quality.limb_confidence import LimbConfidence
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameResult, TrackedFrame, TrackState

TERM = "term_"
"""Before the name of a term of the energy, in the names of columns."""
COLUMNS = ("pose", "energy", "iterations", "evaluations", "converged", "num_near", "num_matching", "num_blocks")
JUDGEMENT = {
    "limb_doubt": "error_probability",
    "limb_usual": "baseline",
    "explained": "explained",
    "overlap": "overlap",
}
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
        baseline = self.rows.get("limb_usual")
        return state if baseline is None else replace(state, baseline=jnp.asarray(baseline[-1]))

    def result(self, frame: int, images: Sog) -> FrameResult:
        """The result of one frame; image blobs are not kept."""
        values = {name: jnp.asarray(column[frame]) for name, column in self.rows.items()}
        judged = {name: values[key] for key, name in JUDGEMENT.items() if key in values}
        return FrameResult(
            terms={name.removeprefix(TERM): value for name, value in values.items() if name.startswith(TERM)},
            limbs=LimbConfidence(**judged) if judged else None,
            images=images,
            **{name: values[name] for name in COLUMNS},
        )


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


def readable(rows: dict[str, np.ndarray] | None) -> bool:
    """Whether these are rows of this program, and not of one that judged frames by less."""
    if rows is None or not rows.keys() >= _NEEDED:
        return False
    return "limb_usual" not in rows or (rows["limb_usual"].ndim == 3 and "explained" in rows)
