"""Passes that begin where limbs are elsewhere from one frame to the next: in them, these go on as they are.

Which side of a jump is wrong the energy of its frames may not tell, but nobody moves so. A limb that is held behind a
jump as it is before leads to where it would be all the time, if it was right before; one that is held before it as it
is behind, the other way round.
"""

from collections.abc import Iterator, Set
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from sogjax.model.body import Body
from sogjax.model.limbs import limb_blobs
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.jumps import limb_jumps, peaks
from sogjax.search.body_parts import best_choice, body_parts, with_blobs
from sogjax.search.limb_search import MORE, LimbSearch
from sogjax.search.other_pass import MOST_FRAMES, PATIENCE, Compared, FramesOfRows, Pass, compared
from sogjax.search.placed_body import means_of
from sogjax.tracking.frame import TrackState, on_device


@dataclass(frozen=True)
class Jump:
    """Where limbs of a pass jump."""

    row: int
    """Behind which they do."""
    limbs: Bool[np.ndarray, "limb blob"]
    """The blobs of those that do."""
    spared: Float[np.ndarray, "frame"]
    """The energy that the jumps of all limbs behind each row are worth."""


def largest_jump(body: Body, passed: Pass, least: float, tried: Set[int]) -> Jump | None:
    """The largest jump of more than so many metres (one blob), behind none of the rows that were tried; None: none."""
    limbs, means = _limbs(body), means_of(body, passed.poses)
    if not len(limbs):
        return None
    far = limb_jumps(means, limbs)
    largest = far.max(axis=1)
    largest[[*tried]] = 0.0
    row = int(largest.argmax())
    if largest[row] <= least:
        return None
    cost = fitted_numbers().merge_passes.leap * passed.energy
    spared = cost * np.where(far > least, limb_jumps(means, limbs, np.mean), 0.0).sum(axis=1)
    return Jump(row, limbs[far[row] > least], np.where(peaks(spared), spared, 0.0))


def passes_without(
    search: LimbSearch, passed: Pass, frames: FramesOfRows, jump: Jump, limbs: Bool[np.ndarray, "limb blob"]
) -> Iterator[Compared]:
    """The pass that goes on from a jump with limbs as they are before it, and the one that goes back from it."""
    body, row, total = search.tracker.body, jump.row, len(passed.poses)
    ways = (
        (row, range(row + 1, min(row + 1 + MOST_FRAMES, total)), -1),
        (row + 1, range(row, max(row - MOST_FRAMES, -1), -1), 0),
    )
    for source, rows, before in ways:
        pose = passed.poses[rows[0]]
        (held,) = with_blobs(
            body, jnp.asarray(pose), jnp.asarray(passed.poses[source]), jnp.asarray(limbs.any(0)[None])
        )
        views = search.views(on_device(next(iter(frames(rows[:1])))), pose, passed.capacities)
        held = search.climbed(views, pose, np.asarray(held)[None], np.array([MORE]))[0][0]
        moved = np.linalg.norm(np.diff(means_of(body, np.stack([held, pose])), axis=0)[0], axis=-1)
        apart = max(moved[blobs].mean() for blobs in limbs)
        if apart > fitted_numbers().merge_passes.apart and search.possible(pose, held[None])[0]:
            start = replace(TrackState.from_pose(jnp.asarray(held)), baseline=jnp.asarray(passed.baseline[rows[0]]))
            spared = jump.spared[np.array(rows) + before]
            yield compared(search.tracker, passed, frames, body_parts(body), start, rows, 1, PATIENCE, spared)


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
    beside = [passed.poses[np.clip(row, 0, last)] for row in (found.rows[0] - step, found.rows[-1] + step)]
    paths = passed.poses[found.rows], np.stack(found.poses)
    known, other = (means_of(body, np.stack([beside[0], *path, beside[1]])) for path in paths)
    leaps = leaps_between(known, other, _limbs(body))
    leaps[[0, -1]] *= ~np.isin([found.rows[0], found.rows[-1]], [0, last])[:, None, None]  # nothing is beside the clip
    costs = fitted_numbers().merge_passes
    taken, value = best_choice(np.array(found.gained) / passed.energy - costs.bias, costs.leap * leaps)
    return ChosenRows(found, taken, value + costs.leap * float(leaps[:, 0, 0].sum()))


def leaps_between(
    known: Float[np.ndarray, "row blob 3"], other: Float[np.ndarray, "row blob 3"], limbs: Bool[np.ndarray, "limb blob"]
) -> Float[np.ndarray, "change 2 2"]:
    """How far limbs leap from the one pass to the other, or within one, from each row to the next: metres, in sum.

    Of each limb that is how much farther it goes, mean over its blobs, than in the pass in which it goes least.
    """
    paths = (known, other)
    moved = [[np.linalg.norm(to[1:] - before[:-1], axis=-1) for to in paths] for before in paths]
    means = np.array([[[of[:, blobs].mean(axis=1) for blobs in limbs] for of in row] for row in moved])
    means = np.moveaxis(means, 3, 0)
    least = np.minimum(means[:, 0, 0], means[:, 1, 1])
    return np.maximum(means - least[:, None, None], 0.0).sum(axis=-1)


def _limbs(body: Body) -> Bool[np.ndarray, "limb blob"]:
    """The blobs of each limb that has some."""
    found = limb_blobs(body)
    return found[found.any(axis=1)]
