"""Tracked frames as rows of the table, and the tracker's state and results from its rows."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import islice

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.io.frame_table import FrameTable
from sogjax.model.sog import Sog
from sogjax.quality.limb_confidence import LimbConfidence, beside_rivals
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameInput, FrameResult, TrackedFrame, TrackState, on_device
from sogjax.tracking.frame_by_frame import Told, image_blobs, track
from sogjax.tracking.tracker import Tracker

_COUNTS = ("iterations", "evaluations", "converged", "num_near", "num_matching", "num_blocks")
_LIMBS = {
    "limb_doubt": "error_probability",
    "baseline": "baseline",
    "explained": "explained",
    "overlap": "overlap",
    "limb_hidden": "hidden",
}
"""Columns of limbs, and what they are called in a `LimbConfidence`."""


def rows_of(frames: Sequence[TrackedFrame], numbers: Sequence[int]) -> FrameTable:
    """The rows of frames that follow each other; `numbers` are the recording's."""
    results = [frame.result for frame in frames]
    column = lambda parts, name: np.stack([np.asarray(getattr(part, name)) for part in parts])
    judged = [result.limbs for result in results if result.limbs is not None]
    capacities = [(each.capacities.near, each.capacities.matching, each.capacities.blocks) for each in frames]
    return FrameTable(
        frame=np.array(numbers, int),
        pose=column(results, "pose"),
        energy=column(results, "energy"),
        **{name: column(results, name) for name in _COUNTS},
        capacities=np.array(capacities, int),
        **limb_rows(judged),
        terms={name: np.stack([np.asarray(result.terms[name]) for result in results]) for name in results[0].terms},
    )


def limb_rows(found: Sequence[LimbConfidence]) -> dict[str, np.ndarray]:
    """The columns that say what is thought of limbs, of frames that follow each other."""
    known = {key: name for key, name in _LIMBS.items() if found and getattr(found[0], name) is not None}
    return {key: np.stack([np.asarray(getattr(each, name)) for each in found]) for key, name in known.items()}


def with_rivals(table: FrameTable, rivals: Float[np.ndarray, "frame limb"] | None) -> FrameTable:
    """The table with doubts that weigh what rivals of limbs gain, too; as it is where they are not known."""
    if rivals is None or table.seen_doubt is None:
        return table
    unlike = np.asarray(table.seen_doubt)
    return replace(table, limb_doubt=beside_rivals(unlike, rivals), limb_rival=rivals, limb_unlike=unlike)


def capacities_of(table: FrameTable, row: int | None = -1) -> Capacities:
    """The room for image blobs with which a frame was computed; None: that sufficed for every frame."""
    found = table.capacities.max(axis=0) if row is None else table.capacities[row]
    return Capacities(*(int(size) for size in found))


def state_after(table: FrameTable, start: Float[np.ndarray | Array, "dof"]) -> TrackState:
    """The tracker's state after the frames of a table, if tracking began at `start`."""
    state = TrackState.from_pose(jnp.asarray(start))
    for pose in table.pose[-2:]:
        state = state.advanced(jnp.asarray(pose))
    return state if table.baseline is None else replace(state, baseline=jnp.asarray(table.baseline[-1]))


def known_frames(
    table: FrameTable, tracker: Tracker, frames: Iterable[FrameInput] | None = None
) -> Iterator[TrackedFrame]:
    """The frames of a table as if they were tracked now; with their image blobs where what is seen is given."""
    start = jnp.asarray(table.pose[0])
    state, capacities = TrackState.from_pose(start), capacities_of(table)
    coming = iter(frames or ())
    for row in range(len(table)):
        images = _no_blobs(len(tracker.normalizers))
        if frames is not None:
            images = image_blobs(tracker, state, on_device(next(coming)), capacities)
        result = _result(table, row, images)
        yield TrackedFrame(row, result, capacities, tracker.reader.color_space, 0.0)
        state = state.advanced(result.pose)


def continued(
    tracker: Tracker,
    start: Float[np.ndarray | Array, "dof"],
    known: FrameTable | None,
    frames: Iterable[FrameInput],
    shown: bool,
    with_images: bool,
    told: Told = lambda *_: None,
) -> Iterator[TrackedFrame]:
    """Frames tracked after those that are known.

    Args:
        tracker: that tracks them.
        start: the pose where tracking begins, if none is known.
        known: the first frames; None: none is known.
        frames: what is seen; from the first frame on if known ones are `shown`, else from the first unknown one on.
        shown: whether the known frames come again, with the poses that are known.
        with_images: whether their image blobs are computed again.
        told: is told of the first frame, if none is known.
    """
    coming = iter(frames)
    if known is None:
        yield from track(tracker, jnp.asarray(start), coming, told=told)
        return
    if shown:
        seen = islice(coming, len(known))
        if with_images:
            yield from known_frames(known, tracker, seen)
        else:
            for frame, _ in zip(known_frames(known, tracker), seen, strict=True):
                yield frame
    for tracked in track(tracker, state_after(known, start), coming, capacities_of(known)):
        yield replace(tracked, index=len(known) + tracked.index)


def _result(table: FrameTable, row: int, images: Sog) -> FrameResult:
    """The result of one frame; image blobs are not kept."""
    limbs = None
    if table.is_judged:
        columns = table.arrays()
        limbs = LimbConfidence(
            **{name: jnp.asarray(columns[key][row]) for key, name in _LIMBS.items() if key in columns}
        )
    return FrameResult(
        pose=jnp.asarray(table.pose[row]),
        energy=jnp.asarray(table.energy[row]),
        terms={name: jnp.asarray(values[row]) for name, values in table.terms.items()},
        limbs=limbs,
        images=images,
        **{name: jnp.asarray(getattr(table, name)[row]) for name in _COUNTS},
    )


def _no_blobs(cameras: int) -> Sog:
    none = jnp.zeros((cameras, 0))
    return Sog(jnp.zeros((cameras, 0, 2)), none, jnp.zeros((cameras, 0, 3)), none.astype(bool))
