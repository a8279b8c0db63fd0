"""The pose of a body that a search found, the poses that come after it, and how likely each part of it is right.

Hypotheses that explain one frame alike part as the motion goes on: a wrong one explains the later frames worse.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.model.body import Body
from sogjax.model.limbs import limb_blobs, limb_names
from sogjax.search.cell_evidence import CellEvidence
from sogjax.search.combination import trunk_blobs
from sogjax.search.mirrored import sides_apart
from sogjax.search.placed_body import means_of, uprightness
from sogjax.search.pose_confidence import (
    SURE,
    Agreement,
    PoseEvidence,
    agreed_confidence,
    limb_confidence,
    pose_confidence,
)
from sogjax.search.pose_search import DIFFERENT

TRUNK = "trunk"
"""What is called so besides the limbs."""
LEAST_SEEN = 0.25
"""Part of a body that others leave visible: less is counted as this, so that a remnant is no evidence of a whole."""


@dataclass(frozen=True)
class FoundPose:
    """The best pose of a search and how far the next different one is behind."""

    pose: Float[np.ndarray | Array, "dof"]
    energy: float
    """Log likelihood gained, in units of the body's area; 0 and less: nothing like it is seen."""
    margin: float
    """(energy - energy of the next different hypothesis) / energy; 1 where there is no other."""
    sure: bool
    """Whether the pose can be relied on: of those that can, 99 of 100 are right to 10 cm."""
    confidence: float
    """How likely the pose is right, 0 to 1."""
    evidence: PoseEvidence | None = None
    """What that follows from."""
    agreement: Agreement | None = None
    """How it agrees with a search in another frame, if there was one."""
    parts: Mapping[str, float] = field(default_factory=dict)
    """How likely the trunk and each limb are right, 0 to 1, by name."""
    share: float = 1.0
    """What is left of the energy beside the other actors, as a part of the most that is found where they are not."""
    upright: float = 1.0
    """The cosine of the angle between the world's vertical and the body's: -1 upside down."""

    @property
    def trunk(self) -> float:
        """How likely the trunk is right, and who it is, and its left and right: a limb is searched for again later."""
        return self.parts.get(TRUNK, self.confidence)

    @property
    def trunk_sure(self) -> bool:
        """Whether tracking can begin with it."""
        return self.trunk >= SURE

    @property
    def unsure_limbs(self) -> list[str]:
        """The limbs that cannot be relied on."""
        return [name for name, likely in self.parts.items() if name != TRUNK and likely < SURE]

    def with_agreements(self, whole: Agreement, parts: Mapping[str, Agreement]) -> "FoundPose":
        """This pose, each part as likely right as the search or the agreement says, whichever says more."""
        likely = max(self.confidence, agreed_confidence(whole))
        of_parts = {
            name: max(self.parts.get(name, 0.0), likely, agreed_confidence(agreement))
            for name, agreement in parts.items()
        }
        return replace(self, confidence=likely, sure=likely >= SURE, agreement=whole, parts=of_parts)


@dataclass(frozen=True)
class Path:
    """What was found in the frame that was searched, and the poses there and in those that come next."""

    found: FoundPose
    poses: Float[np.ndarray, "frame dof"]

    @classmethod
    def of_nothing(cls, body: Body, num_frames: int) -> "Path":
        """Where nothing looks like the body."""
        rest = np.asarray(body.poses["rest"])
        return cls(FoundPose(rest, 0.0, 0.0, False, 0.0), np.repeat(rest[None], num_frames, axis=0))


@dataclass(frozen=True)
class Followed:
    """Hypotheses through some frames."""

    poses: Float[np.ndarray, "frame hypothesis dof"]
    energies: Float[np.ndarray, "frame hypothesis"]


def judged(body: Body, paths: Followed, best: int, seen: CellEvidence, exchange: float, share: float, up: str) -> Path:
    """One of the hypotheses that were followed, with how likely it and its parts are right.

    `exchange` is how far it is behind that this is another actor, `share` what others leave of the energy, and `up` the
    world's vertical.
    """
    means = means_of(body, paths.poses[0])
    apart = np.linalg.norm(means - means[best], axis=-1)

    def evidence(blobs: Bool[np.ndarray, "blob"]) -> PoseEvidence:
        others = apart[:, blobs].mean(axis=1) >= DIFFERENT
        behind = lambda energies: min(_margin(energies, best, others), exchange)
        margin, later = behind(paths.energies[0]), behind(paths.energies.mean(axis=0))
        return _evidence(seen, float(paths.energies[0, best]), margin, later, share)

    whole = evidence(np.ones(body.num_blobs, bool))
    likely = pose_confidence(whole)
    parts = {TRUNK: pose_confidence(evidence(trunk_blobs(body)))}
    limbs = zip(limb_names(body), limb_blobs(body), np.asarray(seen.limbs), strict=True)
    parts |= {name: limb_confidence(evidence(blobs), float(explained)) for name, blobs, explained in limbs}
    parts = {name: max(part, likely) for name, part in parts.items()}
    energy = float(paths.energies[0, best])
    pose = paths.poses[0, best]
    upright = float(uprightness(body, pose[None], up)[0])
    found = FoundPose(
        pose, energy, whole.margin, likely >= SURE, likely, whole, parts=parts, share=share, upright=upright
    )
    return Path(found, paths.poses[:, best])


def _margin(energies: Float[np.ndarray, "hypothesis"], best: int, others: Bool[np.ndarray, "hypothesis"]) -> float:
    others = others & (np.arange(len(energies)) != best)
    behind = energies[best] - (energies[others].max() if others.any() else 0.0)
    return float(behind / max(abs(energies[best]), 1e-6))


def _evidence(seen: CellEvidence, energy: float, margin: float, later_margin: float, share: float) -> PoseEvidence:
    visible = max(float(np.mean(seen.visible)), LEAST_SEEN)
    shown = np.isfinite(np.asarray(seen.foreground))
    mean = lambda values: float(np.mean(np.asarray(values)[shown])) if shown.any() else 0.0
    return PoseEvidence(
        energy=energy / visible,
        margin=margin,
        later_margin=later_margin,
        foreground=mean(seen.foreground),
        worst_foreground=float(np.min(np.asarray(seen.foreground)[shown], initial=1.0)) if shown.any() else 0.0,
        not_background=1.0 - mean(seen.background),
        gain=mean(seen.gain),
        worst_limb=float(np.min(seen.limbs, initial=1.0)),
        known=float(seen.known),
        share=share,
    )


def agreements(body: Body, first: Path, second: FoundPose, num_actors: int) -> tuple[Agreement, dict[str, Agreement]]:
    """How a pose that was followed to the last of its frames compares with what a search finds there, and each part."""
    poses = np.stack([np.asarray(pose) for pose in (first.found.pose, first.poses[-1], second.pose)]).astype(np.float32)
    before, after, found = means_of(body, poses)
    apart, moved = np.linalg.norm(after - found, axis=-1), float(np.linalg.norm(before - after, axis=-1).mean())
    sides = float(sides_apart(body, poses).min())
    share = min(first.found.share, second.share)
    least = [-np.inf if pose.evidence is None else pose.evidence.worst_limb for pose in (first.found, second)]

    def over(blobs: Bool[np.ndarray, "blob"], worst_limb: float) -> Agreement:
        return Agreement(float(apart[blobs].mean()), moved, sides, worst_limb, share, num_actors)

    of_limbs = zip(limb_names(body), limb_blobs(body), strict=True)
    # A limb elsewhere makes no trunk unsure; where both searches have it in one place, it is there.
    parts = {TRUNK: over(trunk_blobs(body), np.inf)} | {name: over(blobs, min(least)) for name, blobs in of_limbs}
    return over(np.ones(body.num_blobs, bool), min(least)), parts
