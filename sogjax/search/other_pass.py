"""A pass from elsewhere beside one that is known: where they are apart, and which explains each part better.

It begins behind frames in doubt and goes backwards, at another pose of a key frame and goes both ways, or where a limb
jumps.
"""

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.keypoints import keypoint_term_among
from sogjax.energy.posed import History
from sogjax.energy.views import Views
from sogjax.model.batches import of_each, shared_out
from sogjax.model.body import Body
from sogjax.model.cores import go_on, in_threads
from sogjax.model.program import compiled
from sogjax.quality.fitted import fitted_numbers
from sogjax.search.body_parts import Part, PartArrays
from sogjax.search.climbed import FEW, climbed_in
from sogjax.search.worth import worth
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

MOST_WAITING = 6
"""Frames of which views are held until a pass is promising."""

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
    climbed: dict[int, Float[np.ndarray | Array, "dof"]] = field(default_factory=dict, init=False, compare=False)
    """What came of those poses that were climbed without history, by their rows; whoever changes a pose drops it."""

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
    gained: list[float] = field(default_factory=list)
    """The rise of the energy with the other pass's pose, once both are climbed; 0 where that was not asked."""

    def add(self, row: int, pose: Float[np.ndarray, "dof"], apart: Float[np.ndarray, "part"]) -> None:
        """Add a frame, of which no rise is known yet."""
        self.rows.append(row)
        self.poses.append(pose)
        self.apart.append(apart)
        self.gains.append(np.zeros(len(apart)))
        self.gained.append(0.0)

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
    patience: int = PATIENCE,
) -> Compared:
    """Track from another pose of a frame, backwards and forwards, until the passes agree, or `patience` ends."""
    start = replace(TrackState.from_pose(jnp.asarray(pose)), baseline=jnp.asarray(passed.baseline[row]))
    ways = (
        range(row, max(row - MOST_FRAMES, -1), -1),
        range(row, min(row + MOST_FRAMES, len(passed.poses))),
    )
    back, forth = in_threads(lambda way: compared(tracker, passed, frames, parts, start, way, 1, patience), ways)
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
    spared: Float[np.ndarray, "row"] | None = None,
) -> Compared:
    """Track some rows, one after the other, until both passes agree again after at least so many.

    With `patience` the pass ends, too, where it has explained less than the known one for so many frames; if there is
    energy that it has `spared` in each row, only once it has lost more than that. Then no parts are compared, since
    such a pass is taken whole.
    """
    found, choices, numbers = Compared(), PartArrays.of(tracker.body, parts), fitted_numbers().merge_passes
    # Parts are compared once the pass is promising; views are large, so few frames wait for that.
    waiting: deque[tuple[int, BothSeen]] = deque()

    def coming() -> Iterable[AnyFrame]:
        for frame in frames(rows):
            go_on()
            found.cells.append(frame)
            yield frame

    def compare(k: int, seen: BothSeen) -> None:
        found.gains[k] = part_gains(tracker, seen, choices, differ(k))

    differ = lambda k: _differ(parts, found.apart[k] > numbers.compared)
    agree, promising = 0, patience is None
    least = np.zeros(len(rows)) if spared is None else -np.cumsum(spared)
    for k, (row, tracked) in enumerate(zip(rows, track(tracker, start, coming(), passed.capacities), strict=False)):
        both = (jnp.asarray(passed.poses[row]), jnp.asarray(tracked.result.pose))
        apart = np.asarray(parts_apart(tracker.body, choices.blobs, *both))
        found.add(row, np.asarray(both[1]), apart)
        if patience is not None or differ(k).any():
            seen = BothSeen.of(tracker, found.cells[k], tracked.capacities, *both)
            found.gained[k] = seen.climbed_gain(passed.climbed, row)
            waiting.extend([(k, seen)] if spared is None else [])
        promising = promising or sum(found.gained) >= LEAST_GAIN * passed.energy
        while waiting and (promising or len(waiting) > MOST_WAITING):
            compare(*waiting.popleft())
        agree = agree + 1 if apart.max(initial=0.0) <= numbers.together else 0
        if k + 1 >= at_least and agree >= SURE_FRAMES:
            break
        worse = patience is not None and k + 1 >= patience and sum(found.gained[-patience:]) < 0.0
        if worse and (spared is None or sum(found.gained) < least[k]):
            break
    if not promising:
        found.gains = [np.zeros(len(parts)) for _ in found.gains]
    return found


def compared_known(
    tracker: Tracker,
    passed: Pass,
    frames: FramesOfRows,
    parts: Sequence[Part],
    rows: range,
    poses: Float[np.ndarray, "frame dof"],
) -> Compared:
    """Some rows beside the poses of a pass, of all rows, that is known already."""
    found, choices, least = Compared(), PartArrays.of(tracker.body, parts), fitted_numbers().merge_passes.compared
    for row, frame in zip(rows, frames(rows), strict=True):
        both = jnp.asarray(passed.poses[row]), jnp.asarray(poses[row])
        apart = np.asarray(parts_apart(tracker.body, choices.blobs, *both))
        found.cells.append(frame)
        found.add(row, poses[row], apart)
        if (differ := _differ(parts, apart > least)).any():
            seen = BothSeen.of(tracker, frame, passed.capacities, *both)
            found.gained[-1] = seen.climbed_gain(passed.climbed, row)
            found.gains[-1] = part_gains(tracker, seen, choices, differ)
    return found


@dataclass(frozen=True)
class BothSeen:
    """A known pose of a frame and another one, and what is seen around both, wider by `REACH`.

    Tracking valued each in views of its own, in which other image blobs count: these energies cannot be compared.
    """

    tracker: Tracker
    poses: Float[Array, "2 dof"]
    views: tuple[Views, ...]
    """What is seen around both. Where something stands in front, or there are keypoints, twice: with what is hidden of
    the one, and whose keypoints they are beside it, and with that of the other."""
    capacities: Capacities
    """Room for what is seen around one of them."""

    @classmethod
    def of(
        cls,
        tracker: Tracker,
        frame: AnyFrame,
        capacities: Capacities,
        known: Float[np.ndarray | Array, "dof"],
        other: Float[np.ndarray | Array, "dof"],
    ) -> "BothSeen":
        """Look at a frame around both poses, with at least so much room for image blobs."""
        poses, seen = jnp.stack([jnp.asarray(known), jnp.asarray(other)]), on_device(frame)
        alike = tracker.reader.occluders is None and keypoint_term_among(tracker.terms) is None
        orders = (poses,) if alike else (poses, poses[::-1])
        views = tuple(views_near(tracker, seen, one, capacities, REACH, two) for one, two in orders)
        return cls(tracker, poses, views, capacities)

    @cached_property
    def values(self) -> Float[np.ndarray, "view 2"]:
        """The energy of both poses."""
        return np.stack([_energies(self.tracker, around, self.poses) for around in self.views])

    @property
    def gain(self) -> float:
        """The rise of the energy with the other pose: the mean over the views."""
        return float(np.mean(self.values[:, 1] - self.values[:, 0]))

    def climbed_gain(self, climbed: dict[int, Float[np.ndarray | Array, "dof"]], row: int) -> float:
        """The rise of the energy with the other pose once both are climbed from where they are.

        Tracking leaves each pose short of its optimum, by 0.2 to 0.5 % of the energy and by more where it was tracked
        less long: that is more than two ways to hold an arm differ by. Where what is seen does not depend on the other
        pose but for its extent, the known one is climbed once: what comes of it is added to those `climbed`, by row.
        """
        climb = lambda near, pose, share: climbed_in(self.tracker, near, pose, share, self.capacities)
        starts = [(near, pose, FEW) for pose in self.poses for near in self.views]
        alone = len(self.views) == 1
        if alone and row in climbed:
            starts[0] = self.views[0], climbed[row], 0.0
        ends = in_threads(lambda start: jax.device_get(climb(*start)), starts)
        if alone:
            climbed.setdefault(row, ends[0][0])
        known, others = np.array([value for _, value in ends], float).reshape(2, -1)
        return float(np.mean(others - known))


def _differ(parts: Sequence[Part], apart: Bool[np.ndarray, "part"]) -> Bool[np.ndarray, "part"]:
    """Parts to be compared: limbs that are apart, the pairs with one of these, and whole actors if anything is."""
    moved = {name for part, is_apart in zip(parts, apart, strict=True) if is_apart for name in part.names}
    return np.array([bool(moved) if part.whole is None else not moved.isdisjoint(part.names) for part in parts])


@compiled
def parts_apart(
    body: Body, blobs: Bool[Array, "part blob"], pose: Float[Array, "dof"], other: Float[Array, "dof"]
) -> Float[Array, "part"]:
    """How far the blobs of each part are from those in another pose, in metres, on average."""
    moved = body.posed_blobs(pose).means - body.posed_blobs(other).means
    apart = jnp.broadcast_to(jnp.linalg.norm(moved, axis=-1), blobs.shape)
    return jnp.mean(apart, axis=-1, where=blobs)


PARTS_AT_ONCE = 4
"""Parts that are mixed in one call: seldom do more differ."""
ENERGIES_IN_A_CALL = 8
"""Room for poses."""


def part_gains(
    tracker: Tracker, seen: BothSeen, parts: PartArrays, asked: Bool[np.ndarray, "part"] | None = None
) -> Float[np.ndarray, "part"]:
    """The rise of the energy with each part of the other pose instead of the known one's.

    What holds around a part is the rest of the known pose, or that of the other; in what is seen near either. Of a
    limb that has a counterpart the lesser rise counts: where two are exchanged, one by itself gains only beside the
    other's new place. Of other parts it is the mean.

    Args:
        tracker: whose energy it is.
        seen: both poses.
        parts: of the body.
        asked: of which parts the rise is wanted; None: of all. It is 0 for the others.
    """
    found = np.zeros(len(parts.whole))
    rows = np.arange(len(found)) if asked is None else np.flatnonzero(asked)
    if not len(rows):
        return found
    for some in np.split(rows, range(PARTS_AT_ONCE, len(rows), PARTS_AT_ONCE)):
        chosen = np.resize(some, PARTS_AT_ONCE)
        those = jax.tree.map(lambda leaf, chosen=chosen: leaf[chosen], parts)
        mixed = _mixed(tracker.body, those, *seen.poses)[: 2 * len(some)]
        values = np.stack([_energies(tracker, near, mixed) for near in seen.views])
        around = np.stack([values[:, ::2] - seen.values[:, :1], seen.values[:, 1:] - values[:, 1::2]]).mean(axis=1)
        in_pairs = np.asarray(those.in_pairs)[: len(some)]
        found[some] = np.where(in_pairs, around.min(axis=0), around.mean(axis=0))
    return found


@compiled
def _mixed(
    body: Body, parts: PartArrays, first: Float[Array, "dof"], second: Float[Array, "dof"]
) -> Float[Array, "mixed dof"]:
    """For each part, the first pose with that of the second, and the second with that of the first."""
    mixed = jnp.stack([parts.mixed(body, first, second), parts.mixed(body, second, first)], axis=1)
    return mixed.reshape(-1, len(first))


def _energies(tracker: Tracker, views: Views, poses: Float[Array, "pose dof"]) -> Float[np.ndarray, "pose"]:
    """The energies of poses in the same views, without history."""
    return shared_out(partial(_energies_in_call, tracker, views), ENERGIES_IN_A_CALL, poses)[0]


@compiled
def _energies_in_call(
    tracker: Tracker, views: Views, count: Int[Array, ""], poses: Float[Array, "pose dof"]
) -> tuple[Float[Array, "pose"]]:
    energy = FrameEnergy(tracker.body, views, History.unknown(poses[0]), tracker.terms)
    return (of_each(lambda pose: worth(energy, tracker.solid, pose), poses, count=count),)
