"""Tracklets: passes of which little was taken by themselves, and the best path through several of them."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.model.body import Body
from sogjax.model.limbs import limb_blobs
from sogjax.quality.fitted import fitted_numbers
from sogjax.search.best_passes import best_passes
from sogjax.search.other_pass import Compared, Pass
from sogjax.search.placed_body import means_of

Path = dict[int, Float[np.ndarray, "dof"]]
"""The poses of some rows."""


@dataclass(frozen=True)
class Tracklet:
    """Some rows of a pass beside the one that is known, in ascending order."""

    rows: Int[np.ndarray, "row"]
    poses: Float[np.ndarray, "row dof"]
    gains: Float[np.ndarray, "row"]
    """The rise of the energy with the whole pose instead of the known one."""

    @classmethod
    def of(cls, found: Compared) -> "Tracklet":
        """The rows of a pass."""
        order = np.argsort(found.rows)
        return cls(np.array(found.rows)[order], np.stack(found.poses)[order], np.array(found.gained)[order])

    def pose(self, row: int) -> Float[np.ndarray, "dof"]:
        """That of a row."""
        return self.poses[np.searchsorted(self.rows, row)]

    def where(self, kept: Bool[np.ndarray, "row"]) -> "Tracklet":
        """Some of the rows."""
        return Tracklet(self.rows[kept], self.poses[kept], self.gains[kept])


class Tracklets:
    """Passes from other poses of key frames, kept until the known pass changes beside them.

    Each ends where it explains less than the known one for a while; another one may go on from there.
    """

    def __init__(self, body: Body) -> None:
        self._body, self._kept = body, list[Tracklet]()

    def add(self, found: Compared) -> None:
        """Keep a pass that was compared as a whole."""
        self._kept.append(Tracklet.of(found))

    def forget(self, rows: Iterable[int]) -> None:
        """The known pass changed in some rows: what others gain there is not known any more."""
        changed = np.array(sorted(rows), int)
        kept = [each.where(~np.isin(each.rows, changed)) for each in self._kept]
        self._kept = [each for each in kept if len(each.rows)]

    def best_path(self, passed: Pass) -> Path:
        """The path that gains most energy, less what changes cost; none where that is nothing.

        A change costs as in `jump_passes`: by how far limbs are apart in the two passes, beyond what counts as one.
        """
        found: Path = {}
        for together in _beside_each_other(self._kept):
            found |= _best_path(self._body, passed, together)
        return found


def _beside_each_other(tracklets: Iterable[Tracklet]) -> Iterator[list[Tracklet]]:
    """Groups between which the known pass holds for a row at least."""
    group: list[Tracklet] = []
    for each in sorted(tracklets, key=lambda each: int(each.rows[0])):
        if group and each.rows[0] > max(other.rows[-1] for other in group) + 1:
            yield group
            group = []
        group.append(each)
    if group:
        yield group


def _best_path(body: Body, passed: Pass, tracklets: list[Tracklet]) -> Path:
    first, last = int(tracklets[0].rows[0]), max(int(each.rows[-1]) for each in tracklets)
    rows = np.arange(first, last + 1)
    known = means_of(body, passed.poses[rows])
    means = np.full((1 + len(tracklets), *known.shape), np.nan, known.dtype)
    means[0] = known
    worth = np.full((len(rows), len(tracklets)), -np.inf)
    for k, each in enumerate(tracklets):
        means[1 + k, each.rows - first] = means_of(body, each.poses)
        worth[each.rows - first, k] = each.gains / passed.energy
    open_ends = (first == 0, last == len(passed.poses) - 1)
    changes = [_changes(body, means, t, open_ends) for t in range(len(rows) + 1)]
    taken, _ = best_passes(worth, fitted_numbers().merge_passes.leap * np.stack(changes))
    return {row: tracklets[k - 1].pose(row) for row, k in zip(rows.tolist(), taken, strict=True) if k}


def _changes(
    body: Body, means: Float[np.ndarray, "pass row blob 3"], t: int, open_ends: tuple[bool, bool]
) -> Float[np.ndarray, "pass pass"]:
    """How far limbs are apart in each two passes between rows t - 1 and t, in metres beyond what counts as one, summed.

    In the rows in which both are known; if in neither, from the one in the row before to the other in its own.
    """
    passes, count = means.shape[:2]
    if (t == 0 and open_ends[0]) or (t == count and open_ends[1]):
        return np.zeros((passes, passes))
    beside = [row for row in (t - 1, t) if 0 <= row < count]
    between = np.stack([_limbs_apart(body, means[:, row], means[:, row]) for row in beside])
    known = np.isfinite(between)
    apart = np.where(known, between, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    if len(beside) == 2:
        apart = np.where(known.any(axis=0), apart, _limbs_apart(body, means[:, t - 1], means[:, t]))
    beyond = np.maximum(apart - fitted_numbers().merge_passes.apart, 0.0).sum(axis=-1)
    return np.where(np.isfinite(beyond), beyond, 0.0)  # a pass that is not there is worth nothing


def _limbs_apart(
    body: Body, means: Float[np.ndarray, "pass blob 3"], others: Float[np.ndarray, "other blob 3"]
) -> Float[np.ndarray, "pass other limb"]:
    """Metres between limbs, means over their blobs."""
    members = limb_blobs(body)
    members = members[members.any(axis=1)]
    apart = np.linalg.norm(means[:, None] - others[None], axis=-1)
    return apart @ (members / members.sum(axis=1, keepdims=True)).T
