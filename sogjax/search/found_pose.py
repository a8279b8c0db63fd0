"""The poses of bodies in one frame without a hint, and whether they can be relied on."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Array, Float

from sogjax.model.body import Body
from sogjax.search.pose_confidence import (
    SURE,
    Agreement,
    Evidence,
    agreed_confidence,
    explained,
    followed,
    pose_confidence,
)
from sogjax.search.pose_search import PoseSearch, Report, search, unreported
from sogjax.search.seen_frame import SeenFrame

FrameMaker = Callable[[PoseSearch, int], SeenFrame]
"""A frame as it is compared with one body: that which is searched (0) and those that come next."""


SEARCHED = 0.8
"""Share of the time that the search in the first frame takes; the rest follows what was found."""


@dataclass(frozen=True)
class FoundPose:
    """The best pose of a search and how far the next different one is behind."""

    pose: Float[np.ndarray | Array, "dof"]
    energy: float
    """Log likelihood gained, in units of the body's area; 0 and less: nothing like it is seen."""
    margin: float
    """(energy - energy of the next different hypothesis) / energy; 1 where there is no other."""
    sure: bool
    """Of the poses that say so, 99 of 100 are right to 10 cm (calibrated on rendered recordings)."""
    confidence: float
    """How likely the pose is right, 0 to 1."""
    evidence: Evidence | None = None
    """What that follows from."""
    agreement: Agreement | None = None
    """With a search in another frame, if there was one."""

    def with_agreement(self, agreement: Agreement) -> "FoundPose":
        """The same pose, as likely right as the search or the agreement says, whichever says more."""
        likely = max(self.confidence, agreed_confidence(agreement))
        return replace(self, confidence=likely, sure=likely >= SURE, agreement=agreement)


@dataclass(frozen=True)
class Path:
    """What was found in the frame that was searched, and in those that come next."""

    found: FoundPose
    poses: Float[np.ndarray, "frame dof"]


def search_pose(searcher: PoseSearch, frames: Sequence[SeenFrame], report: Report = unreported) -> Path:
    """The pose of a body in the first of some frames, which explains the later ones too."""
    optima = search(searcher, frames[0], report=lambda share: report(SEARCHED * share))
    if not optima:
        rest = np.asarray(searcher.body.poses["rest"])
        return Path(FoundPose(rest, 0.0, 0.0, False, 0.0), np.repeat(rest[None], len(frames), axis=0))
    paths = followed(searcher, optima, frames)
    best = int(np.argmax(paths.energies[0]))
    seen = explained(searcher, frames[0], paths.poses[0, best])
    evidence = Evidence.of(paths, best, seen, float(frames[0].known))
    likely = pose_confidence(evidence)
    found = FoundPose(
        pose=paths.poses[0, best],
        energy=evidence.energy,
        margin=evidence.margin,
        sure=likely >= SURE,
        confidence=likely,
        evidence=evidence,
    )
    return Path(found, paths.poses[:, best])


def search_poses(
    bodies: Sequence[Body],
    searchers: Sequence[PoseSearch],
    make: FrameMaker,
    num_frames: int,
    report: Report = unreported,
) -> list[FoundPose]:
    """The poses of several bodies in one frame: the surest is found first, and what it covers is its own."""
    found: dict[int, Path] = {}
    count, total = 0, len(bodies) * (len(bodies) + 1) // 2
    while len(found) < len(bodies):
        candidates = {}
        for k in (k for k in range(len(bodies)) if k not in found):
            frames = [make(searchers[k], frame) for frame in range(num_frames)]
            for other, path in found.items():
                frames = [f.with_found(bodies[other], pose) for f, pose in zip(frames, path.poses, strict=True)]
            before = count / total
            candidates[k] = search_pose(
                searchers[k], frames, lambda share, before=before: report(before + share / total)
            )
            count += 1
        surest = max(candidates, key=lambda k: (candidates[k].found.confidence, candidates[k].found.margin))
        found[surest] = candidates[surest]
    return [found[k].found for k in range(len(bodies))]
