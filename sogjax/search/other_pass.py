"""A pass from elsewhere beside one that is known: where they are apart, and which explains each part better.

It begins behind frames in doubt and goes backwards, or at another pose of a key frame and goes both ways.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.posed import History
from sogjax.energy.views import Views
from sogjax.model.body import Body
from sogjax.quality.fitted import fitted_numbers
from sogjax.search.body_parts import Part, PartArrays
from sogjax.tracking.capacity import views_near
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import AnyFrame, TrackState, on_device
from sogjax.tracking.frame_by_frame import track
from sogjax.tracking.tracker import Tracker

MOST_BEFORE = 45
"""Frames before a stretch in doubt that are tracked backwards, at most."""
SURE_FRAMES = 3
"""Frames without doubt that lie between two stretches, at least."""

PATIENCE, LEAST_GAIN = 6, 0.02
"""Frames after which a pass from another pose of a key frame ends that explains less than the known one; and what it
gains at least, as a part of a frame's energy, for its parts to be looked at."""

REACH = 0.3
"""Part of the longer side of an actor's box by which pictures are looked at beyond it: limbs may be held there."""
MOST_FRAMES = 240
"""Frames that are tracked backwards from one, at most: the cells of so many are held in memory."""

FramesOfRows = Callable[[range], Iterable[AnyFrame]]
"""What is seen in some rows of a pass, in the order of the range, which may go backwards."""


@dataclass(frozen=True)
class Pass:
    """What tracking found, a row a frame."""

    poses: Float[np.ndarray, "frame dof"]
    doubts: Float[np.ndarray, "frame limb"]
    baseline: Float[np.ndarray, "frame 2 blob"]
    """The limbs' baseline in every frame, as in `LimbConfidence`."""
    energies: Float[np.ndarray, "frame"]
    capacities: Capacities
    """The capacities of the last frame."""

    @property
    def energy(self) -> float:
        """The magnitude of a frame's energy, the mean over the frames."""
        return float(np.abs(self.energies).mean())


@dataclass
class Compared:
    """The frames of another pass beside the one that is known, in the order of `rows`."""

    rows: list[int] = field(default_factory=list)
    cells: list[AnyFrame] = field(default_factory=list)
    poses: list[Float[np.ndarray, "dof"]] = field(default_factory=list)
    gains: list[Float[np.ndarray, "part"]] = field(default_factory=list)
    """The rise of the energy if a part is taken from the other pass."""
    apart: list[Float[np.ndarray, "part"]] = field(default_factory=list)
    """Metres."""

    def joined(self, later: "Compared") -> "Compared":
        """These frames turned round, then later ones of which the first is known already."""
        parts = (getattr(self, each.name)[::-1] + getattr(later, each.name)[1:] for each in fields(self))
        return Compared(*parts)


def compared_backwards(
    tracker: Tracker, passed: Pass, frames: FramesOfRows, parts: Sequence[Part], first: int, last: int
) -> Compared:
    """Track from the first frame behind a stretch until both passes agree again before it."""
    total = len(passed.poses)
    begin = min(last + 1, total)  # no frame behind the clip's last one: its pose is where the pass begins
    after = [min(begin + k, total - 1) for k in (0, 1)]
    pose, before = (jnp.asarray(passed.poses[row]) for row in after)
    known, baseline = 2 if begin < total else 0, jnp.asarray(passed.baseline[after[0]])
    start = TrackState(pose, before, jnp.asarray(known), baseline)
    lowest = max(0, begin - MOST_FRAMES, first - MOST_BEFORE)
    return compared(tracker, passed, frames, parts, start, range(begin - 1, lowest - 1, -1), begin - first)


def compared_both_ways(
    tracker: Tracker,
    passed: Pass,
    frames: FramesOfRows,
    parts: Sequence[Part],
    row: int,
    pose: Float[np.ndarray, "dof"],
) -> Compared:
    """Track from another pose of a frame, backwards and forwards, until the passes agree."""
    start = replace(TrackState.from_pose(jnp.asarray(pose)), baseline=jnp.asarray(passed.baseline[row]))
    ways = (
        range(row, max(row - MOST_FRAMES, -1), -1),
        range(row, min(row + MOST_FRAMES, len(passed.poses))),
    )
    back, forth = (compared(tracker, passed, frames, parts, start, way, 1, PATIENCE) for way in ways)
    return back.joined(forth)


def compared(
    tracker: Tracker,
    passed: Pass,
    frames: FramesOfRows,
    parts: Sequence[Part],
    start: TrackState,
    rows: range,
    at_least: int,
    patience: int | None = None,
) -> Compared:
    """Track some rows, one after the other, until both passes agree again after at least so many.

    With `patience` the pass ends, too, where it has explained less than the known one for so many frames.
    """
    found, choices, numbers = Compared(), PartArrays.of(tracker.body, parts), fitted_numbers().merge_passes

    def coming() -> Iterable[AnyFrame]:
        for frame in frames(rows):
            found.cells.append(frame)
            yield frame

    agree, capacities, gained = 0, [], []
    for k, (row, tracked) in enumerate(zip(rows, track(tracker, start, coming(), passed.capacities), strict=False)):
        both = (jnp.asarray(passed.poses[row]), jnp.asarray(tracked.result.pose))
        apart = np.asarray(_apart(tracker.body, choices.blobs, *both))
        found.rows.append(row)
        found.poses.append(np.asarray(both[1]))
        found.apart.append(apart)
        capacities.append(tracked.capacities)
        if patience is not None:
            gained.append(gained_in(tracker, found.cells[k], passed.capacities, *both))
        agree = agree + 1 if apart.max(initial=0.0) <= numbers.together else 0
        if k + 1 >= at_least and agree >= SURE_FRAMES:
            break
        if patience is not None and k + 1 >= patience and sum(gained[-patience:]) < 0.0:
            break
    hopeless = patience is not None and max(np.cumsum(gained)) < LEAST_GAIN * passed.energy
    for k, row in enumerate(found.rows):
        both = (jnp.asarray(passed.poses[row]), jnp.asarray(found.poses[k]))
        differ = np.zeros(len(parts), bool) if hopeless else _differ(parts, found.apart[k] > numbers.compared)
        found.gains.append(part_gains(tracker, found.cells[k], capacities[k], choices, *both, differ))
    return found


def gained_in(
    tracker: Tracker,
    frame: AnyFrame,
    capacities: Capacities,
    known: Float[np.ndarray | Array, "dof"],
    other: Float[np.ndarray | Array, "dof"],
) -> float:
    """The rise of the energy with another pose, both in the same views: the mean of those around either.

    Tracking valued each in views of its own, in which other image blobs count.
    """
    both, seen = jnp.stack([jnp.asarray(known), jnp.asarray(other)]), on_device(frame)
    views = [views_near(tracker, seen, pose, capacities, REACH) for pose in both]
    values = np.mean([np.asarray(values_in(tracker, around, both)) for around in views], axis=0)
    return float(values[1] - values[0])


def _differ(parts: Sequence[Part], apart: Bool[np.ndarray, "part"]) -> Bool[np.ndarray, "part"]:
    """Parts to be compared: limbs that are apart, the pairs with one of these, and whole actors if anything is."""
    moved = {name for part, is_apart in zip(parts, apart, strict=True) if is_apart for name in part.names}
    return np.array([bool(moved) if part.whole is None else not moved.isdisjoint(part.names) for part in parts])


@eqx.filter_jit
def _apart(
    body: Body, blobs: Bool[Array, "part blob"], pose: Float[Array, "dof"], other: Float[Array, "dof"]
) -> Float[Array, "part"]:
    """How far the blobs of each part are from those in another pose, in metres, on average."""
    moved = body.posed_blobs(pose).means - body.posed_blobs(other).means
    apart = jnp.broadcast_to(jnp.linalg.norm(moved, axis=-1), blobs.shape)
    return jnp.mean(apart, axis=-1, where=blobs)


PARTS_AT_ONCE = 4
"""Parts whose gains are computed in one call: seldom do more differ."""


def part_gains(
    tracker: Tracker,
    frame: AnyFrame,
    capacities: Capacities,
    parts: PartArrays,
    first: Float[Array, "dof"],
    second: Float[Array, "dof"],
    asked: Bool[np.ndarray, "part"] | None = None,
) -> Float[np.ndarray, "part"]:
    """The rise of the energy with each part of the second pose instead of the first one's.

    What holds around a part is the rest of the first pose, or that of the second; in what is seen near either. Of a
    limb that has a counterpart the lesser rise counts: where two are exchanged, one by itself gains only beside the
    other's new place. Of other parts it is the mean.

    Args:
        tracker: whose energy it is.
        frame: what is seen.
        capacities: room for image blobs.
        parts: of the body.
        first: the pose that is known.
        second: the other one.
        asked: of which parts the rise is wanted; None: of all. It is 0 for the others.
    """
    found = np.zeros(len(parts.whole))
    rows = np.arange(len(found)) if asked is None else np.flatnonzero(asked)
    if len(rows):
        known = on_device(frame)
        views = [views_near(tracker, known, at, capacities) for at in (first, second)]
        for some in np.split(rows, range(PARTS_AT_ONCE, len(rows), PARTS_AT_ONCE)):
            chosen = np.resize(some, PARTS_AT_ONCE)
            those = jax.tree.map(lambda leaf, chosen=chosen: leaf[chosen], parts)
            found[some] = np.asarray(_gains(tracker, views, those, first, second))[: len(some)]
    return found


def _gains(
    tracker: Tracker, views: Sequence[Views], parts: PartArrays, first: Float[Array, "dof"], second: Float[Array, "dof"]
) -> Float[np.ndarray, "part"]:
    poses = _mixed(tracker.body, parts, first, second)
    values = np.stack([np.asarray(values_in(tracker, near, poses)) for near in views])
    into_first, into_second = np.split(values[:, 2:], 2, axis=1)
    around = np.stack([into_first - values[:, :1], values[:, 1:2] - into_second]).mean(axis=1)
    return np.where(np.asarray(parts.in_pairs), around.min(axis=0), around.mean(axis=0))


@eqx.filter_jit
def _mixed(
    body: Body, parts: PartArrays, first: Float[Array, "dof"], second: Float[Array, "dof"]
) -> Float[Array, "mixed dof"]:
    mixed = [parts.mixed(body, first, second), parts.mixed(body, second, first)]
    return jnp.concatenate([first[None], second[None], *mixed])


@eqx.filter_jit
def values_in(tracker: Tracker, views: Views, poses: Float[Array, "start dof"]) -> Float[Array, "start"]:
    """The energies of poses in the same views, without history."""
    return jax.lax.map(FrameEnergy(tracker.body, views, History.unknown(poses[0]), tracker.terms), poses)
