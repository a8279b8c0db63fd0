"""The colours of limbs that were not found in every example pose: those that most of the poses, left and right, show.

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
"""Mean distance of the colours (sRGB, 0 to 1) of left and right blobs from which on a limb was not found. Of 98 actors
of `experiments/whole_runs.py` 82 have at most 0.093; of the 16 others eleven had an arm that was not found."""
LEAST_SEEN = 0.5
"""Part of a limb's blobs that two poses must both show for their colours to be compared."""


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
    """What to take colours from, and of which pairs of limbs too few poses agree."""

    samples: Samples
    unlike: list[Pair]


def agreed_samples(body: Body, by_pose: Sequence[Samples], colors: Float[np.ndarray, "blob 3"]) -> Agreed:
    """What to take the colours of every blob from, of the samples that each example pose shows of it.

    All of them, but of a pair of limbs of unlike `colors`: a limb that poses show alike keeps its own; another one
    takes those of the poses, its own and the other limb's, that are most alike.
    """
    agreed = Agreed(joined_samples(by_pose), [])
    for pair in limb_pairs_alike(body):
        if pair.apart(colors) > UNLIKE and not (len(by_pose) > 1 and _agree(agreed.samples, pair, by_pose)):
            agreed.unlike.append(pair)
    return agreed


def _agree(joined: Samples, pair: Pair, by_pose: Sequence[Samples]) -> bool:
    """Give the limbs of a pair the samples that tell their colours; whether these are alike."""
    seen = [(blobs, samples) for blobs in pair.blobs for samples in by_pose]
    apart = _distances(np.stack([_middle(samples, blobs) for blobs, samples in seen]))
    sides = np.repeat([0, 1], len(by_pose))
    alike = np.array([_spread(apart[np.ix_(sides == side, sides == side)]) <= UNLIKE for side in (0, 1)])
    if alike.all():
        return False  # clothes differ, or a limb is elsewhere in all poses
    told = np.flatnonzero(np.isin(sides, np.flatnonzero(alike)) if alike.any() else sides >= 0)
    near = np.sort(apart[np.ix_(told, told)], axis=1)[:, : len(told) // 2 + 1]
    centre = told[int(np.argmin(near.mean(axis=1)))]
    members = [k for k in told if apart[centre, k] <= np.median(apart[centre, told])]
    for side in np.flatnonzero(~alike):
        for number, blob in enumerate(pair.blobs[side]):
            joined[blob] = np.concatenate([seen[k][1][seen[k][0][number]] for k in members])
    return _spread(apart[np.ix_(members, members)]) <= UNLIKE


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


def _spread(apart: Float[np.ndarray, "pose pose"]) -> float:
    """Mean distance of different poses; infinite for a single one."""
    others = apart[~np.eye(len(apart), dtype=bool)]
    return float(others.mean()) if len(others) else np.inf
