"""How likely a limb is far from where a pose puts it, calibrated on rendered recordings.

How well a body lies on what is seen of it in a frame, in absolute terms: what a verdict on a run follows from.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.special import expit, logit

from sogjax.energy.foreground import cover
from sogjax.energy.posed import Posed
from sogjax.energy.views import Windows
from sogjax.model.camera import Camera, project
from sogjax.quality.fitted import Weights, fitted_numbers
from sogjax.quality.limb_evidence import CLEARLY, DENSITY, BlobEvidence, LimbBlobs

FAR = 0.1
"""Metres, mean over the limb's joints: farther off is lost."""


class LimbMeasures(NamedTuple):
    """What tells whether a limb is lost: means of the third of its blobs that fits worst."""

    worse: Float[Array, "*frame limb"]
    contradicted: Float[Array, "*frame limb"]


class LimbConfidence(eqx.Module):
    """What is thought of the bodies and their limbs in one frame."""

    error_probability: Float[Array, "limb"]
    """How likely each is more than `FAR` off."""
    baseline: Float[Array, "2 blob"]
    """What `own` and `contradicted` of `BlobEvidence` usually are, for the next frame; a limb in doubt keeps what
    it had."""
    explained: Float[Array, "actor"] | None = None
    """As `FrameFit` has it; None: not measured."""
    overlap: Float[Array, "actor camera"] | None = None
    hidden: Float[Array, "limb"] | None = None
    """Part of each that things in front hide from the cameras that would see it: the mean of the third of its blobs
    of which most is hidden; None: nothing is in front."""


def limb_confidence(
    limbs: LimbBlobs, evidence: BlobEvidence, baseline: Float[Array, "2 blob"], has_background: bool
) -> LimbConfidence:
    """The confidence of limbs, from the evidence for their blobs and what was usual before (NaN in the first frame)."""
    measures = limb_measures(limbs, evidence, baseline)
    numbers, weights = fitted_numbers().limb_baseline, fitted_numbers().limb_weights
    probability = error_probability(measures, weights.with_background if has_background else weights.without_background)
    trust = 1.0 - jnp.max(jnp.where(limbs.members, probability[:, None], 0.0), axis=0, initial=0.0)
    rate = numbers.adaptation * trust * _certainty(evidence)
    seen, known = _seen(evidence), _known(evidence, baseline)
    largest = jnp.asarray(numbers.largest_steps, known.dtype)[:, None]
    hidden = None if evidence.hidden is None else -limbs.mean_of_worst(-evidence.hidden)
    return LimbConfidence(probability, known + rate[None] * jnp.clip(seen - known, -largest, largest), hidden=hidden)


def limb_measures(limbs: LimbBlobs, evidence: BlobEvidence, baseline: Float[Array, "2 blob"]) -> LimbMeasures:
    """The measures of limbs in one frame."""
    numbers = fitted_numbers().limb_baseline
    certainty, (own, contradicted) = _certainty(evidence), _known(evidence, baseline)
    more = evidence.contradicted - jnp.minimum(contradicted, numbers.most_contradicted)
    return LimbMeasures(
        worse=-limbs.mean_of_worst(certainty * (evidence.own - jnp.maximum(own, numbers.least_own))),
        contradicted=-limbs.mean_of_worst(-certainty * more),
    )


def error_probability(measures: LimbMeasures, weights: Weights) -> Float[Array, "*frame limb"]:
    """How likely limbs are more than `FAR` off."""
    return jax.nn.sigmoid(
        weights.constant + weights.worse * measures.worse + weights.contradicted * measures.contradicted
    )


SURE = 1e-3
"""Probabilities so near to 0 or 1 are not told from these."""
LEAST_RIVAL, MOST_RIVAL = -0.005, 0.003
"""What a rival gains, as a part of an actor's energy, from which on it tells, and beyond which it tells no more."""


def beside_rivals(
    unlike: Float[np.ndarray, "*frame limb"], rival: Float[np.ndarray, "*frame limb"], weight: float | None = None
) -> Float[np.ndarray, "*frame limb"]:
    """How likely limbs are lost, by what is seen of them and by what rivals gain, of which none reassures.

    Args:
        unlike: how likely they are by what is seen alone (`error_probability`).
        rival: what the best other way to hold a limb gains, as a part of an actor's energy; NaN: none was searched.
        weight: of each per cent of the energy, on the log odds; None: the fitted one.
    """
    weight = fitted_numbers().rivals.weight if weight is None else weight
    gain = np.nan_to_num(np.clip(rival, LEAST_RIVAL, MOST_RIVAL) - LEAST_RIVAL)
    doubt = expit(logit(np.clip(unlike, SURE, 1.0 - SURE)) + 100.0 * weight * gain)
    return np.where(gain > 0.0, doubt, unlike)


def _seen(evidence: BlobEvidence) -> Float[Array, "2 blob"]:
    return jnp.stack([evidence.own, evidence.contradicted])


def _known(evidence: BlobEvidence, baseline: Float[Array, "2 blob"]) -> Float[Array, "2 blob"]:
    """What is usual; what is seen where nothing is known yet."""
    return jnp.where(jnp.isfinite(baseline), baseline, _seen(evidence))


def _certainty(evidence: BlobEvidence) -> Float[Array, "blob"]:
    return evidence.seen / (evidence.seen + fitted_numbers().limb_baseline.unseen)


LEAST_TOLD = 0.5
"""Part of an actor's silhouette that must be either for a camera to be compared."""


class FrameFit(eqx.Module):
    """How well each actor fits a frame."""

    explained: Float[Array, "actor"]
    """Part of its visible area that shows its blobs' own colours, and no background where that is known."""
    overlap: Float[Array, "actor camera"]
    """Intersection over union of its silhouette and the foreground around it; NaN where too little of the background
    is known."""


def frame_fit(
    limbs: LimbBlobs, evidence: BlobEvidence, posed: Posed, cameras: Camera, windows: Windows | None
) -> FrameFit:
    """How well posed bodies fit a frame, from the evidence for their blobs and the foreground around each actor."""
    actors = np.array(limbs.actor_of_blob, int)
    own = jnp.asarray(actors[None, :] == np.arange(actors.max() + 1)[:, None], posed.blobs.sigmas.dtype)
    areas = own * (evidence.seen * posed.blobs.sigmas**2)[None, :]
    explained = jnp.sum(areas * evidence.explained[None, :], axis=1) / (jnp.sum(areas, axis=1) + 1e-9)
    if windows is None:
        return FrameFit(explained, jnp.full((len(own), cameras.image_size.shape[0]), jnp.nan, explained.dtype))
    seen = jax.vmap(project, in_axes=(0, None))(cameras, posed.blobs)
    covered = jax.vmap(cover, in_axes=(0, 0, None))(windows, seen, jnp.asarray(DENSITY, explained.dtype))
    shown, empty = ((odds > CLEARLY).astype(explained.dtype) for odds in (windows.odds, -windows.odds))
    total = lambda values: jnp.sum(values, axis=(2, 3))
    both, either = total(covered * shown), total(shown) + total(covered * empty)
    told = both + total(covered * empty) > LEAST_TOLD * total(covered)
    return FrameFit(explained, jnp.where(told & (either > 0.0), both / jnp.maximum(either, 1e-6), jnp.nan).T)
