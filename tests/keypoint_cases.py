"""Keypoints for tests: people of a scheme in the pictures of `small_recording`, and files of every program."""

import numpy as np

from sogjax.io.keypoints.scheme import named_scheme
from sogjax.io.keypoints.write import WRITERS, pictures_to_write

STANDING = {
    "nose": (0.0, 0.9), "eye": (0.02, 0.92), "ear": (0.05, 0.9), "head_top": (0.0, 1.0), "neck": (0.0, 0.8),
    "pelvis": (0.0, 0.5), "shoulder": (0.12, 0.8), "elbow": (0.15, 0.62), "wrist": (0.16, 0.46), "hand": (0.16, 0.4),
    "hip": (0.07, 0.5), "knee": (0.08, 0.26), "ankle": (0.08, 0.04), "heel": (0.07, 0.01), "toe": (0.1, 0.0),
    "small_toe": (0.12, 0.0),
}  # fmt: skip
"""Across (left positive) and up, as shares of a person's height."""


def person(scheme, foot=(30.0, 44.0), height=40.0, seed=0):
    """A standing person: (keypoint, 3)."""
    rng = np.random.default_rng(seed)
    points = []
    for landmark in scheme.landmarks:
        side = {"left": 1.0, "right": -1.0}.get(landmark.split("_")[0], 0.0)
        across, up = STANDING[landmark.removeprefix("left_").removeprefix("right_")]
        points.append((foot[0] + side * across * height, foot[1] - up * height, rng.uniform(0.5, 1.0)))
    return np.round(np.array(points), 3)


def people(scheme, frames=4, persons=1):
    """Persons who move to the right: (frame, person, keypoint, 3)."""
    return np.stack([
        np.stack([person(scheme, (20.0 + 2 * t + 15 * (p % 3), 44.0), seed=10 * t + p) for p in range(persons)])
        for t in range(frames)
    ])  # fmt: skip


def write_keypoints(
    folder, program="openpose", cameras=("left", "right"), scheme=None, frames=4, persons=1, there=None
):
    """Write the files of a program, and return what they hold, (frame, person, keypoint, 3)."""
    writer, usual = WRITERS[program]
    chosen = named_scheme(scheme or usual)
    points = people(chosen, frames, persons)
    for camera in cameras:
        writer(folder, camera, pictures_to_write(chosen, points, np.ones(frames, bool) if there is None else there))
    return points
