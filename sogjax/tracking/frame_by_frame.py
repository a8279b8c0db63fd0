"""Tracking frame by frame (Section 5.3): the same two programs for every frame; and what they say of known poses."""

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, UInt8

from sogjax.errors import InputError
from sogjax.model.program import compiled
from sogjax.model.sog import Sog
from sogjax.quality.limb_confidence import LimbConfidence
from sogjax.tracking.capacity import first_capacities, larger_capacities, seen_around
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import AnyFrame, FrameInput, FrameResult, TrackedFrame, TrackState, on_device, on_host
from sogjax.tracking.tracker import Tracker

MOVED = 1.1
"""Image blobs near a body that moves, as a multiple of those near it at rest."""

_led, _step_in = compiled(Tracker.led), compiled(Tracker.step_in)
Told = Callable[[TrackState, FrameInput, Capacities], object]
"""Is told of the first frame, and the capacities for it, before the step is compiled."""


def track(
    tracker: Tracker,
    start: Float[Array, "dof"] | TrackState,
    frames: Iterable[AnyFrame],
    capacities: Capacities | None = None,
    told: Told = lambda *_: None,
) -> Iterator[TrackedFrame]:
    """Track the frames one after the other from a rough pose of the first one, or from where another run stopped.

    Its two programs are compiled once, with room for `HEADROOM` times the image blobs of the first frame, or with the
    given capacities (of a run whose programs can so serve this one); a frame that needs more is done again with the
    next capacity (and compiles again), so no blob is ever cut off unseen. To continue a run, pass the capacities that
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
            told(state, known, capacities)
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


def _step(
    tracker: Tracker, state: TrackState, frame: FrameInput, capacities: Capacities
) -> tuple[TrackState, FrameResult]:
    """`Tracker.step` in two programs, of which searches share the first."""
    state = state if frame.keypoints is None else _led(tracker, state, frame)
    seen = seen_around(tracker, frame, tracker.box_poses(state), capacities)
    return _step_in(tracker, state, frame, seen, capacities)


def image_blobs(tracker: Tracker, state: TrackState, frame: FrameInput, capacities: Capacities) -> Sog:
    """The image blobs of a frame that was tracked already."""
    state = state if frame.keypoints is None else _led(tracker, state, frame)
    return seen_around(tracker, frame, tracker.box_poses(state), capacities)[0].images


def compile_step(tracker: Tracker, frame: AnyFrame, at_rest: Float[np.ndarray, "dof"]) -> None:
    """Compile beforehand the step of a frame, while other work goes on, from the pose of bodies at rest near theirs.

    Nothing, where there are more image blobs near that pose than the largest capacity: near the true one may be fewer.
    """
    state, known = tracker.start(at_rest), on_device(frame)
    unmoved = eqx.tree_at(lambda t: t.solver.max_iterations, tracker, jnp.zeros_like(tracker.solver.max_iterations))
    with suppress(InputError):
        _step(unmoved, state, known, first_capacities(tracker, state, known, MOVED))


@compiled
def best_after(
    tracker: Tracker,
    state: TrackState,
    cells: UInt8[Array, "camera rows columns 3"],
    capacities: Capacities,
    counts: Int[Array, "count"],
) -> tuple[Float[Array, "count dof"], Float[Array, "count"]]:
    """The best pose that the tracker's solver has seen after so many iterations of a frame, and its energy.

    The frame is solved again for every count, so no solver needs to know that it is watched.
    """
    seen = tracker.views(FrameInput(cells), state, capacities)

    def after(count: Int[Array, ""]) -> tuple[Float[Array, "dof"], Float[Array, ""]]:
        stopped = eqx.tree_at(lambda t: t.solver.max_iterations, tracker, count)
        _, result = stopped.found(state, seen, capacities)
        return result.pose, result.energy

    return jax.lax.map(after, jnp.asarray(counts))


def confidence_of_poses(
    tracker: Tracker, poses: Float[np.ndarray, "frame dof"], frames: Iterable[AnyFrame]
) -> Iterator[LimbConfidence]:
    """Of one frame after the other; none where the tracker judges no limbs."""
    baseline = tracker.with_memory(TrackState.from_pose(jnp.asarray(poses[0], jnp.float32))).baseline
    if baseline is None:
        return
    for pose, frame in zip(poses, frames, strict=True):
        found = _judged(tracker, on_device(frame), jnp.asarray(pose, jnp.float32), baseline)
        baseline = found.baseline
        yield found


@compiled
def _judged(
    tracker: Tracker, frame: FrameInput, pose: Float[Array, "dof"], baseline: Float[Array, "2 blob"]
) -> LimbConfidence:
    return tracker.judged(pose, baseline, tracker.windows(frame, TrackState.from_pose(pose)), frame)
