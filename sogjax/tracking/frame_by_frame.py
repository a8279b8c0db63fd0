"""Tracking frame by frame (Section 5.3): one compiled step for every frame of a recording."""

import time
from collections.abc import Iterable, Iterator

import equinox as eqx
import jax
from jaxtyping import Array, Float

from sogjax.tracking.capacity import first_capacities, larger_capacities
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import AnyFrame, TrackedFrame, TrackState, on_device, on_host
from sogjax.tracking.tracker import Tracker

_step = eqx.filter_jit(Tracker.step)


def track(
    tracker: Tracker,
    start: Float[Array, "dof"] | TrackState,
    frames: Iterable[AnyFrame],
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
    for index, frame in enumerate(frames):
        begin = time.perf_counter()
        known = on_device(frame)
        if capacities is None:
            capacities = first_capacities(tracker, state, known)
        while True:
            next_state, result = _step(tracker, state, known, capacities)
            needed = jax.device_get((result.num_near, result.num_matching, result.num_blocks))
            near, matching, blocks = (int(count.max()) for count in needed)
            if capacities.hold(near, matching, blocks):
                break
            capacities = larger_capacities(capacities, near, matching, blocks)
        state = next_state
        seconds = time.perf_counter() - begin
        yield TrackedFrame(index, on_host(result), capacities, tracker.reader.color_space, seconds)
