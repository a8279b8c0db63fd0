"""Simulated keypoints of a rendered recording, and their files."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from sogjax.errors import InputError
from sogjax.io import recording_files
from sogjax.io.keypoints.scheme import KeypointScheme, named_scheme
from sogjax.io.keypoints.write import WRITERS, pictures_to_write
from sogjax.synth.detector import DetectorSettings, Sight, detected
from sogjax.synth.keypoint_sight import sights
from sogjax.synth.landmarks import KEYPOINTS
from sogjax.synth.stage import Stage

LEGS = ("hip", "knee", "ankle", "heel", "toe")
_STREAM = 9
"""Of random numbers."""

Found = Float[np.ndarray, "found keypoint 3"]


def keypoint_folder(detector: DetectorSettings) -> str:
    """Where the program leaves its files in a recording."""
    part = recording_files.POSE if detector.keypoints == "pose2sim" else recording_files.KEYPOINTS
    return part.name


def scheme_of(detector: DetectorSettings) -> KeypointScheme:
    """The scheme of the files.

    Raises:
        InputError: there is no such scheme, or it means points that no rendered person has.
    """
    scheme = named_scheme(detector.keypoint_scheme or WRITERS[detector.keypoints][1])
    unknown = next((name for name in scheme.landmarks if name not in KEYPOINTS), None)
    if unknown is not None:
        raise InputError(
            f"keypoint_scheme={detector.keypoint_scheme}: the landmark {unknown!r} is none of a rendered person, who "
            f"has {', '.join(KEYPOINTS)}"
        )
    return scheme


def write_simulated(stage: Stage, detector: DetectorSettings, folder: Path) -> None:
    """Write the keypoint files of all cameras into a recording's folder, or any other.

    Raises:
        InputError: a setting is wrong.
    """
    detector.check()
    scheme = scheme_of(detector)
    write, _ = WRITERS[detector.keypoints]
    shifts = biases(detector, stage.settings.seed, len(stage.people))
    pictures: list[list[Found]] = [[] for _ in stage.views]
    for frame in range(stage.settings.frames):
        for camera, sight in enumerate(sights(stage, frame, shifts)):
            pictures[camera].append(found_in(sight, scheme, detector, stage.settings.seed, camera, frame))
    for camera, view in enumerate(stage.views):
        written = files_there(detector, stage.settings.seed, camera, stage.settings.frames)
        people = [pictures_to_write(scheme, one[None], np.ones(1, bool))[0] for one in pictures[camera]]
        write(folder, view.name, [one if there else None for one, there in zip(people, written, strict=True)])


def biases(detector: DetectorSettings, seed: int, num_people: int) -> Float[np.ndarray, "person keypoint 3"]:
    """By person where each of `KEYPOINTS` is taken to be, seen from where it is: all equally far off, metres."""
    directions = np.random.default_rng([seed, _STREAM]).standard_normal((num_people, len(KEYPOINTS), 3))
    return detector.keypoint_bias * directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def found_in(
    sight: Sight, scheme: KeypointScheme, detector: DetectorSettings, seed: int, camera: int, frame: int
) -> Found:
    """What the detector finds in a picture of a camera, of whose `KEYPOINTS` there is `sight`."""
    rng = np.random.default_rng([seed, _STREAM, camera, frame])
    order = [*KEYPOINTS]
    places = [order.index(name) for name in scheme.landmarks]
    legs = np.array([any(part in name for part in LEGS) for name in scheme.landmarks])
    chosen = Sight(sight.pixels[:, places], sight.inside[:, places], sight.hidden[:, places], sight.heights)
    return detected(chosen, scheme.mirrored, legs, detector, rng)


def files_there(detector: DetectorSettings, seed: int, camera: int, frames: int) -> Bool[np.ndarray, "frame"]:
    """Of which pictures of a camera there is a file."""
    rng = np.random.default_rng([seed, _STREAM, camera])
    return rng.random(frames) >= detector.keypoint_missing
