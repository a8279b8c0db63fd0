"""Frames that one camera lost or repeated: its offset at the end of a clip differs from that at its beginning."""

from dataclasses import dataclass

import numpy as np

from sogjax.check.barcodes import PairCodes
from sogjax.check.synchronisation import Synchrony, synchrony

LARGEST = 3
"""Frames lost or repeated within a clip, at most, beyond the offset of the whole."""
FEWEST_STEPS = 16
"""In either half."""
SHARP, LEAST_SHARP = 0.06, 0.01
"""How far the likeness with the others must fall beside the offset, in the better half and in the other."""


@dataclass(frozen=True)
class Jump:
    """A camera whose time jumps against the others' within a clip."""

    frames: int
    """Positive: so many frames are lost; negative: repeated or added."""


def find_jumps(codes: PairCodes, steps: int, whole: Synchrony) -> dict[int, Jump]:
    """By camera the difference of its offsets in the two halves of a clip, where both are certain."""
    half = steps // 2
    if half < FEWEST_STEPS:
        return {}
    largest = LARGEST + int(abs(whole.offsets).max())
    early, late = (
        synchrony(whole.names, {pair: (a[part], b[part]) for pair, (a, b) in codes.items()}, half, largest)
        for part in (slice(0, half), slice(half, steps))
    )
    sharp = np.sort([early.sharpness, late.sharpness], axis=0)
    sure = whole.sure & early.sure & late.sure & (sharp[0] > LEAST_SHARP) & (sharp[1] > SHARP)
    sure &= early.offsets != late.offsets
    return {int(k): Jump(int(early.offsets[k] - late.offsets[k])) for k in sure.nonzero()[0]}
