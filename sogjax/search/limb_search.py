"""Better poses of single frames, in which limbs are held in other ways; and what rivals of limbs gain."""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from sogjax.energy.views import Views
from sogjax.model.cores import go_on, in_threads
from sogjax.model.limbs import limb_names
from sogjax.model.solid import DEEP, impossibilities
from sogjax.quality.limb_confidence import LEAST_RIVAL
from sogjax.search.climbed import FEW, MORE, climbed_in
from sogjax.search.held_otherwise import APART, NUM_CLIMBED, HeldOtherwise, held_otherwise
from sogjax.search.limb_ways import Unit, UnitArrays, drawn_ways, outer, units_of
from sogjax.search.other_pass import REACH, Pass
from sogjax.search.placed_body import means_of
from sogjax.search.worth import IMPOSSIBLE_COST
from sogjax.tracking.capacity import views_near
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import AnyFrame, FrameInput, TrackState, on_device
from sogjax.tracking.tracker import Tracker

Found = TypeVar("Found")

ELSEWHERE = 0.15
"""Metres, mean over the outer blobs of a limb, from where it was tracked: then it is elsewhere."""
SLACK, WORTH = -0.002, 0.001
"""Parts of a frame's energy: what another way gains, while the rest is held, for the whole body to be climbed from
there, and what it gains then for a pass to go from there."""
CROSSED_SLACK, CROSSED_APART = -0.01, 0.03
"""What hands or feet that are exchanged gain at least, as a part of a frame's energy, to be climbed with the whole body
(with the rest held, elbows are not where they would be), and how far they then are, as `APART`."""
CROSSED_RIVAL = -0.02
"""The least of that as a part of an actor's energy, impossible or not, for them to be climbed as rivals."""
IN_VAIN = 2
"""Passes in vain that hold a pose in a frame, from which on none begins there."""
MOST_ROUNDS = 3
"""Times that limbs are searched in a frame, each from the better pose that was found."""
MOST_WHOLE = 3
"""Poses that are climbed with all degrees of freedom in a frame, beside the tracked one and that with crossed ends."""

LANES = 2
"""Parts of a clip whose key frames are searched beside each other; not the number of cores, on which no result may
depend."""

InVain = Sequence[tuple[Float[np.ndarray, "dof"], int]]
"""Poses of passes in vain in a frame, and what each counts."""


class BetterPose(NamedTuple):
    """A pose of a frame that is worth more than the one that is known."""

    pose: Float[np.ndarray, "dof"]
    gain: float
    """How much higher the frame's energy is. What tracking left to climb counts, too: were the known one climbed as
    well, fewer passes would begin, and more limbs stay lost."""


class LimbSearch:
    """Looks for better ways to hold limbs, in one key frame of a lane after the other."""

    def __init__(self, tracker: Tracker, units: Sequence[Unit], capacities: Capacities) -> None:
        self.tracker, self.units, self.arrays = tracker, units, UnitArrays.of(tracker.body, units)
        self.capacities = capacities
        self._turns = [*range(LANES)]
        self._carried: list[HeldOtherwise | None] = [None] * LANES
        self._in_vain: dict[int, list[tuple[np.ndarray, int]]] = {}
        self._rivals: dict[int, tuple[np.ndarray, np.ndarray]] = {}

    @classmethod
    def of(cls, tracker: Tracker, capacities: Capacities) -> "LimbSearch | None":
        """The search for the limbs of a tracker's body, in frames that need about so much room; None: it has none."""
        units = units_of(tracker.body)
        return cls(tracker, units, capacities) if units else None

    def note_in_vain(
        self, rows: Sequence[int], poses: Sequence[Float[np.ndarray, "dof"]], gained: Sequence[float]
    ) -> None:
        """Learn the poses of a pass of which nothing was taken, and what they gained.

        None begins there again; where it gained, one more may: it went wrong elsewhere, and may not from there.
        """
        for row, pose, gain in zip(rows, poses, gained, strict=True):
            self._in_vain.setdefault(row, []).append((pose, 1 if gain > 0.0 else IN_VAIN))

    def forget_in_vain(self, rows: Iterable[int]) -> None:
        """Rows changed: what led nowhere from there may do now."""
        for row in rows:
            self._in_vain.pop(row, None)

    def better_pose(self, frame: AnyFrame, passed: Pass, row: int, lane: int = 0) -> BetterPose | None:
        """The pose of a frame with limbs held otherwise, climbed with all degrees of freedom, if that is worth more.

        From a better pose the limbs are searched again: one may have been in the place of another.
        """
        first = passed.poses[row].copy()
        views = self.views(on_device(frame), first)
        held = self.held_otherwise(views, first, lane)
        self._note_rivals(row, views, first, held, passed.energy)
        found = self.with_better_limbs(views, first, first, passed.energy, self._in_vain.get(row, []), held, lane)
        return None if found.pose is first else found

    def rivals(self, frame: Callable[[], AnyFrame], passed: Pass, row: int, lane: int = 0) -> Float[np.ndarray, "limb"]:
        """What the best way with each limb elsewhere gains over the pose in a row of a pass.

        As a part of an actor's energy; losses beyond `LEAST_RIVAL` are cut off there. NaN: the limb is not searched.
        The `frame` is only read where the pose is another than when the row was searched.
        """
        pose = passed.poses[row].copy()
        if not self.knows_rivals(row, pose):
            views = self.views(on_device(frame()), pose)
            self._note_rivals(row, views, pose, self.held_otherwise(views, pose, lane), passed.energy)
        return self._rivals[row][1]

    def knows_rivals(self, row: int, pose: Float[np.ndarray, "dof"]) -> bool:
        """Whether rivals of a pose in a row were searched already."""
        return row in self._rivals and np.array_equal(self._rivals[row][0], pose)

    def _note_rivals(
        self, row: int, views: Views, pose: Float[np.ndarray, "dof"], found: HeldOtherwise, energy: float
    ) -> None:
        if not self.knows_rivals(row, pose):
            self._rivals[row] = pose, self._rivals_among(pose, *self._ways(views, pose, found, energy), energy)

    def _ways(
        self, views: Views, pose: Float[np.ndarray, "dof"], found: HeldOtherwise, energy: float
    ) -> tuple[Float[np.ndarray, "unit way dof"], Float[np.ndarray, "unit way"]]:
        """The ways to hold each unit, and one more: its ends exchanged, climbed with the whole body; what they gain.

        Where hands meet, elbows and trunk go with them: with the rest held, hands that were exchanged stay worth less.
        """
        crossed, ends = np.asarray(found.crossed), np.tile(pose, (len(self.units), 1))
        lead = (found.crossed_apart > CROSSED_APART) & (found.crossed_gains > CROSSED_RIVAL * self._of_an_actor(energy))
        gains = np.full(len(self.units), -np.inf)
        if lead.any():
            ends[lead], gains[lead] = self.climbed(views, pose, crossed[lead], np.full(int(lead.sum()), MORE))
        cheaper = IMPOSSIBLE_COST * energy * self._less_impossible(pose, np.asarray(found.poses))
        of_ways = np.asarray(found.gains, float) + cheaper  # those of climbs count it already
        return np.concatenate([found.poses, ends[:, None]], axis=1), np.concatenate([of_ways, gains[:, None]], axis=1)

    def _rivals_among(
        self,
        pose: Float[np.ndarray, "dof"],
        ways: Float[np.ndarray, "unit way dof"],
        gains: Float[np.ndarray, "unit way"],
        energy: float,
    ) -> Float[np.ndarray, "limb"]:
        """As `rivals`, among ways that were climbed."""
        body, here = self.tracker.body, means_of(self.tracker.body, pose[None])
        rivals = np.full(len(limb_names(body)), np.nan)
        for unit, poses, gained in zip(self.units, ways, gains / self._of_an_actor(energy), strict=True):
            moved, possible = np.linalg.norm(means_of(body, poses) - here, axis=-1), self.possible(pose, poses)
            for limb, blobs in zip(unit.limbs, unit.blobs, strict=True):
                elsewhere = np.average(moved[:, blobs], axis=1, weights=outer(len(blobs))) > ELSEWHERE
                rivals[limb] = np.max(gained, where=elsewhere & possible, initial=LEAST_RIVAL)
        return rivals

    def _of_an_actor(self, energy: float) -> float:
        """An actor's part of a frame's energy."""
        return max(energy, np.finfo(float).tiny) / len(np.unique(self.tracker.body.blob_actors))

    def is_in_vain(self, row: int, pose: Float[np.ndarray, "dof"]) -> bool:
        """Whether passes from such a pose of a frame led nowhere."""
        return not self._worth_a_pass(pose[None], self._in_vain.get(row, []))[0]

    def with_better_limbs(
        self,
        views: Views,
        first: Float[np.ndarray, "dof"],
        pose: Float[np.ndarray, "dof"],
        energy: float,
        in_vain: InVain = (),
        held: HeldOtherwise | None = None,
        lane: int = 0,
    ) -> BetterPose:
        """A pose with limbs held otherwise as long as that is worth more; itself, where nothing is.

        `first` is the tracked pose, `energy` that of a frame, for scale. Poses near those `in_vain` do not count. What
        is `held` otherwise at first is searched if it is not given.
        """
        best = BetterPose(pose, 0.0)
        for number in range(MOST_ROUNDS):
            held = held if held is not None and number == 0 else self.held_otherwise(views, best.pose, lane)
            better = self._better(views, first, best.pose, held, energy, in_vain)
            if better is None:
                break
            best = BetterPose(better.pose, best.gain + better.gain)
        return best

    def _apart(
        self, poses: Float[np.ndarray, "other dof"], pose: Float[np.ndarray, "dof"]
    ) -> Float[np.ndarray, "other"]:
        """Metres between poses and one, mean over the blobs of the limb that differs most."""
        moved = np.linalg.norm(means_of(self.tracker.body, poses) - means_of(self.tracker.body, pose[None]), axis=-1)
        return np.max([moved[:, blobs].mean(axis=1) for unit in self.units for blobs in unit.blobs], axis=0)

    def views(self, frame: FrameInput, pose: Float[np.ndarray, "dof"]) -> Views:
        """What the cameras see where limbs may be held."""
        return views_near(self.tracker, frame, jnp.asarray(pose), self.capacities, REACH)

    def held_otherwise(self, views: Views, pose: Float[np.ndarray, "dof"], lane: int = 0) -> HeldOtherwise:
        """Ways to hold limbs around a pose; some of the lane's next frame are those found here."""
        self._turns[lane] += LANES
        tried = [self._tried(k, unit, pose, lane).astype(pose.dtype) for k, unit in enumerate(self.units)]
        held = lambda k: held_otherwise(self.tracker, views, jnp.asarray(pose), self.arrays[k], jnp.asarray(tried[k]))
        found = in_threads(lambda k: jax.device_get(held(k)), range(len(self.units)))
        together = self._carried[lane] = jax.tree.map(lambda *of_units: np.stack(of_units), *found)
        return together

    def _better(
        self,
        views: Views,
        first: Float[np.ndarray, "dof"],
        pose: Float[np.ndarray, "dof"],
        found: HeldOtherwise,
        energy: float,
        in_vain: InVain,
    ) -> BetterPose | None:
        """The best that is reached from a pose with units held otherwise; None: nothing that is worth more."""
        held, crossed = self._starts(first, pose, found, energy)
        starts = np.concatenate([held, crossed])
        if not len(starts):
            return None
        ends, gains = self.climbed(views, pose, starts, np.where(np.arange(len(starts)) < len(held), FEW, MORE))
        good = (gains > WORTH * energy) & (self._apart(ends, pose) > APART) & self.possible(first, ends)
        good &= self._worth_a_pass(ends, in_vain)
        best = int(np.argmax(np.where(good, gains, -np.inf)))
        return BetterPose(ends[best], float(gains[best])) if good.any() else None

    def _worth_a_pass(self, poses: Float[np.ndarray, "pose dof"], in_vain: InVain) -> Bool[np.ndarray, "pose"]:
        """Near which poses not too many passes were in vain."""
        times = np.zeros(len(poses), int)
        for other, count in in_vain:
            times += count * (self._apart(poses, other) <= APART)
        return times < IN_VAIN

    def climbed(
        self,
        views: Views,
        known: Float[np.ndarray, "dof"],
        starts: Float[np.ndarray, "start dof"],
        shares: Float[np.ndarray, "start"],
    ) -> tuple[Float[np.ndarray, "start dof"], Float[np.ndarray, "start"]]:
        """Poses climbed, each by a share of the solver's most iterations, and what they gain over a known pose."""
        tried = [*zip(starts, shares, strict=True), (known, 0.0)]
        climb = lambda each: jax.device_get(climbed_in(self.tracker, views, each[0], float(each[1]), self.capacities))
        found = in_threads(climb, tried)
        values = np.array([value for _, value in found])
        return np.stack([end for end, _ in found])[:-1], values[:-1] - values[-1]

    def _starts(
        self,
        first: Float[np.ndarray, "dof"],
        pose: Float[np.ndarray, "dof"],
        found: HeldOtherwise,
        energy: float,
    ) -> tuple[Float[np.ndarray, "start dof"], Float[np.ndarray, "crossed dof"]]:
        """What is possible and worth climbing: the best ways of all units together, single ones; and crossed ends."""
        cheaper = lambda poses: IMPOSSIBLE_COST * energy * self._less_impossible(pose, np.asarray(poses))
        gains = np.where(found.apart > APART, found.gains + cheaper(found.poses), -np.inf)
        best, starts = gains.argmax(axis=1), []
        gaining = [k for k, way in enumerate(best) if gains[k, way] > 0.0]
        if len(gaining) > 1:
            together = pose.copy()
            for k in gaining:
                dofs = self.units[k].all_dofs
                together[dofs] = found.poses[k, best[k]][dofs]
            starts.append(together)
        order = np.argsort(-gains, axis=None)
        promising = order[gains.reshape(-1)[order] > SLACK * energy]
        starts = np.array([*starts, *found.poses.reshape(-1, len(pose))[promising]]).reshape(-1, len(pose))
        crossed = np.where(found.crossed_apart > CROSSED_APART, found.crossed_gains + cheaper(found.crossed), -np.inf)
        likeliest = found.crossed[[int(np.argmax(crossed))]] if crossed.max() > CROSSED_SLACK * energy else starts[:0]
        allowed = lambda poses: poses[self.possible(first, poses)]
        return allowed(starts)[:MOST_WHOLE], allowed(likeliest)

    def possible(
        self, known: Float[np.ndarray, "dof"], poses: Float[np.ndarray, "start dof"]
    ) -> Bool[np.ndarray, "start"]:
        """Which poses hold nothing deep in something else, but for what is as deep in the known one."""
        solid = self.tracker.solid
        if solid is None:
            return np.ones(len(poses), bool)
        return solid.deeper(self.tracker.body, known, poses).max(axis=1, initial=0.0) <= DEEP

    def _less_impossible(
        self, pose: Float[np.ndarray, "dof"], others: Float[np.ndarray, "*start dof"]
    ) -> Float[np.ndarray, "*start"]:
        """How much less impossible than a pose others are, -1 to 1."""
        shape, solid = others.shape[:-1], self.tracker.solid
        if solid is None:
            return np.zeros(shape, others.dtype)
        impossible = lambda poses: np.asarray(impossibilities(solid, self.tracker.body, jnp.asarray(poses)))
        return impossible(pose[None])[0] - impossible(others.reshape(-1, others.shape[-1])).reshape(shape)

    def _tried(
        self, number: int, unit: Unit, pose: Float[np.ndarray, "dof"], lane: int
    ) -> Float[np.ndarray, "seed dof"]:
        """Ways that are drawn, and those of the lane's last key frame."""
        drawn, carried = drawn_ways(self.tracker.body, unit, pose, self._turns[lane]), self._carried[lane]
        before = np.tile(pose, (NUM_CLIMBED - 1, 1))
        if carried is not None:
            before[:, unit.all_dofs] = carried.poses[number, 1:NUM_CLIMBED][:, unit.all_dofs]
        return np.concatenate([before, drawn])


def in_lanes(function: Callable[[int, int], Found], rows: Sequence[int]) -> list[Found]:
    """What a function makes of each row, given with its lane: each lane takes a part of the rows, in order."""
    if len(rows) < LANES:
        return [function(0, row) for row in rows]  # within a lane it would have half of the cores
    parts = [part.tolist() for part in np.array_split(np.asarray(rows), LANES)]

    def of_lane(lane: int) -> list[Found]:
        found = []
        for row in parts[lane]:
            go_on()
            found.append(function(lane, row))
        return found

    return [found for of_rows in in_threads(of_lane, range(LANES)) for found in of_rows]


def compile_search(tracker: Tracker, state: TrackState, frame: FrameInput, capacities: Capacities) -> None:
    """Compile beforehand what a search for limbs needs, in a frame, while other work goes on."""
    search = LimbSearch.of(tracker, capacities)
    if search is not None and tracker.limbs is not None:
        pose = np.asarray(state.previous)
        views = search.views(frame, pose)
        programs = (
            lambda: search.climbed(views, pose, pose[None], np.zeros(1)),  # the slowest first
            lambda: search.held_otherwise(views, pose),
        )
        in_threads(lambda compile_one: compile_one(), programs)
