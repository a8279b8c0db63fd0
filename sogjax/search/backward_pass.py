"""A pass backwards beside one that is known: where they are apart, and which explains each part of the body better."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.posed import History
from sogjax.model.body import Body
from sogjax.quality.fitted import fitted_numbers
from sogjax.search.body_parts import Part, PartArrays
from sogjax.tracking.capacity import Needed, with_room
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import AnyFrame, FrameInput, TrackedFrame, TrackState, on_device
from sogjax.tracking.frame_by_frame import track
from sogjax.tracking.tracker import Tracker

MOST_BEFORE = 45
"""Frames before a stretch in doubt that are tracked backwards, at most."""
SURE_FRAMES = 3
"""Frames without doubt that lie between two stretches, at least."""

MOST_FRAMES = 240
"""Frames that are tracked backwards from one, at most: the cells of so many are held in memory."""

FramesBackwards = Callable[[int, int], Iterable[AnyFrame]]
"""The cells of the frames from the first to before the second, the last one first."""


@dataclass(frozen=True)
class Pass:
    """What tracking found, a row a frame."""

    poses: Float[np.ndarray, "frame dof"]
    doubts: Float[np.ndarray, "frame limb"]
    baseline: Float[np.ndarray, "frame 2 blob"]
    """The limbs' baseline in every frame, as in `LimbConfidence`."""
    energy: float
    """The magnitude of a frame's energy, the mean over the frames."""
    capacities: Capacities
    """The capacities of the last frame."""

    @classmethod
    def from_frames(cls, frames: Sequence[TrackedFrame]) -> "Pass":
        """The pass of some frames, whose limbs were judged."""
        judged = [frame.result.limbs for frame in frames]
        column = lambda values: np.stack([np.asarray(value) for value in values])
        energy = np.abs([float(frame.result.energy) for frame in frames]).mean()
        return cls(
            column(frame.result.pose for frame in frames),
            column(limbs.error_probability for limbs in judged if limbs is not None),
            column(limbs.baseline for limbs in judged if limbs is not None),
            float(energy),
            frames[-1].capacities,
        )


@dataclass
class Compared:
    """The frames of a backward pass beside the other, the last one first."""

    cells: list[AnyFrame]
    poses: list[Float[np.ndarray, "dof"]]
    gains: list[Float[np.ndarray, "part"]]
    """The rise of the energy if a part is taken from the backward pass."""
    apart: list[Float[np.ndarray, "part"]]
    """Metres."""


def compared_backwards(
    tracker: Tracker, passed: Pass, frames: FramesBackwards, parts: Sequence[Part], first: int, last: int
) -> tuple[Compared, int]:
    """Track from the first frame behind a stretch until both passes agree again before it; and where it began."""
    total = len(passed.poses)
    begin = min(last + 1, total)  # no frame behind the clip's last one: its pose is where the pass begins
    after = [min(begin + k, total - 1) for k in (0, 1)]
    pose, before = (jnp.asarray(passed.poses[row]) for row in after)
    known, baseline = 2 if begin < total else 0, jnp.asarray(passed.baseline[after[0]])
    start = TrackState(pose, before, jnp.asarray(known), baseline)
    found, seen = Compared([], [], [], []), []
    lowest = max(0, begin - MOST_FRAMES, first - MOST_BEFORE)

    def coming() -> Iterable[AnyFrame]:
        for frame in frames(lowest, begin):
            seen.append(frame)
            yield frame

    agree, choices, numbers = 0, PartArrays.of(tracker.body, parts), fitted_numbers().merge_passes
    for k, tracked in enumerate(track(tracker, start, coming(), passed.capacities)):
        row, both = begin - 1 - k, (jnp.asarray(passed.poses[begin - 1 - k]), jnp.asarray(tracked.result.pose))
        apart, gains = np.asarray(_apart(tracker.body, choices.blobs, *both)), np.zeros(len(parts))
        if apart.max(initial=0.0) > numbers.compared:
            gains = np.asarray(part_gains(tracker, seen[k], tracked.capacities, choices, *both))
        found.cells.append(seen[k])
        found.poses.append(np.asarray(both[1]))
        found.gains.append(gains)
        found.apart.append(apart)
        agree = agree + 1 if apart.max(initial=0.0) <= numbers.together else 0
        if row <= first and agree >= SURE_FRAMES:
            break
    return found, begin


@eqx.filter_jit
def _apart(
    body: Body, blobs: Bool[Array, "part blob"], pose: Float[Array, "dof"], other: Float[Array, "dof"]
) -> Float[Array, "part"]:
    """How far the blobs of each part are from those in another pose, in metres, on average."""
    moved = body.posed_blobs(pose).means - body.posed_blobs(other).means
    apart = jnp.broadcast_to(jnp.linalg.norm(moved, axis=-1), blobs.shape)
    return jnp.mean(apart, axis=-1, where=blobs)


def part_gains(
    tracker: Tracker,
    frame: AnyFrame,
    capacities: Capacities,
    parts: PartArrays,
    first: Float[Array, "dof"],
    second: Float[Array, "dof"],
) -> Float[Array, "part"]:
    """The gains, with larger capacities where either pose sees more image blobs."""
    known = on_device(frame)
    return with_room(lambda room: _gains(tracker, known, room, parts, first, second), capacities)


@eqx.filter_jit
def _gains(
    tracker: Tracker,
    frame: FrameInput,
    capacities: Capacities,
    parts: PartArrays,
    first: Float[Array, "dof"],
    second: Float[Array, "dof"],
) -> tuple[Float[Array, "part"], Needed]:
    """The rise of the energy with each part of the second pose instead of the first one's, and the room needed.

    The mean over what holds around it: the rest of the first pose and that of the second, in what is seen near either.
    """
    mixed = jnp.concatenate([parts.mixed(tracker.body, first, second), parts.mixed(tracker.body, second, first)])

    def seen_near(at: Float[Array, "dof"]) -> tuple[Float[Array, "part"], Needed]:
        views, near, matching = tracker.views(frame, TrackState.from_pose(at), capacities)
        energy = FrameEnergy(tracker.body, views, History.unknown(at), tracker.terms)
        values = jax.lax.map(energy, jnp.concatenate([first[None], second[None], mixed]))
        into_first, into_second = values[2:].reshape(2, -1)
        gains = 0.5 * ((into_first - values[0]) + (values[1] - into_second))
        return gains, (jnp.max(near), jnp.max(matching))

    (one, needed), (other, needed_too) = seen_near(first), seen_near(second)
    return 0.5 * (one + other), jax.tree.map(jnp.maximum, needed, needed_too)
