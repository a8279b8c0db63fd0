"""A track held against its truth: where climbs from either end, and whose fault it is that a limb was lost."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from climbs import Pair, ranked
from jaxtyping import Bool, Float, Int

from sogjax.errors import InputError
from sogjax.io.cache_folder import default_cache_dir
from sogjax.io.ground_truth import GroundTruth, load_ground_truth
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.run.recordings import upright
from sogjax.settings.compose import track_config
from sogjax.study.true_poses import LimbErrors, limb_errors, true_poses

KEPT, REGAINED, SEARCH, OBJECTIVE, LEFT, UNKNOWN = "kept", "regained", "search", "objective", "left", "unknown"
VERDICTS = {
    KEPT: "no limb was lost",
    REGAINED: "lost, but these terms lead back from the tracked pose",
    SEARCH: "lost, and the true pose is worth more: it was not reached",
    OBJECTIVE: "lost, and the wrong pose is worth more",
    LEFT: "lost, and a climb from the true pose loses it, too: there is no optimum near the truth",
}
EQUAL = 1e-4
"""Share of the energy: the accuracy of a sum over near pairs, below which neither pose is worth more."""


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
    def gain_by_term(self) -> dict[str, Float[np.ndarray, "frame"]]:
        """What each term adds to it."""
        true, tracked = self.pair.true, self.pair.tracked
        return {name: (true.parts[name] - tracked.parts[name]) / np.abs(true.energy) for name in true.parts}

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


DEFAULT = "default"
"""The set without any word."""


@dataclass(frozen=True)
class RankedTrack:
    """Tracked poses and true ones of the same frames."""

    recording: Recording
    truth: GroundTruth
    actors: list[Body]
    """The actors in their own upright frames."""
    frames: Int[np.ndarray, "frame"]
    """The recording's numbers, one after the other."""
    tracked: Float[np.ndarray, "frame dof"]
    """The tracked poses of all actors beside each other."""
    true: Float[np.ndarray, "frame dof"]
    """NaN where the truth is not known."""

    @classmethod
    def of(cls, recording: Recording, motions: Sequence[Motion], actors: Sequence[Body]) -> "RankedTrack":
        """Motions of actors, in their order.

        Raises:
            InputError: no truth, or motions that are not those of the actors or of different frames.
        """
        if recording.ground_truth is None:
            raise InputError(f"{recording.path}: has no ground_truth.npz; give a recording with ground truth")
        truth = load_ground_truth(recording.ground_truth)
        frames = np.asarray(motions[0].frame, int)
        for actor, motion in zip(actors, motions, strict=True):
            if tuple(motion.dof_names.tolist()) != actor.skeleton.dof_names:
                raise InputError(f"actor {actor.name!r}: has other degrees of freedom than its motion; give its actor")
            if not np.array_equal(motion.frame, frames) or frames[-1] >= truth.num_frames:
                raise InputError("motion: the motions and the truth have different frames; give those of one track")
        bodies = [upright(actor, recording) for actor in actors]
        alone = len(bodies) == 1 and not truth.subjects
        of_body = [truth if alone else truth.subject(body.name) for body in bodies]
        true = [true_poses(body, part, recording.up)[frames] for body, part in zip(bodies, of_body, strict=True)]
        tracked = [np.asarray(motion.pose, float) for motion in motions]
        return cls(recording, truth, [*actors], frames, np.concatenate(tracked, axis=1), np.concatenate(true, axis=1))


def ranking_of(track: RankedTrack, words: str, far: float, every: int = 1) -> Ranking:
    """The ranking of a track by the terms, pictures and solver of a set.

    Args:
        track: that is ranked.
        words: options of track, with spaces between them.
        far: metres; a limb that is farther off is lost.
        every: of how many frames one is looked at.
    """
    given = [] if words == DEFAULT else words.split()
    cache: Mapping[str, str] = {"cache": str(default_cache_dir() / "cells")}
    config = track_config(given, recording=track.recording.path, images=cache, outputs={"confidence": False})
    starts = [track.tracked, track.true]
    pair = ranked(track.recording, track.actors, config, track.frames - track.recording.first_frame, starts, every)
    bodies = [upright(actor, track.recording) for actor in track.actors]
    frames = track.frames[::every]
    poses = (track.tracked[::every], pair.tracked.poses, pair.true.poses, track.true[::every])
    errors = [limb_errors(bodies, track.truth, frames, each) for each in poses]
    return Ranking(words, frames, pair, *errors, far=far)
