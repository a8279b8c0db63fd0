"""Following different hypotheses for a while: a wrong one pays as the motion goes on.

How much of what is seen a pose explains, in absolute terms.

Is a pose that was found right? What tells, and how likely it is, calibrated on rendered recordings.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.energy.appearance import ColorWindows
from sogjax.energy.posed import Posed
from sogjax.model.limbs import limb_blobs
from sogjax.quality.fitted import Bound, fitted_numbers
from sogjax.search.mirrored import means_of
from sogjax.search.pose_search import DIFFERENT, Hypotheses, Optimum, PlacedSearch, PoseSearch, centres_of
from sogjax.search.search_energy import SearchEnergy
from sogjax.search.seen_frame import SeenFrame

ITERATIONS = 8
SAME_WINDOW = 0.5
"""Metres between the middles of hypotheses that are looked at in the same windows, so that they can be compared."""


@dataclass(frozen=True)
class Followed:
    """Hypotheses through some frames."""

    poses: Float[np.ndarray, "frame hypothesis dof"]
    energies: Float[np.ndarray, "frame hypothesis"]
    means: Float[np.ndarray, "frame hypothesis blob 3"]
    """Of the blobs (metres, world)."""

    @property
    def apart(self) -> Float[np.ndarray, "frame hypothesis hypothesis"]:
        """Mean distance of the blobs of two hypotheses, in each frame (metres)."""
        return np.linalg.norm(self.means[:, :, None] - self.means[:, None], axis=-1).mean(axis=-1)


def followed(searcher: PoseSearch, optima: Sequence[Optimum], frames: Iterable[SeenFrame]) -> Followed:
    """Hypotheses climbed in the frame that they were found in, and from there in those that come after it."""
    poses, energies = [np.stack([optimum.pose for optimum in optima])], []
    for frame in frames:
        expected = poses[-1] if len(poses) < 3 else 2.0 * poses[-1] - poses[-2]
        climbed = _climbed(searcher, frame, expected.astype(poses[0].dtype))
        poses.append(climbed.poses)
        energies.append(climbed.values)
    everything = np.stack(poses[1:])
    means = means_of(searcher.body, everything.reshape(-1, everything.shape[-1]))
    return Followed(everything, np.stack(energies), means.reshape(*everything.shape[:2], -1, 3))


def _climbed(searcher: PoseSearch, frame: SeenFrame, poses: Float[np.ndarray, "hypothesis dof"]) -> Hypotheses:
    """The hypotheses climbed, those near each other in the same windows."""
    centres = centres_of(searcher.body, poses)
    first = [int(np.argmax(np.linalg.norm(centres - centre, axis=1) < SAME_WINDOW)) for centre in centres]
    places, where = np.unique(first, return_inverse=True)
    middles = np.stack([centres[np.array(first) == place].mean(axis=0) for place in places])
    hunt = PlacedSearch.of_places(searcher, frame, middles)
    return hunt.climbed(Hypotheses(poses, where, np.zeros(len(poses))), ITERATIONS)


CLEARLY = 0.1
"""Log odds below which a cell counts as background."""


class Explained(eqx.Module):
    """Of each camera, areas in windows around a body."""

    foreground: Float[Array, "camera"]
    """Part of what looks like foreground, by log odds, that the body covers."""
    background: Float[Array, "camera"]
    """What the body covers that looks like background, as a part of what it covers."""
    gain: Float[Array, "camera"]
    """Mean log likelihood gained where the body covers."""
    limbs: Float[Array, "limb"]
    """What is lost without a limb, for its size, as a part of what the whole body gains for its own."""


def explained(searcher: PoseSearch, frame: SeenFrame, pose: Float[np.ndarray, "dof"]) -> Explained:
    """What a pose explains of a frame."""
    hunt = PlacedSearch.of_places(searcher, frame, centres_of(searcher.body, pose[None]))
    return _explained(hunt.energy, hunt.windows, jnp.asarray(limb_blobs(searcher.body)), jnp.asarray(pose))


@eqx.filter_jit
def _explained(energy: SearchEnergy, windows: ColorWindows, limbs: Bool[Array, "limb blob"], pose: Array) -> Explained:
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
    wanted, unwanted = jnp.maximum(best, 0.0), (best < -CLEARLY).astype(cover.dtype)
    total = lambda values: jnp.sum(values, axis=(1, 2))
    whole = total(cover) + 1e-6
    return Explained(
        foreground=total(wanted * cover) / (total(wanted) + 1e-6),
        background=total(unwanted * cover) / whole,
        gain=total(gain) / whole,
        limbs=of_limb,
    )


SURE = 0.99
"""A pose of at least this confidence is called sure."""
STEEPNESS = 4.6
"""A pose that just meets every condition has a confidence of 0.99."""


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


def pose_confidence(evidence: Evidence) -> float:
    """How likely the pose is right, from one search: as the measure says that falls behind its bound most."""
    bounds = fitted_numbers().pose_evidence

    def excess(name: str) -> float:
        bound: Bound = getattr(bounds, name)
        least = evidence.known * bound.with_background + (1.0 - evidence.known) * bound.without_background
        return (getattr(evidence, name) - least) / bound.scale

    return _likely([excess(bound.name) for bound in fields(bounds)])


def agreed_confidence(agreement: Agreement) -> float:
    """How likely a pose is right, from two searches in frames some time apart."""
    bounds = fitted_numbers().pose_agreement
    most_apart = bounds.most_apart if agreement.num_actors == 1 else bounds.most_apart_among_others
    excesses = (
        (most_apart - agreement.apart) / bounds.apart_scale,
        (agreement.moved - bounds.least_moved) / bounds.moved_scale,
        (agreement.sides - bounds.least_sides) / bounds.sides_scale,
        (agreement.worst_limb - bounds.least_limb) / bounds.limb_scale,
    )
    return _likely(excesses)


def _likely(excesses: Iterable[float]) -> float:
    return float(1.0 / (1.0 + np.exp(-STEEPNESS * (1.0 + min(*excesses, 10.0)))))


def _margin(energies: Float[np.ndarray, "hypothesis"], best: int, others: list[int]) -> float:
    behind = min((energies[best] - energies[k] for k in others), default=energies[best])
    return float(behind / max(abs(energies[best]), 1e-6))
