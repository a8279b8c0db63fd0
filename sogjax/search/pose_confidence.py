"""How likely a pose that was found is right: what tells, and the confidence that follows (`quality/fitted.yaml`)."""

from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np

from sogjax.quality.fitted import Bound, fitted_numbers

SURE = 0.99
"""A pose of at least this confidence is called sure."""


@dataclass(frozen=True)
class PoseEvidence:
    """What tells from one search whether a pose is right; energies are in units of the body's area in the pictures."""

    energy: float
    """The energy in the frame that was searched, for the part of the body that no other actor hides."""
    margin: float
    """How far the next different hypothesis is behind there, as a part of the energy."""
    later_margin: float
    """The margin of the means over the frames that follow; where it is negative, the motion speaks for another pose."""
    foreground: float
    """Part of what looks like foreground that the actors cover, mean over the cameras."""
    worst_foreground: float
    """Part of what looks like foreground that the actors cover, in the camera in which it is least."""
    not_background: float
    """Part of what the body covers that does not look like background, mean over the cameras."""
    gain: float
    """Log likelihood gained per covered cell, mean over the cameras."""
    worst_limb: float
    """What the limb explains that explains least, for its size, as a part of what the body does."""
    known: float
    """Part of what the body covers whose background is known."""
    share: float = 1.0
    """What is left of the energy beside the other actors, as a part of the most that is found where they are not."""


@dataclass(frozen=True)
class Agreement:
    """How a pose that was followed to another frame compares with what a search finds there."""

    apart: float
    """Metres between the two poses there, mean over the blobs."""
    moved: float
    """Metres from one frame to the other, mean over the blobs: who stands still is seen alike by both searches."""
    sides: float
    """How far the limbs of a pair are from each other, as `sides_apart` has it, the least of both frames."""
    worst_limb: float
    """As in `PoseEvidence`, the least of both frames."""
    share: float = 1.0
    """As in `PoseEvidence`, the least of both frames."""
    num_actors: int = 1
    """How many were searched for together."""


def pose_confidence(evidence: PoseEvidence) -> float:
    """How likely the pose is right, from one search: as the measure says that falls behind its bound most."""
    bounds = fitted_numbers().pose_evidence

    def excess(name: str) -> float:
        bound: Bound = getattr(bounds, name)
        least = evidence.known * bound.with_background + (1.0 - evidence.known) * bound.without_background
        return (getattr(evidence, name) - least) / bound.scale

    return _likely([excess(bound.name) for bound in fields(bounds)])


def limb_confidence(evidence: PoseEvidence, explained: float) -> float:
    """How likely a limb is right, from one search: what the body says, and what the limb explains for its size."""
    bounds = fitted_numbers().pose_agreement
    return min(pose_confidence(evidence), _likely([(explained - bounds.least_limb) / bounds.limb_scale]))


def agreed_confidence(agreement: Agreement) -> float:
    """How likely a pose is right, from two searches in frames some time apart."""
    bounds = fitted_numbers().pose_agreement
    most_apart = bounds.most_apart if agreement.num_actors == 1 else bounds.most_apart_among_others
    excesses = (
        (most_apart - agreement.apart) / bounds.apart_scale,
        (agreement.moved - bounds.least_moved) / bounds.moved_scale,
        (agreement.sides - bounds.least_sides) / bounds.sides_scale,
        (agreement.worst_limb - bounds.least_limb) / bounds.limb_scale,
        (agreement.share - bounds.least_share) / bounds.share_scale,
    )
    return _likely(excesses)


def _likely(excesses: Iterable[float]) -> float:
    """0.99 where the least excess is 0, so that every bound is just met; a half where one is missed by its scale."""
    return float(1.0 / (1.0 + np.exp(-4.6 * (1.0 + np.clip(min(excesses), -10.0, 10.0)))))
