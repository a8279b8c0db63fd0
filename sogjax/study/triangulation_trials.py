"""How well keypoints alone, triangulated, tell the joints: what a body model has to beat."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.signal import butter, sosfiltfilt

from sogjax.io.ground_truth import GroundTruth
from sogjax.io.keypoints.load import Keypoints
from sogjax.io.recording import Recording
from sogjax.quality.metrics import landmark_named, lost_points
from sogjax.search.keypoint_people import triangulated_people
from sogjax.search.triangulation import interpolated

LONGEST_GAP = 20
"""Frames that are filled on a line; longer gaps keep the nearest place (Pose2Sim's defaults)."""
CUTOFF = 6.0
"""Hertz of the Butterworth filter of fourth order (Pose2Sim's default)."""
_LOST = 10.0
"""Metres that a joint which was never found counts as, where lost stretches are counted."""


@dataclass(frozen=True)
class JointErrors:
    """Distances of triangulated keypoints from the true joints, metres, over all people, frames and joints."""

    found: float
    """Mean over those that were found, as they are."""
    missing: float
    """Share that was not found."""
    filtered: float
    """Mean with gaps filled and all filtered, as Pose2Sim does by default; joints never found are left out."""
    worst: float
    """The 95th percentile of the same."""
    lost: int
    """Stretches of five frames in which a joint is 20 cm off or was not found at all."""
    joints: int
    """How many joints of a person were compared: those that the scheme has."""


def triangulation_errors(
    recording: Recording, keypoints: Keypoints, truth: GroundTruth, cameras: Sequence[str]
) -> JointErrors:
    """Triangulate with some of the cameras, and compare; each person of the truth with the nearest one found."""
    subjects = [truth.subject(name) for name in truth.subjects] or [truth]
    rig = recording.rig.select(cameras)
    points = triangulated_people(keypoints.select(cameras), rig, len(subjects)).points
    smooth = np.stack([filtered(filled(points[:, k]), recording.fps) for k in range(points.shape[1])], axis=1)
    raw, final, lost, count = [], [], 0, 0
    for subject in subjects:
        names = [landmark_named(name) for name in subject.joint_names]
        common = [(k, names.index(name)) for k, name in enumerate(keypoints.scheme.landmarks) if name in names]
        chosen, joints = np.array(common).T
        assert subject.joints is not None
        true = subject.joints[recording.first_frame :][: len(points), joints]
        as_found = np.linalg.norm(points[:, :, chosen] - true[:, None], axis=-1)
        one = int(np.nan_to_num(as_found, nan=1.0).mean((0, 2)).argmin())
        after = np.linalg.norm(smooth[:, one, chosen] - true, axis=-1)
        known = np.isfinite(true).all(-1)
        raw.append(np.where(known, as_found[:, one], -1.0))
        final.append(np.where(known, after, np.nan))
        off = np.where(known, np.nan_to_num(after, nan=_LOST), np.nan)
        lost += len(lost_points(off, tuple(names[j] for j in joints), np.arange(len(points))))
        count = len(common)
    found, kept = np.concatenate(raw), np.concatenate(final)
    compared = found[~(found < 0.0)]
    return JointErrors(
        found=float(np.nanmean(compared)),
        missing=float(np.isnan(compared).mean()),
        filtered=float(np.nanmean(kept)),
        worst=float(np.nanpercentile(kept, 95)),
        lost=lost,
        joints=count,
    )


def filled(points: Float[np.ndarray, "frame point 3"]) -> Float[np.ndarray, "frame point 3"]:
    """Points without gaps: short ones on a line, longer ones by the last known place, the beginning by the first."""
    result = interpolated(points, LONGEST_GAP)
    for k in range(result.shape[1]):
        known = np.flatnonzero(np.isfinite(result[:, k]).all(-1))
        if len(known):
            last = np.maximum(np.searchsorted(known, np.arange(len(result)), side="right") - 1, 0)
            result[:, k] = result[known[last], k]
    return result


def filtered(points: Float[np.ndarray, "frame point 3"], fps: float) -> Float[np.ndarray, "frame point 3"]:
    """Low-passed forwards and backwards; short clips and slow cameras stay as they are."""
    share = CUTOFF / (fps / 2.0)
    if share >= 1.0 or len(points) <= 12:
        return points
    return sosfiltfilt(butter(2, share, output="sos"), points, axis=0)
