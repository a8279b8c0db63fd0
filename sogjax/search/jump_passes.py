"""Passes that begin where limbs are elsewhere from one frame to the next: in them, these go on as they are.

Which side of a jump is wrong the energy of its frames may not tell, but nobody moves so. A limb that is held behind a
jump as it is before leads to where it would be all the time, if it was right before; one that is held before it as it
is behind, the other way round.
"""

from collections.abc import Sequence, Set
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from sogjax.model.body import Body
from sogjax.model.cores import in_threads
from sogjax.model.limbs import limb_blobs, limbs
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.jumps import limb_jumps, peaks
from sogjax.search.best_passes import best_passes
from sogjax.search.body_parts import body_parts
from sogjax.search.climbed import MORE
from sogjax.search.limb_search import LimbSearch
from sogjax.search.other_pass import MOST_FRAMES, PATIENCE, REACH, Compared, FramesOfRows, Pass, compared
from sogjax.search.placed_body import means_of
from sogjax.tracking.capacity import views_near
from sogjax.tracking.frame import TrackState, on_device


@dataclass(frozen=True)
class Jump:
    """Where limbs of a pass jump."""

    row: int
    """Behind which they do."""
    limbs: tuple[int, ...]
    """Those that do, by their numbers."""
    spared: Float[np.ndarray, "frame"]
    """The energy that the jumps of all limbs behind each row are worth."""


def largest_jump(body: Body, passed: Pass, least: float, tried: Set[int], at_once: int = 1) -> Jump | None:
    """The largest jump of more than so many metres (one blob) and so many limbs at once; None: none that is untried."""
    means, members = means_of(body, passed.poses), limb_blobs(body)
    far = limb_jumps(means, members)
    jump = far > least
    largest = np.where(jump.sum(axis=1) >= at_once, peaks(far.max(axis=1, initial=0.0)), 0.0)
    largest[[*tried]] = 0.0
    row = int(largest.argmax())
    if largest[row] <= least:
        return None
    cost = fitted_numbers().merge_passes.leap * passed.energy
    spared = cost * peaks(np.where(jump, limb_jumps(means, members, np.mean), 0.0)).sum(axis=1)
    return Jump(row, tuple(np.flatnonzero(jump[row]).tolist()), spared)


def passes_without(
    search: LimbSearch, passed: Pass, frames: FramesOfRows, jump: Jump, held: Sequence[int]
) -> list[Compared]:
    """The pass that goes on from a jump with some limbs as they are before it, and the one that goes back from it."""
    body, row, total = search.tracker.body, jump.row, len(passed.poses)
    dofs = np.concatenate([limbs(body.skeleton)[limb] for limb in held])
    ways = (
        (row, range(row + 1, min(row + 1 + MOST_FRAMES, total)), -1),
        (row + 1, range(row, max(row - MOST_FRAMES, -1), -1), 0),
    )

    def compared_from(source: int, rows: range, before: int) -> Compared | None:
        pose = passed.poses[rows[0]]
        other = pose.copy()
        other[dofs] = passed.poses[source, dofs]
        frame, both = on_device(next(iter(frames(rows[:1])))), (jnp.asarray(pose), jnp.asarray(other))
        views = views_near(search.tracker, frame, both[0], passed.capacities, REACH, both[1])
        other = search.climbed(views, pose, other[None], np.array([MORE]))[0][0]
        moved = np.linalg.norm(np.diff(means_of(body, np.stack([other, pose])), axis=0)[0], axis=-1)
        apart = max(moved[blobs].mean() for blobs in limb_blobs(body)[[*held]])
        if apart <= fitted_numbers().merge_passes.apart or not search.possible(pose, other[None])[0]:
            return None
        start = replace(TrackState.from_pose(jnp.asarray(other)), baseline=jnp.asarray(passed.baseline[rows[0]]))
        spared = jump.spared[np.array(rows) + before]
        return compared(search.tracker, passed, frames, body_parts(body), start, rows, 1, PATIENCE, spared)

    return [found for found in in_threads(lambda way: compared_from(*way), ways) if found is not None]


@dataclass(frozen=True)
class ChosenRows:
    """Where another pass is taken as it is."""

    found: Compared
    taken: Bool[np.ndarray, "row"]
    value: float
    """What that gains, as a part of a frame's energy."""

    @property
    def poses(self) -> dict[int, Float[np.ndarray, "dof"]]:
        """The other pass's poses, by the rows that are taken."""
        return {self.found.rows[k]: self.found.poses[k] for k in np.flatnonzero(self.taken)}


def chosen_rows(body: Body, passed: Pass, found: Compared) -> ChosenRows:
    """Where a pass is taken as it is, which gains energy, or spares jumps that are worth more than it loses."""
    last = len(passed.poses) - 1
    step = found.rows[-1] - found.rows[-2] if len(found.rows) > 1 else 1
    beside = [[found.rows[0] - k * step for k in (2, 1)], [found.rows[-1] + k * step for k in (1, 2)]]
    ends = [passed.poses[np.clip(rows, 0, last)] for rows in beside]
    paths = passed.poses[found.rows], np.stack(found.poses)
    known, other = (means_of(body, np.concatenate([ends[0], path, ends[1]])) for path in paths)
    members = limb_blobs(body)
    leaps = leaps_between(known, other, members[members.any(axis=1)])
    leaps[[0, -1]] *= ~np.isin([found.rows[0], found.rows[-1]], [0, last])[:, None, None]  # nothing is beside the clip
    costs = fitted_numbers().merge_passes
    taken, value = best_passes(np.array(found.gained)[:, None] / passed.energy, costs.leap * leaps)
    return ChosenRows(found, taken > 0, value + costs.leap * float(leaps[:, 0, 0].sum()))


def leaps_between(
    known: Float[np.ndarray, "path blob 3"],
    other: Float[np.ndarray, "path blob 3"],
    members: Bool[np.ndarray, "limb blob"],
) -> Float[np.ndarray, "change 2 2"]:
    """How far limbs leap from the one pass to the other, or within one, before each row and behind the last.

    In metres, beyond how their blobs move before and after (`steps`), means over the blobs of each limb, of which so
    much counts as is more than two passes are apart; in sum. The paths go on for two rows beyond the passes.
    """
    leaves = [1.5 * path[1:-2] - 0.5 * path[:-3] for path in (known, other)]
    comes = [1.5 * path[2:-1] - 0.5 * path[3:] for path in (known, other)]
    far = [[np.linalg.norm(to - before, axis=-1) for to in comes] for before in leaves]
    means = np.array([[[of[:, blobs].mean(axis=1) for blobs in members] for of in row] for row in far])
    for k in (0, 1):  # within a pass, half of a leap is seen beside it
        means[k, k] = peaks(means[k, k].T).T
    return np.moveaxis(np.maximum(means - fitted_numbers().merge_passes.apart, 0.0).sum(axis=2), 2, 0)
