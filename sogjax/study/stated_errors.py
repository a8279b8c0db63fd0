"""Standard deviations held against true errors, and the temperature that makes them right."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sogjax import __version__
from sogjax.data.atomic import atomic_path
from sogjax.data.ground_truth import GroundTruth
from sogjax.data.motion import Motion, motion_from_poses
from sogjax.engine.streams import deviations_of
from sogjax.errors import InputError
from sogjax.evaluation.markers import common_frames, joint_pairs
from sogjax.settings.compose import track_config
from sogjax.study.record import program_digest
from sogjax.study.source import Source
from sogjax.tracking.tracker import track

BINS = 8
ROUNDS = 6
CLOSE = 0.02
"""Relative change of the temperature at which the calibration ends."""


@dataclass(frozen=True)
class StatedErrors:
    """Standard deviations said of joints, and how far these were off; metres, over frames and joints.

    A joint's mean offset in its own frame (bone lengths, joint centres) is left out: it belongs to the actor.
    """

    said: Float[np.ndarray, "value"]
    found: Float[np.ndarray, "value"]

    @property
    def mean_square_ratio(self) -> float:
        """1 where the deviations are right on the whole."""
        return float(np.mean((self.found / self.said) ** 2))

    def within(self, deviations: float) -> float:
        """The share of errors below so many standard deviations."""
        return float(np.mean(self.found < deviations * self.said))

    def binned(self, bins: int = BINS) -> tuple[Float[np.ndarray, "bin"], Float[np.ndarray, "bin"]]:
        """Root mean squares of what was said and found, in bins of equal size ordered by what was said."""
        parts = np.array_split(np.argsort(self.said), bins)
        square = lambda values: np.array([np.sqrt(np.mean(values[part] ** 2)) for part in parts])
        return square(self.said), square(self.found)

    @property
    def rank_correlation(self) -> float:
        """Spearman rank correlation of stated and actual errors."""
        ranks = lambda values: np.argsort(np.argsort(values)).astype(float)
        return float(np.corrcoef(ranks(self.said), ranks(self.found))[0, 1])


def kept_stated_errors(source: Source, temperature: float, overrides: Sequence[str] = ()) -> StatedErrors:
    """The same, read where it was done before.

    Raises:
        InputError: as `stated_errors`, or the study's folder cannot be written.
    """
    what = json.dumps([__version__, program_digest(), source.identity, source.num_frames, temperature, list(overrides)])
    path = source.folder / "confidence" / f"{hashlib.sha256(what.encode()).hexdigest()[:16]}.npz"
    if path.is_file():
        with np.load(path) as kept:
            return StatedErrors(kept["said"], kept["found"])
    result = stated_errors(source, temperature, overrides)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez(file, said=result.said, found=result.found)
    return result


def stated_errors(source: Source, temperature: float, overrides: Sequence[str] = ()) -> StatedErrors:
    """Track a recording of one actor and compare its joints with the truth.

    Raises:
        InputError: there are several actors, or no true joints.
    """
    if len(source.bodies) != 1 or source.truth.joints is None:
        raise InputError(f"{source.name}: deviations are compared for the true joints of one person only")
    confidence = {"confidence": True, "temperature": temperature}
    config = track_config(overrides, recording=source.path, outputs=confidence)
    cameras = source.cameras(None)
    tracker = source.tracker(config, cameras)
    results = [frame.result for frame in track(tracker, source.start, source.cells(config.images.depth, cameras, 1))]
    poses = np.stack([np.asarray(result.pose) for result in results])
    numbers = source.recording.first_frame + np.arange(len(results))
    motion = motion_from_poses(source.bodies[0], poses, source.recording.fps, frame=numbers)
    _, deviations = deviations_of(results)
    assert deviations is not None
    joints, errors = joint_offsets(motion, source.truth)
    if not np.isfinite(errors).any():
        raise InputError(f"{source.name}: no true joint is known in the frames that were tracked")
    rows, _ = common_frames(motion, source.truth)
    said, found = deviations[rows][:, joints].astype(float).ravel(), without_constant_offset(errors).ravel()
    known = np.isfinite(found)
    return StatedErrors(said[known], found[known])


def joint_offsets(motion: Motion, truth: GroundTruth) -> tuple[list[int], Float[np.ndarray, "frame pair 3"]]:
    """The motion's joints that the truth has too, and where the truth's lie in the frames of these; metres."""
    assert truth.joints is not None
    pairs = joint_pairs(motion, tuple(map(str, truth.joint_names)), {})
    joints = [joint for _, joint in pairs]
    rows, truth_rows = common_frames(motion, truth)
    frames = motion.world_from_joint[rows][:, joints].astype(float)
    theirs = np.asarray(truth.joints, float)[truth_rows][:, [joint for joint, _ in pairs]]
    return joints, np.einsum("tjki,tjk->tji", frames[..., :3, :3], theirs - frames[..., :3, 3])


def without_constant_offset(offsets: Float[np.ndarray, "frame pair 3"]) -> Float[np.ndarray, "frame pair"]:
    """How far each joint is off beside its mean offset in its own frame, which is the body's and no pose can mend."""
    return np.linalg.norm(offsets - np.nanmean(offsets, axis=0, keepdims=True), axis=-1)


def calibrated_temperature(sources: Sequence[Source], first: float, overrides: Sequence[str] = ()) -> float:
    """The temperature with which the squared deviations of all joints and frames are right on the whole.

    Deviations grow with its root, but for the prior of the joints' ranges: a few rounds settle it.
    """
    temperature = first
    for _ in range(ROUNDS):
        parts = [stated_errors(source, temperature, overrides) for source in sources]
        ratio = float(np.mean(np.concatenate([(part.found / part.said) ** 2 for part in parts])))
        temperature *= ratio
        if abs(ratio - 1.0) < CLOSE:
            break
    return temperature
