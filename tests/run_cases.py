"""A tiny run, and a request for its initial pose: no pictures are read, and a stand-in tracks."""

import numpy as np
from body_cases import shipped
from frame_table_cases import frame_table
from rig_cases import recording_of, ring_rig

from sogjax.io.frame_table import FramesRecord
from sogjax.run.actors import Actors
from sogjax.run.background import Background
from sogjax.run.clip import Clip
from sogjax.run.initial_pose import PoseRequest
from sogjax.run.passes import PASSES, Pass
from sogjax.run.run import Run
from sogjax.settings.compose import track_config

DOG = shipped("dog")
DEPTH = 4


def tiny_clip(frames=8):
    """Of a recording without files, of two cameras."""
    recording = recording_of(ring_rig(2), frames)
    return Clip(recording, recording.frames, DEPTH)


def tiny_run(*words, out=None, kept=None, frames=8, frames_given=False, **records):
    """A run of a dog before a background of which nothing is known; `records` are there or take the place of these."""
    known = {"background": Background(None), "actors": Actors((DOG,))} | records
    config = track_config(words, recording="r")
    return Run(tiny_clip(frames), config, out, kept, frames_given=frames_given, records=known)


def pose_request(*words, clip=None, actors=None):
    """What a source of the initial pose is asked."""
    config = track_config(words, recording="r")
    return PoseRequest(clip or tiny_clip(), Background(None), actors or Actors((DOG,)), config)


def stand_in_tracked(run):
    """Frames in which the dog walks along x, in place of the tracker's."""
    poses = np.zeros((len(run.clip.numbers), DOG.skeleton.num_dofs), np.float32)
    poses[:, 0] = 0.1 * np.arange(len(poses))
    return FramesRecord(frame_table(poses, run.clip.numbers[0]))


TRACKED = Pass("tracked", "tracking", stand_in_tracked)


def stand_in_passes(*after):
    """The passes of a run whose frames a stand-in tracks, with passes `after` it, without files."""
    return [each for each in PASSES if each.name == "background"] + [TRACKED, *after]
