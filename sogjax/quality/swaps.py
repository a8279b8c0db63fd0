"""Which of several subjects does each motion follow: exchanged identities."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import linear_sum_assignment

from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import Motion
from sogjax.quality.markers import common_frames
from sogjax.quality.metrics import stretches

SWAP_FRAMES = 5
"""An exchange is reported where it lasts for this many frames on end."""


@dataclass(frozen=True)
class Swap:
    """A stretch of frames over which one actor's motion follows another subject."""

    motion: str
    follows: str
    first_frame: int
    last_frame: int


def identity_swaps(motions: Mapping[str, Motion], truth: GroundTruth) -> tuple[Swap, ...]:
    """Where motions follow the wrong subject: the assignment of least distance is not the one by name.

    The distance of a subject to a motion is the mean over the subject's markers (else joints) of the distance
    to the motion's closest blob centre: it needs no attachment, so an exchange in the first frame shows too.
    """
    names = tuple(motions)
    frames, distances = subject_distances(motions, truth)
    if frames.size == 0:
        return ()
    assignment = np.array([linear_sum_assignment(np.nan_to_num(cost))[1] for cost in distances])
    swaps = []
    for i, name in enumerate(names):
        for j, other in enumerate(names):
            if i != j:
                swaps += [
                    Swap(name, other, int(frames[first]), int(frames[end - 1]))
                    for first, end in stretches(assignment[:, i] == j, SWAP_FRAMES)
                ]
    return tuple(sorted(swaps, key=lambda swap: (swap.first_frame, swap.motion)))


def subject_distances(
    motions: Mapping[str, Motion], truth: GroundTruth
) -> tuple[Int[np.ndarray, "frame"], Float[np.ndarray, "frame motion subject"]]:
    """Common frames, and in each the distances (metres) of the subjects to the motions."""
    subjects = [truth.subject(name) for name in motions]
    rows = [dict(zip(*map(list, common_frames(m, truth)[::-1]), strict=True)) for m in motions.values()]
    frames = np.array(sorted(set.intersection(*map(set, rows))), int)
    distances = np.zeros((len(frames), len(rows), len(rows)))
    for i, (motion, row_of) in enumerate(zip(motions.values(), rows, strict=True)):
        blobs = motion.blob_means[[row_of[frame] for frame in frames]]
        for j, subject in enumerate(subjects):
            distances[:, i, j] = _distance_to_blobs(blobs, _points(subject)[frames])
    return frames, distances


def _points(truth: GroundTruth) -> Float[np.ndarray, "frame point 3"]:
    points = truth.markers if truth.markers is not None else truth.joints
    if points is None:
        raise ValueError("a truth with neither markers nor joints")
    return np.asarray(points, float)


def _distance_to_blobs(
    blobs: Float[np.ndarray, "frame blob 3"], points: Float[np.ndarray, "frame point 3"]
) -> Float[np.ndarray, "frame"]:
    """Mean over the points that are there of the distance to the closest blob; NaN without points."""
    nearest = np.full(points.shape[:2], np.inf)
    for b in range(blobs.shape[1]):  # one blob at a time: frames x points x blobs may not fit
        nearest = np.minimum(nearest, np.linalg.norm(points - blobs[:, b, None], axis=-1))
    present = np.isfinite(nearest)
    count = present.sum(1)
    return np.where(count > 0, np.where(present, nearest, 0.0).sum(1) / np.maximum(count, 1), np.nan)
