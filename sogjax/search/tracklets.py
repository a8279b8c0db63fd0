"""Passes from other poses of a frame, kept as tracklets, and the best path through several of them."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.model.body import Body
from sogjax.model.limbs import limb_blobs
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.metrics import stretches
from sogjax.search.best_passes import best_passes
from sogjax.search.other_pass import Compared, Pass
from sogjax.search.placed_body import means_of

PosesOfRows = dict[int, Float[np.ndarray, "dof"]]
"""Poses by the row of a pass."""


@dataclass(frozen=True)
class Tracklet:
    """Consecutive rows of a pass beside the one that is known, in ascending order."""

    first: int
    """The number of its first row."""
    poses: Float[np.ndarray, "row dof"]
    gains: Float[np.ndarray, "row"]
    """The rise of the energy with the whole pose instead of the known one, once both are climbed."""

    @classmethod
    def of(cls, found: Compared) -> "Tracklet":
        """The rows of a pass; one of which nothing is known is never taken."""
        order, gains = np.argsort(found.rows), np.array(found.gained)
        known = np.where(np.isfinite(gains), gains, -np.inf)
        return cls(min(found.rows), np.stack(found.poses)[order], known[order])

    @property
    def rows(self) -> Int[np.ndarray, "row"]:
        """The numbers of its rows."""
        return np.arange(self.first, self.stop)

    @property
    def stop(self) -> int:
        """The number of the row behind its last one."""
        return self.first + len(self.gains)

    def where(self, kept: Bool[np.ndarray, "row"]) -> "list[Tracklet]":
        """What is left of it."""
        return [Tracklet(self.first + a, self.poses[a:b], self.gains[a:b]) for a, b in stretches(kept)]


class Tracklets:
    """What is known of other passes, until the known one changes beside them.

    Each ends where it explains less than the known one for a while; another one may go on from there.
    """

    def __init__(self, body: Body) -> None:
        self._body, self._kept, self._changed = body, list[Tracklet](), False

    def add(self, found: Compared) -> None:
        """Keep a pass that was compared as a whole."""
        self._kept.append(Tracklet.of(found))
        self._changed = True

    def forget(self, rows: Iterable[int]) -> None:
        """The known pass changed in some rows: what others gain there is not known any more."""
        changed = np.array(sorted(rows), int)
        self._kept = [part for each in self._kept for part in each.where(~np.isin(each.rows, changed))]
        self._changed = True

    def best_path(self, passed: Pass) -> PosesOfRows:
        """The path that gains most energy, less what changes cost; none where that is nothing, or nothing is new.

        A change costs as in `jump_passes`: by how far limbs are apart in the two passes, beyond what counts as one.
        """
        found: PosesOfRows = {}
        for together in _beside_each_other(self._kept if self._changed else []):
            found |= _best_path(self._body, passed, together)
        self._changed = False
        return found


def _beside_each_other(tracklets: Iterable[Tracklet]) -> Iterator[list[Tracklet]]:
    """Groups between which the known pass holds for a row at least."""
    group: list[Tracklet] = []
    for each in sorted(tracklets, key=lambda each: each.first):
        if group and each.first > max(other.stop for other in group):
            yield group
            group = []
        group.append(each)
    if group:
        yield group


def _side_by_side(tracklets: Sequence[Tracklet]) -> list[list[Tracklet]]:
    """As few passes as hold all tracklets, those of each with a row at least between them; they are in order."""
    passes: list[list[Tracklet]] = []
    for each in tracklets:
        free = next((others for others in passes if others[-1].stop < each.first), None)
        if free is None:
            passes.append([each])
        else:
            free.append(each)
    return passes


def _best_path(body: Body, passed: Pass, tracklets: Sequence[Tracklet]) -> PosesOfRows:
    first, stop = tracklets[0].first, max(each.stop for each in tracklets)
    others, known = _side_by_side(tracklets), passed.poses[first:stop]
    poses = np.tile(known, (1 + len(others), 1, 1))
    worth = np.full((stop - first, len(others)), -np.inf)
    for k, of_pass in enumerate(others):
        for each in of_pass:
            poses[1 + k, each.rows - first] = each.poses
            worth[each.rows - first, k] = each.gains / passed.energy
    there = np.concatenate([np.ones((len(known), 1), bool), np.isfinite(worth)], axis=1)
    means = np.stack([means_of(body, of_pass) for of_pass in poses], axis=1)
    apart = np.stack([_limbs_apart(body, of_row, of_row) for of_row in means])
    changes = _changes(body, means, apart, there)
    changes[0] *= first > 0  # nothing is before the clip, or behind it
    changes[-1] *= stop < len(passed.poses)
    taken, _ = best_passes(worth, fitted_numbers().merge_passes.leap * changes)
    elsewhere = apart[np.arange(len(taken)), 0, taken].max(axis=-1) > fitted_numbers().merge_passes.apart
    rows = [row for a, b in stretches(taken > 0) if elsewhere[a:b].any() for row in range(a, b)]
    return {first + row: poses[taken[row], row] for row in rows}


def _changes(
    body: Body,
    means: Float[np.ndarray, "row pass blob 3"],
    apart: Float[np.ndarray, "row pass pass limb"],
    there: Bool[np.ndarray, "row pass"],
) -> Float[np.ndarray, "change pass pass"]:
    """How far limbs are apart in each two passes before each row and behind the last, beyond what counts as one.

    In metres, summed over the limbs, in the rows beside in which both are there; if in neither, from the one in the row
    before to the other in its own.
    """
    both = there[:, :, None] & there[:, None, :]
    alone = np.where(both[..., None], apart, 0.0)
    found = [alone[0]]
    for (before, after), (was, now), way in zip(
        pairwise(alone), pairwise(both), (_limbs_apart(body, a, b) for a, b in pairwise(means)), strict=True
    ):
        count = (was.astype(int) + now)[..., None]
        found.append(np.where(count > 0, (before + after) / np.maximum(count, 1), way))
    found.append(alone[-1])
    return np.maximum(np.stack(found) - fitted_numbers().merge_passes.apart, 0.0).sum(axis=-1)


def _limbs_apart(
    body: Body, means: Float[np.ndarray, "pass blob 3"], others: Float[np.ndarray, "other blob 3"]
) -> Float[np.ndarray, "pass other limb"]:
    """Metres between limbs, means over their blobs."""
    members = limb_blobs(body)
    members = members[members.any(axis=1)]
    apart = np.linalg.norm(means[:, None] - others[None], axis=-1)
    return apart @ (members / members.sum(axis=1, keepdims=True)).T
