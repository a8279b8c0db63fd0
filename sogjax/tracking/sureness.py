"""Is a pose that was found right? What tells, and how likely it is, calibrated on rendered recordings."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sogjax.tracking.explained import Explained
from sogjax.tracking.following import Followed

SURE = 0.99
"""A pose of at least this confidence is called sure."""
DIFFERENT = 0.1
"""Metres, mean distance of the blobs: hypotheses nearer to each other are one."""
STEEPNESS = 4.6
"""A pose that just meets every condition has a confidence of 0.99."""


@dataclass(frozen=True)
class Condition:
    """A value that a pose must reach to be called sure: where the background is known, and where it is not."""

    name: str
    with_background: float
    without: float
    scale: float
    """By how much it must miss that to be no more likely right than wrong."""

    def shortfall(self, value: float, known: float) -> float:
        """How far the value is from what it must be, in units of the scale; negative where it is missed."""
        wanted = known * self.with_background + (1.0 - known) * self.without
        return (value - wanted) / self.scale


CONDITIONS = (
    Condition("energy", 1.4, 0.3, 0.1),
    Condition("margin", 0.006, 0.014, 0.01),
    Condition("later_margin", 0.006, 0.014, 0.01),
    Condition("foreground", 0.75, 0.45, 0.05),
    Condition("worst_foreground", 0.65, 0.28, 0.1),
    Condition("gain", 1.2, 0.28, 0.1),
    Condition("not_background", 0.825, 0.78, 0.05),
)
"""Found on searches in walks, exercises and cartwheels of rendered people: with a background 29 with 4 and 12 cameras,
without one 50 with 3 to 12. None of those that meet all conditions is wrong; that is too few for a promise."""


@dataclass(frozen=True)
class Agreement:
    """How a pose that was followed to another frame compares with what a search finds there."""

    apart: float
    """Metres, mean distance of the blobs."""
    moved: float
    """Metres, the same from one frame to the other: of somebody who stands still both searches see the same."""
    sides: float
    """How far the limbs of a pair are from each other, as `sides_apart` has it, the least of both frames."""
    worst_limb: float
    """As in `Evidence`, the least of both frames."""
    num_actors: int = 1
    """That were searched for together."""


MOST_APART, APART_SCALE = 0.05, 0.03
"""Metres: two searches that agree so well are right, and by how much more they are no more likely right than wrong."""
MOST_APART_AMONG_OTHERS = 0.03
"""The same where several actors are searched for: one of them taken for the other is seen in both frames, too."""
LEAST_MOVED, MOVED_SCALE = 0.03, 0.03
"""Metres: who moves less gives two searches the same reasons to be wrong."""
LEAST_SIDES, SIDES_SCALE = 0.8, 0.2
"""Limbs of a pair that cross are as near to each other as they never are in a pose with a name: they are exchanged."""
LEAST_LIMB, LIMB_SCALE = 0.0, 0.2
"""A limb that explains less than nothing is elsewhere."""


@dataclass(frozen=True)
class Evidence:
    """What tells whether a pose is right; energies are in units of the body's own area in the pictures."""

    energy: float
    """In the frame that was searched."""
    margin: float
    """How far the next different hypothesis is behind there, as a part of the energy."""
    later_margin: float
    """The same for the means over the frames that follow: where it is negative, the motion speaks for another."""
    foreground: float
    """Part of what looks like foreground that the body covers, mean over the cameras."""
    worst_foreground: float
    """The same of the camera in which it is least."""
    not_background: float
    """Part of what the body covers that does not look like background, mean over the cameras."""
    gain: float
    """Log likelihood gained per covered cell, mean over the cameras."""
    worst_limb: float
    """What the limb explains that explains least, for its size, as a part of what the body does."""
    known: float
    """Part of the pictures whose background is known."""

    @classmethod
    def of(cls, paths: Followed, best: int, seen: Explained, known: float) -> "Evidence":
        """Of one of the hypotheses that were followed."""
        others = [k for k in range(paths.energies.shape[1]) if k != best and paths.apart[0, best, k] >= DIFFERENT]
        return cls(
            energy=float(paths.energies[0, best]),
            margin=_margin(paths.energies[0], best, others),
            later_margin=_margin(paths.energies.mean(axis=0), best, others),
            foreground=float(np.mean(seen.foreground)),
            worst_foreground=float(np.min(seen.foreground)),
            not_background=1.0 - float(np.mean(seen.background)),
            gain=float(np.mean(seen.gain)),
            worst_limb=float(np.min(seen.limbs, initial=1.0)),
            known=known,
        )


def confidence(evidence: Evidence) -> float:
    """How likely the pose is right, from one search, as the condition has it that is met least."""
    return _likely(each.shortfall(getattr(evidence, each.name), evidence.known) for each in CONDITIONS)


def agreed_confidence(agreement: Agreement) -> float:
    """The same from two searches in frames some time apart."""
    conditions = (
        ((MOST_APART if agreement.num_actors == 1 else MOST_APART_AMONG_OTHERS) - agreement.apart) / APART_SCALE,
        (agreement.moved - LEAST_MOVED) / MOVED_SCALE,
        (agreement.sides - LEAST_SIDES) / SIDES_SCALE,
        (agreement.worst_limb - LEAST_LIMB) / LIMB_SCALE,
    )
    return _likely(conditions)


def _likely(shortfalls: Iterable[float]) -> float:
    return float(1.0 / (1.0 + np.exp(-STEEPNESS * (1.0 + min(*shortfalls, 10.0)))))


def _margin(energies: Float[np.ndarray, "hypothesis"], best: int, others: list[int]) -> float:
    behind = min((energies[best] - energies[k] for k in others), default=energies[best])
    return float(behind / max(abs(energies[best]), 1e-6))
