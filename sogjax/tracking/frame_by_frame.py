"""Tracking frame by frame (Section 5.3): one compiled step for every frame of a recording."""

import time
from collections.abc import Iterable, Iterator
from functools import partial

import equinox as eqx
import jax
from jaxtyping import Array, Bool, Float, UInt8

from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import Beside, FrameCells, FrameResult, TrackedFrame, TrackState, on_device, on_host
from sogjax.tracking.repair import Repair
from sogjax.tracking.room import first_capacities, larger_capacities
from sogjax.tracking.tracker import Tracker

_step = eqx.filter_jit(Tracker.step)


def track(
    tracker: Tracker,
    start: Float[Array, "dof"] | TrackState,
    frames: Iterable[FrameCells],
    capacities: Capacities | None = None,
) -> Iterator[TrackedFrame]:
    """Track the frames one after the other from a rough pose of the first one, or from where another run stopped.

    The step is compiled once, with room for `HEADROOM` times the image blobs of the first frame, or with the given
    capacities (of a run whose program can so serve this one); a frame that needs more is done again with the next
    capacity (and compiles again), so no blob is ever cut off unseen. To continue a run, pass the capacities that
    it stopped with: sums of other lengths round differently.

    Raises:
        InputError: more image blobs than the largest capacity.
    """
    state = tracker.with_memory(start if isinstance(start, TrackState) else TrackState.from_pose(start))
    repair = Repair(tracker.body) if tracker.repairs else None
    for index, frame in enumerate(frames):
        begin = time.perf_counter()
        cells, beside = on_device(frame)
        if capacities is None:
            capacities = first_capacities(tracker, state, cells)
        while True:
            next_state, result = _step(tracker, state, cells, capacities, beside)
            needed = jax.device_get((result.num_near, result.num_matching, result.num_blocks))
            near, matching, blocks = (int(count.max()) for count in needed)
            if capacities.hold(near, matching, blocks):
                break
            capacities = larger_capacities(capacities, near, matching, blocks)
        if repair is not None:
            step = partial(_step_within, tracker, cells, capacities, beside)
            judge = partial(_doubts, tracker, cells, beside.present)
            next_state, result = repair.after(state, (next_state, result), step, judge)
        state = next_state
        seconds = time.perf_counter() - begin
        yield TrackedFrame(index, on_host(result), capacities, tracker.reader.color_space, seconds)


def _step_within(
    tracker: Tracker,
    cells: UInt8[Array, "camera rows columns 3"],
    capacities: Capacities,
    beside: Beside,
    state: TrackState,
) -> tuple[TrackState, FrameResult] | None:
    """A step, unless it needs more room."""
    found, result = _step(tracker, state, cells, capacities, beside)
    needed = jax.device_get((result.num_near, result.num_matching, result.num_blocks))
    return (found, result) if capacities.hold(*(int(count.max()) for count in needed)) else None


@eqx.filter_jit
def _doubts(
    tracker: Tracker,
    cells: UInt8[Array, "camera rows columns 3"],
    present: Bool[Array, "camera"] | None,
    state: TrackState,
    poses: Float[Array, "try dof"],
) -> Float[Array, "try limb"]:
    """The doubt about the limbs of many poses, seen from a state."""
    odds = tracker.reader.odds(cells.astype(poses.dtype) / 255.0)
    windows = None if odds is None else tracker.reader.windows(odds, tracker.cameras, tracker.boxes(state))
    if windows is not None and present is not None:
        windows = windows.of_present(present)
    usual = tracker.with_memory(state).usual
    assert usual is not None
    return jax.lax.map(lambda pose: tracker.judged(pose, usual, windows, cells, present).doubt, poses)
