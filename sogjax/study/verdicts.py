"""Whether what was lost is the objective's fault or the search's: limbs, their errors, and a verdict for each frame."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import motion_from_poses
from sogjax.model.body import Body, dof_slices
from sogjax.quality.markers import common_frames, joint_errors
from sogjax.quality.metrics import mean_per_frame
from sogjax.study.climbs import Pair

KEPT, REGAINED, SEARCH, OBJECTIVE, LEFT, UNKNOWN = "kept", "regained", "search", "objective", "left", "unknown"
VERDICTS = {
    KEPT: "no limb was lost",
    REGAINED: "lost, but these terms lead back from the tracked pose",
    SEARCH: "lost, and the true pose is worth more: it was not reached",
    OBJECTIVE: "lost, and the wrong pose is worth more",
    LEFT: "lost, and a climb from the true pose loses it, too: there is no optimum near the truth",
}
ENDS = {"elbow": "arm", "wrist": "arm", "hand": "arm", "knee": "leg", "ankle": "leg", "toe": "leg", "foot": "leg"}
"""What belongs to a limb; other joints are the trunk's."""
EQUAL = 1e-4
"""Share of the energy: the accuracy of a sum over near pairs, below which neither pose is worth more."""


@dataclass(frozen=True)
class LimbErrors:
    """Mean distances of joints to the truth (metres); NaN where the truth is not known."""

    names: tuple[str, ...]
    limbs: Float[np.ndarray, "frame limb"]
    mean: Float[np.ndarray, "frame"]
    """Over all joints."""


def limb_errors(
    bodies: Sequence[Body],
    truth: GroundTruth,
    frames: Int[np.ndarray, "frame"],
    poses: Float[np.ndarray, "frame dof"],
) -> LimbErrors:
    """The errors of poses of several bodies, upright in the world, beside each other; `frames` are the recording's.

    Raises:
        InputError: the truth knows none of these frames.
    """
    names: list[str] = []
    columns: list[np.ndarray] = []
    known = np.asarray(np.isfinite(poses).all(axis=1))
    for body, part in zip(bodies, dof_slices(bodies), strict=True):
        of_body = truth.subject(body.name) if truth.subjects else truth
        motion = motion_from_poses(body, np.where(known[:, None], poses[:, part], 0.0), truth.fps, frame=frames)
        found = joint_errors(motion, of_body)
        if found is not None:
            subject = f"{body.name}/" if len(bodies) > 1 else ""
            names += [subject + name for name in found.names]
            rows, _ = common_frames(motion, of_body)
            column = np.full((len(frames), len(found.names)), np.nan)
            column[rows] = np.where(known[rows, None], found.errors, np.nan)
            columns.append(column)
    errors = np.concatenate([*columns, np.zeros((len(frames), 0))], axis=1)
    of_joint = [limb_of(name) for name in names]
    limbs = tuple(dict.fromkeys(of_joint))
    means = [mean_per_frame(errors[:, [k for k, one in enumerate(of_joint) if one == limb]]) for limb in limbs]
    return LimbErrors(limbs, np.stack([*means], axis=1), mean_per_frame(errors))


def limb_of(joint: str) -> str:
    """The limb of a truth's joint: `left arm` of `l_wrist`, `anna/right leg` of `anna/right_knee`."""
    subject, slash, name = joint.rpartition("/")
    side, _, part = name.lower().partition("_")
    limb = next((limb for end, limb in ENDS.items() if part.startswith(end)), None)
    whole = {"l": "left", "r": "right"}.get(side, side)
    return subject + slash + (f"{whole} {limb}" if limb and whole in ("left", "right") else "trunk")


@dataclass(frozen=True)
class Ranking:
    """One set of terms on a recording."""

    name: str
    frames: Int[np.ndarray, "frame"]
    """The recording's numbers."""
    pair: Pair
    tracked: LimbErrors
    """Errors of the poses as they were tracked."""
    reached: LimbErrors
    """Errors of the optima above them."""
    optimum: LimbErrors
    """Errors of the optima above the true poses."""
    fitted: LimbErrors
    """Errors of the fitted true poses: what the skeleton cannot follow."""
    far: float
    """Metres: a limb that is farther off than this is lost."""

    @property
    def gain(self) -> Float[np.ndarray, "frame"]:
        """By what share of the energy the true pose is worth more."""
        true = self.pair.true.energy
        return (true - self.pair.tracked.energy) / np.abs(true)

    @property
    def chosen(self) -> Float[np.ndarray, "frame"]:
        """Mean joint errors of what is worth more: the optima above the tracked poses, or above the true ones."""
        return np.where(self.gain > EQUAL, self.optimum.mean, self.reached.mean)

    @property
    def lost(self) -> Bool[np.ndarray, "frame limb"]:
        """Which limbs the tracked poses had lost."""
        return self.tracked.limbs > self.far

    @cached_property
    def verdicts(self) -> list[str]:
        """A verdict of every frame: a key of `VERDICTS`, or that the truth is not known."""
        return [self._verdict(k) for k in range(len(self.frames))]

    def _verdict(self, frame: int) -> str:
        if not np.isfinite(self.gain[frame]):
            return UNKNOWN
        if not self.lost[frame].any():
            return KEPT
        still_lost = self.reached.limbs[frame] > self.far
        if not still_lost.any():
            return REGAINED
        if (self.optimum.limbs[frame][still_lost] > self.far).all():
            return LEFT
        return SEARCH if self.gain[frame] > EQUAL else OBJECTIVE

    def of_limb(self, limb: int) -> "Ranking":
        """The verdicts on one limb, by its errors only."""
        narrow = lambda errors: replace(errors, names=(errors.names[limb],), limbs=errors.limbs[:, [limb]])
        return replace(
            self,
            tracked=narrow(self.tracked),
            reached=narrow(self.reached),
            optimum=narrow(self.optimum),
            fitted=narrow(self.fitted),
        )
