"""Other passes: each part of the body is taken from the pass that explains it better, over time.

In key frames all over the clip limbs are held in other ways, and in a few frames actors are turned back to front. Where
that is worth more than what was tracked, a pass goes from there both ways; what of several such passes is worth more
together is taken as well. Where limbs jump, passes hold them as they are before or behind, and are taken whole. Where
limbs are in doubt then, a pass comes backwards from behind: a limb that is lost is often found again by itself, and
what hid it, or moved too far for one frame, comes from the other side.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import count

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.metrics import stretches
from sogjax.search.jump_passes import ChosenRows, Jump, chosen_rows, largest_jump, passes_without
from sogjax.search.limb_search import Found, LimbSearch, in_lanes
from sogjax.search.misplaced import Misplaced
from sogjax.search.other_pass import (
    MOST_FRAMES,
    PATIENCE,
    SURE_FRAMES,
    Compared,
    FramesOfRows,
    Pass,
    compared_backwards,
    compared_both_ways,
    compared_known,
    parts_apart,
)
from sogjax.search.pose_search import Report, unreported
from sogjax.search.revision import RevisedPass, Revision
from sogjax.search.tracklets import PosesOfRows
from sogjax.search.turned_body import turned_pose
from sogjax.tracking.frame import AnyFrame
from sogjax.tracking.tracker import Tracker

LIKELY_LOST = 0.5
"""How likely lost a limb must be to be searched for longer."""
MOST_SWEEPS = 6
"""Times that key frames are searched, where they changed meanwhile."""
MORE_SWEEPS = 6
"""Times that key frames in which a limb is likely lost still are searched, each time with other draws: with few cameras
only few draws lead to where an arm is."""
MOST_LOOKS, MORE_LOOKS = 1, 2
"""Frames of other passes that gain nothing, at most, in lengths of the clip; and how many more, from where a limb is
likely lost, in numbers of such frames."""

LOOK_FOR_ACTOR = 20
"""Frames of a pass that take as long as looking for an actor in one."""
TURNED_PATIENCE = 20
"""`PATIENCE` of a pass with an actor turned: while he stands still, front and back are worth the same."""


def in_doubt(passed: Pass) -> Bool[np.ndarray, "frame"]:
    """The frames around which a clip is tracked backwards."""
    return passed.doubts.max(axis=1, initial=0.0) > fitted_numbers().merge_passes.doubtful


def merge_passes(
    tracker: Tracker,
    passed: Pass,
    frames: FramesOfRows,
    key_rows: Sequence[int] = (),
    turning_rows: Sequence[int] = (),
    misplaced: Misplaced | None = None,
    report: Report = unreported,
    jump: float = np.inf,
    known: Float[np.ndarray, "frame dof"] | None = None,
) -> Revision:
    """Where another pass explains parts of the body better.

    Limbs are searched in `key_rows` and held as before where they `jump` (metres, of a blob from a frame to the next),
    actors turned back to front in `turning_rows`, and those `misplaced` looked for; first parts are taken from the
    `known` poses of another pass. `frames` reads what is seen in rows of `passed`; the tracker must judge limbs.
    """
    own = {name: getattr(passed, name).copy() for name in ("poses", "doubts", "energies")}
    revising = _Revising(tracker, replace(passed, **own), frames)
    if known is not None:
        revising.take_known(known, misplaced)
    if misplaced is not None:
        revising.place_actors(misplaced)
    revising.turn_actors(turning_rows)
    revising.search_limbs(key_rows, report)
    revising.smooth_jumps(jump)
    while (stretch := revising.next_stretch()) is not None:
        revising.take(compared_backwards(tracker, revising.passed, frames, revising.known.parts, *stretch))
    revising.note_rivals(key_rows, report)
    return revising.known.revision


class _Revising:
    """The search for passes that explain more than the known one, which is revised meanwhile."""

    def __init__(self, tracker: Tracker, passed: Pass, frames: FramesOfRows) -> None:
        self.tracker, self.passed, self.frames = tracker, passed, frames
        self.known = RevisedPass(tracker, passed)
        self._search = LimbSearch.of(tracker, passed.capacities)
        self._tried: set[int] = set()
        self._looked_at = 0

    def _tired(self, row: int | None = None) -> bool:
        """Whether too much was looked at in vain for another pass, which begins in a row."""
        lost = self._likely_lost
        more = 0 if row is None or not lost[row] else MORE_LOOKS * int(lost.sum())
        return self._looked_at > MOST_LOOKS * len(lost) + more

    @property
    def _likely_lost(self) -> Bool[np.ndarray, "frame"]:
        return self.passed.doubts.max(axis=1, initial=0.0) > LIKELY_LOST

    def search_limbs(self, rows: Sequence[int], report: Report) -> None:
        """Hold limbs in other ways in some frames, and see where these lead that are worth more.

        Frames that changed meanwhile are searched again: a limb may have been in the place of another.
        """
        search = self._search
        if search is None:
            return
        self._search_limbs(search, rows, report)
        for _ in range(MOST_SWEEPS - 1):
            self._search_limbs(search, [row for row in rows if row in self.known.changed], unreported)
        for _ in range(MORE_SWEEPS):
            likely = self._likely_lost
            lost = [row for row in rows if likely[row]]
            self._looked_at += len(lost)  # a look costs about as much as a frame of a pass
            self._search_limbs(search, lost, unreported)
        self._looked_at = 0  # what comes backwards from behind doubts may look at as much

    def note_rivals(self, rows: Sequence[int], report: Report) -> None:
        """Note what other ways to hold limbs are worth beside the poses that were found in some rows."""
        search = self._search
        if search is None:
            return
        rivals = lambda lane, row: search.rivals(partial(self._frame, row), self.passed, row, lane)
        changed = [row for row in rows if not search.knows_rivals(row, self.passed.poses[row])]
        in_lanes(_reported(rivals, len(changed), report), changed)
        self.known.revision.rivals |= {row: rivals(0, row) for row in rows}

    def take_known(self, poses: Float[np.ndarray, "frame dof"], misplaced: Misplaced | None) -> None:
        """Take what the poses of another pass of the clip explain better, by stretches in which the passes differ."""
        blobs, least = self.known.part_blobs, fitted_numbers().merge_passes.compared
        both = zip(map(jnp.asarray, self.passed.poses), map(jnp.asarray, poses), strict=True)
        differ = np.array([np.max(parts_apart(self.tracker.body, blobs, *pair), initial=0.0) > least for pair in both])
        for first, stop in stretches(differ, gap=SURE_FRAMES):
            for begin in range(max(first - 1, 0), stop, MOST_FRAMES):
                rows = range(begin, min(begin + MOST_FRAMES, stop + 1, len(poses)))
                self.take(compared_known(self.tracker, self.passed, self.frames, self.known.parts, rows, poses))
        self._note_explained(misplaced)
        self.known.changed.clear()
        self._looked_at = 0

    def _note_explained(self, misplaced: Misplaced | None) -> None:
        """Tell the search for misplaced actors what is explained of them in frames that changed."""
        if misplaced is not None:
            for changed in self.known.changed:
                misplaced.explained[changed] = self.known.revision.frames[changed].judged.explained

    def place_actors(self, misplaced: Misplaced) -> None:
        """See where it leads if an actor of whom little is explained is where he is found again."""
        search = self._search
        for row, actor in misplaced.places():
            if search is None or self._tired():
                break
            self._looked_at += LOOK_FOR_ACTOR
            pose = misplaced.pose(search, self._frame(row), self.passed, row, actor)
            if pose is not None:
                self._pass_from(search, row, pose, TURNED_PATIENCE)
                self._note_explained(misplaced)
        self.known.changed.clear()
        self._looked_at = 0

    def turn_actors(self, rows: Sequence[int]) -> None:
        """See where it leads if an actor is back to front in some frames."""
        search = self._search
        wholes = [part for part in self.known.parts if part.whole is None]
        for row in rows:
            if search is None or self._tired():
                break
            pose = turned_pose(search, wholes, self._frame(row), self.passed, row)
            if pose is not None:
                self._pass_from(search, row, pose, TURNED_PATIENCE)
        self.known.changed.clear()  # limbs are searched all over the clip next
        self._looked_at = 0

    def smooth_jumps(self, least: float) -> None:
        """See where it leads if limbs that are elsewhere in the next frame go on as they were, or were so before.

        First one limb by itself, then all that jump there.
        """
        search, body = self._search, self.tracker.body
        for at_once in (1, 2):
            tried: set[int] = set()
            while search is not None and not self._tired():
                jump = largest_jump(body, self.passed, least, tried, at_once)
                if jump is None:
                    break
                tried.add(jump.row)
                self._smooth_jump(search, jump, [jump.limbs] if at_once > 1 else [(limb,) for limb in jump.limbs])
        self._looked_at = 0

    def _smooth_jump(self, search: LimbSearch, jump: Jump, ways: Sequence[Sequence[int]]) -> None:
        """Take the pass that is worth most of those in which some limbs do not jump, if it is worth anything."""
        best: ChosenRows | None = None
        for held in ways:
            for found in passes_without(search, self.passed, self.frames, jump, held):
                self._looked_at += len(found.rows)
                choice = chosen_rows(self.tracker.body, self.passed, found)
                best = choice if best is None or choice.value > best.value else best
        if best is not None and best.taken.any():
            self._looked_at -= len(best.taken)
            self.known.put(best.found, best.poses)

    def _search_limbs(self, search: LimbSearch, rows: Sequence[int], report: Report) -> None:
        """Search limbs in some rows, then see where what was found leads, what gains most in its row first."""
        self.known.changed.clear()
        rows = [row for row in rows if not self._tired(row)]
        better_pose = lambda lane, row: search.better_pose(self._frame(row), self.passed, row, lane)
        looked = zip(rows, in_lanes(_reported(better_pose, len(rows), report), rows), strict=True)
        found = {row: better for row, better in looked if better is not None}
        report(0.0)  # how long the rest takes depends on what was found
        for row, better in sorted(found.items(), key=lambda item: -item[1].gain):
            if row in self.known.changed or self._tired(row):
                continue
            if search.is_in_vain(row, better.pose):
                better = search.better_pose(self._frame(row), self.passed, row)
            if better is not None:
                self._pass_from(search, row, better.pose)
        path = self.known.tracklets.best_path(self.passed)
        self._take_path(path)
        search.forget_in_vain(path)
        self._looked_at = max(self._looked_at - len(path), 0)  # what leads somewhere together was not in vain

    def _take_path(self, path: PosesOfRows) -> None:
        """Take poses of several passes, in the order of the rows; the cells of so many are held as of a pass."""
        moved = np.isin(np.arange(len(self.passed.poses)), [*path])
        blobs = self.known.part_blobs
        for first, stop in stretches(moved):
            for begin in range(first, stop, MOST_FRAMES):
                rows = range(begin, min(begin + MOST_FRAMES, stop))
                found = Compared(cells=[*self.frames(rows)])
                for row in rows:
                    both = jnp.asarray(self.passed.poses[row]), jnp.asarray(path[row])
                    found.add(row, path[row], np.asarray(parts_apart(self.tracker.body, blobs, *both)))
                self.known.put(found, {row: path[row] for row in rows})

    def _frame(self, row: int) -> AnyFrame:
        return next(iter(self.frames(range(row, row + 1))))

    def _pass_from(
        self, search: LimbSearch, row: int, pose: Float[np.ndarray, "dof"], patience: int = PATIENCE
    ) -> None:
        """Go both ways from another pose of a frame, and take what that explains better."""
        found = compared_both_ways(self.tracker, self.passed, self.frames, self.known.parts, row, pose, patience)
        self.known.tracklets.add(found)  # what of it is taken is forgotten
        changed = self.take(found)
        search.forget_in_vain(changed)
        if not changed:
            search.note_in_vain(found.rows, found.poses, found.gained)

    def next_stretch(self) -> tuple[int, int] | None:
        """First and last frame of the last stretch in doubt from behind which no pass has begun."""
        if self._tired():
            return None
        found = [(first, stop - 1) for first, stop in stretches(in_doubt(self.passed), gap=SURE_FRAMES)]
        left = [stretch for stretch in found if stretch[1] not in self._tried]
        if left:
            self._tried.add(left[-1][1])
        return left[-1] if left else None

    def take(self, found: Compared) -> set[int]:
        """Take what another pass explains better; the rows that changed."""
        changed = self.known.take(found)
        self._looked_at += 0 if changed else len(found.rows)
        return changed


def _reported(function: Callable[[int, int], Found], total: int, report: Report) -> Callable[[int, int], Found]:
    """The function of a lane and a row, which reports the share of all rows that are done."""
    done = count()

    def of_row(lane: int, row: int) -> Found:
        report(next(done) / total)
        return function(lane, row)

    return of_row
