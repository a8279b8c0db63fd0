"""A picture of the best guess of a first pose, for the person who has to say what it is."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from sogjax.data.atomic import atomic_path
from sogjax.data.motion import motion_from_poses
from sogjax.data.recording import Recording
from sogjax.data.video import read_frames
from sogjax.engine.pose_search import Beginning
from sogjax.model.body import Body
from sogjax.view.overlay import overlay_frame

WIDTH = 1600
"""Pixels."""


def write_unsure_picture(
    recording: Recording, bodies: Sequence[Body], guess: Beginning, path: Path | None = None
) -> Path:
    """Draw a guess over the pictures of its frame; where it was written (by default the current folder)."""
    path = Path(f"{recording.name}_first_pose.png") if path is None else path
    frame = guess.frame + recording.first_frame
    motions = []
    for body, found in zip(bodies, guess.poses, strict=True):
        motion = motion_from_poses(body, np.asarray(found.pose)[None], recording.fps)
        motions.append(replace(motion, frame=np.array([frame])))
    images = next(iter(read_frames(recording, guess.frame, guess.frame + 1)))
    drawn = overlay_frame(images, recording.rig, motions, frame, width=WIDTH)
    with atomic_path(path) as temporary:
        temporary.write_bytes(cv2.imencode(".png", drawn)[1].tobytes())
    return path
