"""Room for image blobs and blocks of pairs: how much the first frame needs, and more where a frame needs more."""

from collections.abc import Callable, Sequence
from typing import TypeVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, UInt8

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.posed import History
from sogjax.energy.views import Views
from sogjax.model.program import compiled
from sogjax.tracking.culling import CAPACITIES, Capacities, block_capacity, capacity_for
from sogjax.tracking.frame import FrameInput, TrackState
from sogjax.tracking.tracker import Tracker

HEADROOM = 1.4
"""Slots for image blobs, as a multiple of what the first frame needs."""
BLOCK_HEADROOM = 1.25
"""The same for blocks of pairs, whose number for all cameras together changes less."""

Found = TypeVar("Found")

Needed = tuple[Int[Array, ""] | int, Int[Array, ""] | int, Int[Array, ""] | int]
"""Image blobs of one camera, near and matching, at most, and blocks of near pairs: what capacities must hold."""


def with_room(compute: Callable[[Capacities], tuple[Found, Needed]], capacities: Capacities) -> Found:
    """What is computed with these capacities, or larger ones if it needs them: no blob is cut off unseen.

    Raises:
        InputError: more image blobs than the largest capacity.
    """
    while True:
        found, needed = compute(capacities)
        near, matching, blocks = (int(count) for count in jax.device_get(needed))
        if capacities.hold(near, matching, blocks):
            return found
        capacities = larger_capacities(capacities, near, matching, blocks)


def views_near(
    tracker: Tracker,
    frame: FrameInput,
    pose: Float[Array, "dof"],
    capacities: Capacities,
    beyond: float = 0.0,
    other: Float[Array, "dof"] | None = None,
) -> Views:
    """What the cameras see around a pose, with larger capacities where that needs them.

    Boxes are wider by the part `beyond` of their longer sides, since limbs may be held elsewhere, and hold the `other`
    pose, too; what stands in front hides what it does of the first.
    """
    poses = pose, pose if other is None else other

    def see(room: Capacities) -> tuple[Views, Needed]:
        views, near, matching = seen_around(tracker, frame, poses, room, beyond)
        return views, (near.max(), matching.max(), 0)

    return with_room(see, capacities)


def seen_around(
    tracker: Tracker,
    frame: FrameInput,
    poses: Sequence[Float[Array, "dof"]],
    capacities: Capacities,
    beyond: float = 0.0,
) -> tuple[Views, Int[Array, "camera"], Int[Array, "camera"]]:
    """As `views_near`, with each camera's near and matching image blobs, for the caller to hold against the room."""
    part = jnp.asarray(beyond, tracker.body.blob_sigmas.dtype)
    room = Capacities(capacities.near, capacities.matching)  # one program, whatever room pairs have
    return _seen_around(tracker, frame, jnp.stack([*poses]), part, room)


@compiled
def _seen_around(
    tracker: Tracker, frame: FrameInput, poses: Float[Array, "2 dof"], beyond: Float[Array, ""], capacities: Capacities
) -> tuple[Views, Int[Array, "camera"], Int[Array, "camera"]]:
    boxes = tracker.boxes_around(*poses)
    more = beyond * jnp.max(boxes[..., 1, :] - boxes[..., 0, :], axis=-1, keepdims=True)
    wide = jnp.stack([boxes[..., 0, :] - more, boxes[..., 1, :] + more], axis=-2)
    return tracker.views(frame, TrackState.from_pose(poses[0]), capacities, wide)


def larger_capacities(capacities: Capacities, near: int, matching: int, blocks: int) -> Capacities:
    """Capacities with headroom for so many image blobs and blocks of pairs, nowhere smaller than those given.

    Raises:
        InputError: more image blobs than the largest capacity.
    """
    return Capacities(
        max(capacities.near, capacity_for(near, HEADROOM)),
        max(capacities.matching, capacity_for(matching, HEADROOM)),
        max(capacities.blocks, block_capacity(blocks, BLOCK_HEADROOM)) if blocks else capacities.blocks,
    )


def first_capacities(tracker: Tracker, state: TrackState, frame: FrameInput, moved: float = 1.0) -> Capacities:
    """Capacities with headroom for what the first frame needs, or `moved` times as many image blobs."""
    near, matching, blocks = (int(count.max()) for count in _counts(tracker, state, jnp.asarray(frame.cells)))
    near, matching = (max(count, min(round(moved * count), CAPACITIES[-1])) for count in (near, matching))
    room = capacity_for(near, HEADROOM)
    if tracker.pairs == "dense":
        return Capacities(room, capacity_for(matching, HEADROOM))
    return Capacities(room, room, block_capacity(blocks, BLOCK_HEADROOM))


def compile_counts(tracker: Tracker, shape: tuple[int, ...]) -> None:
    """Compile beforehand what `first_capacities` counts with, for cells of a shape, while other work goes on."""
    _counts(tracker, tracker.start(tracker.body.poses["rest"]), jnp.zeros(shape, jnp.uint8))


@compiled
def _counts(
    tracker: Tracker, state: TrackState, cells: UInt8[Array, "camera rows columns 3"]
) -> tuple[Int[Array, "camera"], Int[Array, "camera"], Int[Array, ""]]:
    """How many image blobs pass the first test and both tests, and how many blocks of near pairs there are.

    With as much room as there can be, for the pose where the solver starts; no blocks where all pairs are compared.
    """
    num_candidates = tracker.reader.candidates.sigmas.shape[-1]
    everything = Capacities(near=capacity_for(min(num_candidates, CAPACITIES[-1])), matching=CAPACITIES[0])
    views, near, matching = tracker.views(FrameInput(cells), state, everything)
    if tracker.pairs == "dense":
        return near, matching, jnp.asarray(0)
    objective = FrameEnergy(tracker.body, views, History.unknown(state.previous), tracker.terms)
    return near, matching, objective.near(tracker.predicted(state), capacity=1)[1]
