"""Limbs that are elsewhere from one frame to the next: nobody moves so, and they are wrong before or after."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float

from sogjax.io.motion import Motion, motion_from_poses
from sogjax.model.body import Body
from sogjax.model.limbs import limb_blobs, limb_names
from sogjax.quality.metrics import stretches

FAR, FPS = 0.2, 25.0
"""Metres of a jump, and the frames a second from which on nobody does so: arms that throw or hit are within 0.16."""
IN_PACE = 0.3
"""Part of the pace that a blob keeps by which that may change from frame to frame: hands that throw would else be up to
0.23 off their path."""
NEAR = 0.6
"""Part of the `FAR` from which on a jump is worth a search."""


def largest_step(fps: float) -> float:
    """Metres that a blob may be off what the frames around it foretell: where these lie apart, more, soon anything."""
    return FAR * max(FPS / fps, 1.0) ** 3


def steps(means: Float[np.ndarray, "frame *blob 3"]) -> Float[np.ndarray, "frame *blob"]:
    """How far each blob jumps behind each frame, in metres, beyond how it moves before and after; 0 behind the last.

    Beside a single jump half of it is seen. The clip goes on at its ends as it moves there.
    """
    if len(means) < 4:
        return np.zeros(means.shape[:-1])
    first, last = means[:1] - means[2:3] + means[1:2], means[-1:] + means[-2:-1] - means[-3:-2]
    path = np.concatenate([first, means, last])
    bend = path[1:-1] - 0.5 * (path[2:] + path[:-2])
    found = np.linalg.norm(np.diff(bend, axis=0), axis=-1)
    return np.concatenate([found, np.zeros_like(found[:1])])


def _pace_kept(means: Float[np.ndarray, "frame *blob 3"]) -> Float[np.ndarray, "frame *blob"]:
    """How far each blob moves before and after each frame and the next as it does between them, in metres.

    The geometric mean of the two steps: somebody lost for some frames stands still before or after.
    """
    move = np.diff(means, axis=0)
    along = move / np.maximum(np.linalg.norm(move, axis=-1, keepdims=True), 1e-9)
    around = np.pad(move, [(1, 1), *[(0, 0)] * (move.ndim - 1)])
    before, after = (np.maximum(np.sum(along * other, axis=-1), 0.0) for other in (around[:-2], around[2:]))
    kept = np.sqrt(before * after)
    return np.concatenate([kept, np.zeros_like(kept[:1])])


def limb_jumps(
    means: Float[np.ndarray, "frame blob 3"],
    limbs: Bool[np.ndarray, "limb blob"],
    of_blobs: Callable[..., np.ndarray] = np.max,
    in_pace: float = 0.0,
) -> Float[np.ndarray, "frame limb"]:
    """How far each limb jumps behind each frame, in metres: the blob that does so most, or `of_blobs`; 0 of none.

    `in_pace` is the part of the pace that a blob keeps by which it may change.
    """
    found, jumps = steps(means), np.zeros((len(means), len(limbs)))
    found = np.maximum(found - in_pace * _pace_kept(means), 0.0) if in_pace else found
    for k, blobs in enumerate(limbs):
        if blobs.any():
            jumps[:, k] = of_blobs(found[:, blobs], axis=1)
    return jumps


def peaks(jumps: Float[np.ndarray, "frame *limb"]) -> Float[np.ndarray, "frame *limb"]:
    """The jumps that are no smaller than those beside; 0 for the others."""
    beside = np.pad(jumps, [(1, 1), *[(0, 0)] * (jumps.ndim - 1)])
    return np.where((jumps >= beside[:-2]) & (jumps >= beside[2:]), jumps, 0.0)


def jumps(body: Body, motion: Motion) -> list[str]:
    """What to look at, one sentence for each jump, by their frames; what was filtered is judged as it was before."""
    if motion.num_frames < 4:
        return []
    unfiltered = motion.unfiltered_pose
    means = motion.blob_means if unfiltered is None else motion_from_poses(body, unfiltered, motion.fps).blob_means
    found, said = peaks(limb_jumps(means, limb_blobs(body), in_pace=IN_PACE)), []
    least = largest_step(float(motion.fps) / float(np.median(np.diff(motion.frame))))
    for name, column in zip(limb_names(body), found.T, strict=True):
        for first, stop in stretches(column > least, gap=2):
            said.append((int(motion.frame[first]), int(motion.frame[stop]), f"{name} jumps"))
    return [f"look at frames {first}-{last}, {what}" for first, last, what in sorted(said)]
