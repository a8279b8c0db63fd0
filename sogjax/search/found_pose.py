"""The poses of bodies in one frame without a hint, followed through later frames, and whether they can be relied on.

Hypotheses that explain one frame alike part as the motion goes on: a wrong one explains the later frames worse.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.energy.appearance import ColorWindows
from sogjax.energy.posed import Posed
from sogjax.model.body import Body
from sogjax.model.limbs import limb_blobs
from sogjax.search.placed_body import centres_of, means_of
from sogjax.search.pose_confidence import SURE, Agreement, PoseEvidence, agreed_confidence, pose_confidence
from sogjax.search.pose_search import (
    DIFFERENT,
    Hypotheses,
    Optimum,
    PlacedSearch,
    PoseSearch,
    Report,
    search,
    unreported,
)
from sogjax.search.search_energy import SearchEnergy
from sogjax.search.seen_frame import SeenFrame

FrameMaker = Callable[[PoseSearch, int], SeenFrame]
"""A frame as it is compared with one body: that which is searched (0) and those that come next."""


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

    def with_agreement(self, agreement: Agreement) -> "FoundPose":
        """This pose, as likely right as the search or the agreement says, whichever says more."""
        likely = max(self.confidence, agreed_confidence(agreement))
        return replace(self, confidence=likely, sure=likely >= SURE, agreement=agreement)


@dataclass(frozen=True)
class Path:
    """What was found in the frame that was searched, and the poses there and in those that come next."""

    found: FoundPose
    poses: Float[np.ndarray, "frame dof"]


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


def search_pose(searcher: PoseSearch, frames: Sequence[SeenFrame], report: Report = unreported) -> Path:
    """The pose of a body in the first of some frames, which explains the later ones too."""
    optima = search(searcher, frames[0], report=lambda share: report(0.8 * share))  # the rest is following them
    if not optima:
        rest = np.asarray(searcher.body.poses["rest"])
        return Path(FoundPose(rest, 0.0, 0.0, False, 0.0), np.repeat(rest[None], len(frames), axis=0))
    paths = followed(searcher, optima, frames)
    best = int(np.argmax(paths.energies[0]))
    seen = cell_evidence(searcher, frames[0], paths.poses[0, best])
    evidence = _evidence(searcher.body, paths, best, seen, float(frames[0].known))
    likely = pose_confidence(evidence)
    found = FoundPose(paths.poses[0, best], evidence.energy, evidence.margin, likely >= SURE, likely, evidence)
    return Path(found, paths.poses[:, best])


@dataclass(frozen=True)
class Followed:
    """Hypotheses through some frames."""

    poses: Float[np.ndarray, "frame hypothesis dof"]
    energies: Float[np.ndarray, "frame hypothesis"]


def followed(searcher: PoseSearch, optima: Sequence[Optimum], frames: Iterable[SeenFrame]) -> Followed:
    """Hypotheses climbed in the frame that they were found in, and from there in those that come after it."""
    poses, energies = [np.stack([optimum.pose for optimum in optima])], []
    for frame in frames:
        expected = poses[-1] if len(poses) < 3 else 2.0 * poses[-1] - poses[-2]
        climbed = _climbed(searcher, frame, expected.astype(poses[0].dtype))
        poses.append(climbed.poses)
        energies.append(climbed.values)
    return Followed(np.stack(poses[1:]), np.stack(energies))


ITERATIONS = 8
"""Steps by which a hypothesis is climbed in each frame that it is followed into."""
SAME_WINDOW = 0.5
"""Metres between the middles of hypotheses that are looked at in the same windows, so that they can be compared."""


def _climbed(searcher: PoseSearch, frame: SeenFrame, poses: Float[np.ndarray, "hypothesis dof"]) -> Hypotheses:
    """The hypotheses climbed, those near each other in the same windows."""
    centres = centres_of(searcher.body, poses)
    first = [int(np.argmax(np.linalg.norm(centres - centre, axis=1) < SAME_WINDOW)) for centre in centres]
    places, where = np.unique(first, return_inverse=True)
    middles = np.stack([centres[np.array(first) == place].mean(axis=0) for place in places])
    placed = PlacedSearch.of_places(searcher, frame, middles)
    return placed.climbed(Hypotheses(poses, where, np.zeros(len(poses))), ITERATIONS)


class CellEvidence(eqx.Module):
    """What the cells around a body say for its pose, in each camera and of each limb."""

    foreground: Float[Array, "camera"]
    """Part of what looks like foreground, by log odds, that the body covers."""
    background: Float[Array, "camera"]
    """What the body covers that looks like background, as a part of what it covers."""
    gain: Float[Array, "camera"]
    """Mean log likelihood gained where the body covers."""
    limbs: Float[Array, "limb"]
    """What is lost without a limb, for its size, as a part of what the whole body gains for its own."""


def cell_evidence(searcher: PoseSearch, frame: SeenFrame, pose: Float[np.ndarray, "dof"]) -> CellEvidence:
    """What the cells of a frame say for a pose."""
    placed = PlacedSearch.of_places(searcher, frame, centres_of(searcher.body, pose[None]))
    return _cell_evidence(placed.energy, placed.windows, jnp.asarray(limb_blobs(searcher.body)), jnp.asarray(pose))


CERTAIN = 0.1
"""Log odds below minus which a cell counts as background."""


@eqx.filter_jit
def _cell_evidence(
    energy: SearchEnergy, windows: ColorWindows, limbs: Bool[Array, "limb blob"], pose: Array
) -> CellEvidence:
    here = jax.tree.map(lambda leaf: leaf[0], windows)
    objective, appearance = energy.of_windows(here), energy.appearance(here)
    posed = Posed.from_pose(energy.body, pose)
    cover, gain = appearance.covered(posed, objective.frame)

    def without(limb: Bool[Array, "blob"]) -> Float[Array, ""]:
        rest = eqx.tree_at(lambda p: p.blobs.mask, posed, posed.blobs.mask & ~limb)
        return appearance.value(rest, objective.frame)

    areas = energy.body.blob_sigmas**2
    value = appearance.value(posed, objective.frame)
    lost = value - jax.vmap(without)(limbs)
    sizes = jnp.sum(jnp.where(limbs, areas[None], 0.0), axis=1) / jnp.sum(areas)
    of_limb = lost / (jnp.maximum(jnp.abs(value), 1e-6) * sizes)
    best = jnp.max(here.odds, axis=1)
    wanted, unwanted = jnp.maximum(best, 0.0), (best < -CERTAIN).astype(cover.dtype)
    total = lambda values: jnp.sum(values, axis=(1, 2))
    whole = total(cover) + 1e-6
    return CellEvidence(
        foreground=total(wanted * cover) / (total(wanted) + 1e-6),
        background=total(unwanted * cover) / whole,
        gain=total(gain) / whole,
        limbs=of_limb,
    )


def _evidence(body: Body, paths: Followed, best: int, seen: CellEvidence, known: float) -> PoseEvidence:
    """What tells of one of the hypotheses that were followed; `known` is the part of the background that is known."""
    means = means_of(body, paths.poses[0])
    apart = np.linalg.norm(means - means[best], axis=-1).mean(axis=-1)
    others = np.flatnonzero((apart >= DIFFERENT) & (np.arange(len(apart)) != best))

    def margin(energies: Float[np.ndarray, "hypothesis"]) -> float:
        behind = energies[best] - (energies[others].max() if len(others) else 0.0)
        return float(behind / max(abs(energies[best]), 1e-6))

    return PoseEvidence(
        energy=float(paths.energies[0, best]),
        margin=margin(paths.energies[0]),
        later_margin=margin(paths.energies.mean(axis=0)),
        foreground=float(np.mean(seen.foreground)),
        worst_foreground=float(np.min(seen.foreground)),
        not_background=1.0 - float(np.mean(seen.background)),
        gain=float(np.mean(seen.gain)),
        worst_limb=float(np.min(seen.limbs, initial=1.0)),
        known=known,
    )
