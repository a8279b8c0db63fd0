"""The colours of limbs that were not found in every example pose: those of the poses, left and right, that are alike.

Where people reach for each other, masks do not tell every arm. One that is not where the body is believed to hold it
shows whatever is there, another thing in each pose; where it was found, it shows the same.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from sogjax.actor.colors import MIN_SAMPLES, Samples, joined_samples
from sogjax.model.body import Body
from sogjax.model.limbs import limb_blobs
from sogjax.search.body_parts import limb_groups

UNLIKE = 0.1
"""Mean distance of the blobs' colours (sRGB, 0 to 1) from which on a limb and its counterpart, or either in two poses,
do not show the same. Left and right of 82 of 98 actors of `experiments/whole_runs.py` are at most 0.093 apart; of the
16 others eleven had an arm that was not found."""
LEAST_SEEN = 0.5
"""Part of a limb's blobs that two poses must both show for their colours to be compared."""
FEWEST_ROWS = 3
"""Limbs in poses, of which half may be most alike."""


class Pair(NamedTuple):
    """A limb and its counterpart."""

    limbs: tuple[int, int]
    """Their numbers among those of the body."""
    blobs: tuple[np.ndarray, np.ndarray]
    """Of each, in the same order."""

    def apart(self, colors: Float[np.ndarray, "blob 3"]) -> float:
        """How far the colours (sRGB, 0 to 1) of the two are apart."""
        one, other = (colors[blobs] for blobs in self.blobs)
        return float(np.linalg.norm(one - other, axis=1).mean())


def limb_pairs_alike(body: Body) -> list[Pair]:
    """The pairs of limbs that have as many blobs."""
    blobs = limb_blobs(body)
    pairs = [
        Pair((one, other), (np.flatnonzero(blobs[one]), np.flatnonzero(blobs[other])))
        for one, other in (members for members in limb_groups(body) if len(members) == 2)
    ]
    return [pair for pair in pairs if len(pair.blobs[0]) == len(pair.blobs[1])]


class Agreed(NamedTuple):
    """What to take colours from, and which pairs of limbs stay unlike, or are found in too few poses."""

    samples: Samples
    unlike: list[Pair]


def agreed_samples(body: Body, by_pose: Sequence[Samples], colors: Float[np.ndarray, "blob 3"]) -> Agreed:
    """What to take the colours of every blob from, of the samples that each example pose shows of it.

    All of them, but of a pair of limbs of unlike `colors`. A limb that most of its poses show alike takes the colours
    of these; another one those of its counterpart, if that is such a limb. Where neither is, both take those of the
    poses of either that are most alike.
    """
    agreed = Agreed(joined_samples(by_pose), [])
    for pair in limb_pairs_alike(body):
        if pair.apart(colors) > UNLIKE and not _agree(agreed.samples, pair, by_pose):
            agreed.unlike.append(pair)
    return agreed


def _agree(joined: Samples, pair: Pair, by_pose: Sequence[Samples]) -> bool:
    """Give the limbs of a pair the samples that tell their colours; whether both are of one colour, surely."""
    seen = [(side, samples) for side in (0, 1) for samples in by_pose]
    middles = np.stack([_middle(samples, pair.blobs[side]) for side, samples in seen])
    told = np.isfinite(middles[..., 0]).mean(axis=1) >= LEAST_SEEN
    apart, sides = _distances(middles), np.array([side for side, _ in seen])
    found = [_majority(apart, np.flatnonzero(told & (sides == side))) for side in (0, 1)]
    if not any(found):
        found = [_most_alike(apart, np.flatnonzero(told))] * 2
    for side, members in enumerate(found):
        for number, blob in enumerate(pair.blobs[side]):
            shown = [seen[k][1][pair.blobs[seen[k][0]][number]] for k in members or found[1 - side]]
            joined[blob] = np.concatenate(shown) if shown else joined[blob]
    alike = apart[np.ix_(*[sorted({*found[0], *found[1]})] * 2)]
    return len(alike) > 1 and float(alike[~np.eye(len(alike), dtype=bool)].mean()) <= UNLIKE


def _majority(apart: Float[np.ndarray, "limb limb"], rows: np.ndarray) -> list[int]:
    """Those of some rows that are alike, if they are more than half, and more than one; else none."""
    near = apart[np.ix_(rows, rows)] <= UNLIKE
    members = rows[near[int(np.argmax(near.sum(axis=1)))]] if len(rows) else rows
    return members.tolist() if len(members) > max(len(rows) / 2, 1) else []


def _most_alike(apart: Float[np.ndarray, "limb limb"], rows: np.ndarray) -> list[int]:
    """The half of some rows that is most alike; none of too few."""
    if len(rows) < FEWEST_ROWS:
        return []
    among = apart[np.ix_(rows, rows)]
    centre = int(np.argmin(np.sort(among, axis=1)[:, : len(rows) // 2 + 1].mean(axis=1)))
    return rows[among[centre] <= np.median(among[centre])].tolist()


def _middle(samples: Samples, blobs: np.ndarray) -> Float[np.ndarray, "blob 3"]:
    """The median colour of some blobs; NaN where too little is seen."""
    none = np.full(3, np.nan)
    return np.stack([np.median(samples[k], axis=0) if len(samples[k]) >= MIN_SAMPLES else none for k in blobs])


def _distances(colors: Float[np.ndarray, "limb blob 3"]) -> Float[np.ndarray, "limb limb"]:
    """Mean distances of the blobs' colours; infinite where too few blobs are seen in both."""
    off = np.linalg.norm(colors[:, None] - colors[None], axis=-1)
    both = np.isfinite(off)
    mean = np.where(both, off, 0.0).sum(axis=-1) / np.maximum(both.sum(axis=-1), 1)
    return np.where(both.mean(axis=-1) >= LEAST_SEEN, mean, np.inf)
