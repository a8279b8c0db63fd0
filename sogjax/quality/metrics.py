"""Numbers that say how good a track is: means, spread, quantiles, lost points.

Bone lengths of an actor against the truth's.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from sogjax.io.ground_truth import GroundTruth
from sogjax.model.body import Body

LOST_DISTANCE = 0.2
"""Metres: a point farther than this from the truth ..."""
LOST_FRAMES = 5
"""... for this many frames on end is lost."""


@dataclass(frozen=True)
class ErrorSummary:
    """Distances to the truth over points and frames, in metres; NaN where nothing was compared."""

    mean: float
    std: float
    median: float
    percentile_95: float
    maximum: float
    under_50mm: float
    """Fraction of the distances."""
    under_100mm: float
    num_values: int
    """How many distances: points times frames, less what the truth lacks."""
    num_frames: int


@dataclass(frozen=True)
class LostPoint:
    """A stretch of frames over which a point stayed far from the truth: a lost limb."""

    name: str
    first_frame: int
    last_frame: int
    mean: float
    """Metres, over the stretch."""


def summarize(errors: Float[np.ndarray, "frame point"]) -> ErrorSummary:
    """All distances in a few numbers. NaN is left out; all frames count, the first too (see `marker_errors`)."""
    values = errors[np.isfinite(errors)].astype(float)
    if values.size == 0:
        return ErrorSummary(*[float("nan")] * 7, num_values=0, num_frames=len(errors))
    return ErrorSummary(
        mean=float(values.mean()),
        std=float(values.std()),
        median=float(np.median(values)),
        percentile_95=float(np.percentile(values, 95)),
        maximum=float(values.max()),
        under_50mm=float((values < 0.05).mean()),
        under_100mm=float((values < 0.1).mean()),
        num_values=values.size,
        num_frames=len(errors),
    )


def mean_per_frame(errors: Float[np.ndarray, "frame point"]) -> Float[np.ndarray, "frame"]:
    """The mean distance of each frame, in metres; NaN for a frame without any."""
    return _mean_of_present(errors, axis=1)


def mean_per_point(errors: Float[np.ndarray, "frame point"]) -> Float[np.ndarray, "point"]:
    """The mean distance of each point, in metres; NaN for a point without any."""
    return _mean_of_present(errors, axis=0)


def std_per_point(errors: Float[np.ndarray, "frame point"]) -> Float[np.ndarray, "point"]:
    """The standard deviation of each point's distance over the frames, in metres."""
    return np.sqrt(_mean_of_present((errors - mean_per_point(errors)) ** 2, axis=0))


def lost_points(
    errors: Float[np.ndarray, "frame point"],
    names: tuple[str, ...],
    frames: np.ndarray,
    distance: float = LOST_DISTANCE,
) -> tuple[LostPoint, ...]:
    """Stretches of at least `LOST_FRAMES` frames over which a point is farther than `distance` metres.

    Frames in which the truth lacks the point neither end nor lengthen a stretch.
    """
    lost = []
    for k, name in enumerate(names):
        present = np.flatnonzero(np.isfinite(errors[:, k]))
        for first, last in stretches(errors[present, k] > distance, LOST_FRAMES):
            rows = present[first:last]
            mean = float(errors[rows, k].mean())
            lost.append(LostPoint(name, int(frames[rows[0]]), int(frames[rows[-1]]), mean))
    return tuple(lost)


def stretches(flags: Bool[np.ndarray, "frame"], at_least: int = 1, gap: int = 1) -> list[tuple[int, int]]:
    """[first, end) of every run of true `flags`, over gaps of fewer than `gap` frames, that is `at_least` long."""
    joined: list[tuple[int, int]] = []
    for first, end in np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int))).reshape(-1, 2):
        before = joined.pop() if joined and first - joined[-1][1] < gap else (first, end)
        joined.append((int(before[0]), int(end)))
    return [(first, end) for first, end in joined if end - first >= at_least]


def _mean_of_present(values: np.ndarray, axis: int) -> np.ndarray:
    present = np.isfinite(values)
    count = present.sum(axis)
    total = np.where(present, values, 0.0).sum(axis)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


BONES = {
    "upper arm": ("{side}_shoulder", "{side}_elbow"),
    "forearm": ("{side}_elbow", "{side}_wrist"),
    "thigh": ("{side}_hip", "{side}_knee"),
    "shank": ("{side}_knee", "{side}_ankle"),
    "shoulders": ("left_shoulder", "right_shoulder"),
    "hips": ("left_hip", "right_hip"),
}
"""Bones by the names of landmarks of `human`; left and right are taken together."""


def bone_errors(body: Body, truth: GroundTruth) -> dict[str, float]:
    """Relative deviation of each bone's length from the mean distance of the truth's joints; 0.01 is 1 % too long."""
    assert truth.joints is not None
    landmarks = np.asarray(body.posed_landmarks(body.poses["rest"]), float)[None]
    true_names = [landmark_named(name) for name in truth.joint_names]
    return {
        bone: _length(landmarks, body.landmarks.names, ends) / _length(truth.joints, true_names, ends) - 1.0
        for bone, ends in BONES.items()
    }


def landmark_named(joint: str) -> str:
    """`ACTOR/l_knee` is `left_knee`."""
    name = joint.split("/")[-1]
    sides = {"l_": "left_", "r_": "right_"}
    return sides[name[:2]] + name[2:] if name[:2] in sides else name


def _length(
    points: Float[np.ndarray, "frame point 3"], names: list[str] | tuple[str, ...], ends: tuple[str, str]
) -> float:
    """Mean distance of two points over frames and sides, metres."""
    at = lambda name: points[:, list(names).index(name)]
    spans = [at(ends[0].format(side=side)) - at(ends[1].format(side=side)) for side in ("left", "right")]
    return float(np.nanmean(np.linalg.norm(spans, axis=-1)))
