"""A track held against its truth, and its ranking by a set of terms."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from sogjax.errors import InputError
from sogjax.io.cache_folder import default_cache_dir
from sogjax.io.ground_truth import GroundTruth, load_ground_truth
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.run.recordings import upright
from sogjax.settings.compose import track_config
from sogjax.study.climbs import ranked
from sogjax.study.true_poses import true_poses
from sogjax.study.verdicts import Ranking, limb_errors

DEFAULT = "default"
"""The set without any word."""


@dataclass(frozen=True)
class RankedTrack:
    """Tracked poses and true ones of the same frames."""

    recording: Recording
    truth: GroundTruth
    actors: list[Body]
    """In their own upright frames."""
    frames: Int[np.ndarray, "frame"]
    """The recording's numbers, one after the other."""
    tracked: Float[np.ndarray, "frame dof"]
    """Of all actors beside each other."""
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


def ranking_of(track: RankedTrack, words: str, far: float) -> Ranking:
    """The ranking of a track by the terms, pictures and solver of a set: options of track, with spaces between them."""
    given = [] if words == DEFAULT else words.split()
    cache: Mapping[str, str] = {"cache": str(default_cache_dir() / "cells")}
    config = track_config(given, recording=track.recording.path, images=cache, outputs={"confidence": False})
    starts = [track.tracked, track.true]
    pair = ranked(track.recording, track.actors, config, track.frames - track.recording.first_frame, starts)
    bodies = [upright(actor, track.recording) for actor in track.actors]
    poses = (track.tracked, pair.tracked.poses, pair.true.poses, track.true)
    errors = [limb_errors(bodies, track.truth, track.frames, each) for each in poses]
    return Ranking(words, track.frames, pair, *errors, far=far)
