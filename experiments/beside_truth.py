"""How far a motion is from its truth, as a verdict on it should say: which limbs are lost, and how often a joint is."""

from dataclasses import dataclass, field

import numpy as np

from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import Motion
from sogjax.quality.markers import joint_errors
from sogjax.quality.metrics import mean_per_frame, stretches
from sogjax.study.true_poses import limb_of

FAR = 0.1
"""Metres from the truth, beyond which a limb is lost."""
FOR = 3
"""Frames: a limb that is far off for fewer is not lost."""
ASTRAY, OFTEN = 0.15, 0.01
"""Metres from the truth, beyond which a single joint is astray, and the part of the frames in which one may be."""


@dataclass(frozen=True)
class BesideTruth:
    """How far the motion of one actor is off."""

    mean: float
    """Error of all joints (metres)."""
    lost: dict[str, int] = field(default_factory=dict)
    """Frames in which a limb is far off, by limb, of the stretches that last."""
    astray: float = 0.0
    """Part of the frames in which some joint is astray."""


def beside_truth(motion: Motion, truth: GroundTruth) -> BesideTruth | None:
    """The motion of a subject held against its truth; None: they have no joints in common."""
    found = joint_errors(motion, truth)
    if found is None:
        return None
    limbs = np.array([limb_of(name) for name in found.names])
    far = {str(limb): np.nan_to_num(mean_per_frame(found.errors[:, limbs == limb])) > FAR for limb in np.unique(limbs)}
    lost = {limb: sum(stop - first for first, stop in stretches(off, FOR)) for limb, off in far.items()}
    known = found.errors[np.isfinite(found.errors).any(axis=1)]
    astray = float(np.mean(np.nanmax(known, axis=1) > ASTRAY)) if len(known) else 0.0
    return BesideTruth(float(np.nanmean(found.errors)), {limb: count for limb, count in lost.items() if count}, astray)
