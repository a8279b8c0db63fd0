"""Limbs that are elsewhere from one frame to the next: nobody moves so, and they are wrong before or after."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float

from sogjax.io.motion import Motion
from sogjax.quality.metrics import stretches

FAR, FPS = 0.2, 25.0
"""Metres of a jump, and the frames a second from which on nobody does so: arms that throw or hit are within 0.15."""
NEAR = 0.6
"""Part of the `FAR` from which on a jump is worth a search."""


def largest_step(fps: float) -> float:
    """Metres that a blob may be off what the frames around it foretell; where these lie apart, more."""
    return FAR * max(FPS / fps, 1.0) ** 3


def steps(means: Float[np.ndarray, "frame *blob 3"]) -> Float[np.ndarray, "frame *blob"]:
    """How far each blob jumps behind each frame, in metres, beyond how it moves before and after.

    Where it goes on beside its old path that is how far beside; 0 where too few frames are around.
    """
    if len(means) < 4:
        return np.zeros(means.shape[:-1])
    bend = means[1:-1] - 0.5 * (means[2:] + means[:-2])
    return np.concatenate([np.zeros((1, *means.shape[1:-1])), np.linalg.norm(np.diff(bend, axis=0), axis=-1),
                           np.zeros((2, *means.shape[1:-1]))])  # fmt: skip


def limb_jumps(
    means: Float[np.ndarray, "frame blob 3"],
    limbs: Bool[np.ndarray, "limb blob"],
    of_blobs: Callable[..., np.ndarray] = np.max,
) -> Float[np.ndarray, "frame limb"]:
    """How far each limb jumps behind each frame, in metres: the blob that does so most, or `of_blobs`."""
    found = steps(means)
    return np.stack([of_blobs(found[:, blobs], axis=1) for blobs in limbs], axis=1)


def peaks(jumps: Float[np.ndarray, "frame"]) -> Bool[np.ndarray, "frame"]:
    """Which jumps are no smaller than those beside: a single one is seen, half as large, in the frames beside it."""
    padded = np.pad(jumps, 1)
    return (jumps >= padded[:-2]) & (jumps >= padded[2:])


def jumps(motion: Motion) -> list[str]:
    """What to look at, one sentence for each jump, by their frames."""
    if motion.limb_names is None or motion.joint_limb is None or motion.num_frames < 4:
        return []
    of_blob = np.asarray(motion.joint_limb)[motion.blob_joint]
    limbs = of_blob[None] == np.arange(len(motion.limb_names))[:, None]
    names, limbs = motion.limb_names[limbs.any(axis=1)], limbs[limbs.any(axis=1)]
    found = limb_jumps(motion.blob_means, limbs)
    least = largest_step(float(motion.fps) / float(np.median(np.diff(motion.frame))))
    said = []
    for name, column in zip(names, found.T, strict=True):
        for first, stop in stretches(column > least, gap=2):
            far = 100.0 * column[first:stop].max()
            said.append((int(motion.frame[first]), f"{name} jumps by {far:.0f} cm", int(motion.frame[stop])))
    return [f"look at frames {first}-{last}, {what}" for first, what, last in sorted(said)]
