"""Simulated keypoints of a rendered recording: what each camera sees of them, what is found, and their files."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from sogjax.errors import InputError
from sogjax.io import recording_files
from sogjax.io.keypoints.scheme import KeypointScheme, named_scheme
from sogjax.io.keypoints.write import WRITERS, pictures_to_write
from sogjax.synth.detector import DetectorSettings, Sight, detected
from sogjax.synth.figure import Mesh
from sogjax.synth.landmarks import KEYPOINTS, keypoint_points
from sogjax.synth.raster import Window, rasterize
from sogjax.synth.scene import merged
from sogjax.synth.stage import Stage
from sogjax.synth.views import View

_STREAM = 9
"""The stream of random numbers."""

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
    scheme, seed = scheme_of(detector), stage.settings.seed
    write, _ = WRITERS[detector.keypoints]
    shifts = biases(detector, seed, len(stage.people))
    pictures: list[list[Found]] = [[] for _ in stage.views]
    for frame in range(stage.settings.frames):
        for camera, sight in enumerate(sights(stage, frame, shifts)):
            pictures[camera].append(found_in(sight, scheme, detector, seed, camera, frame))
    for camera, view in enumerate(stage.views):
        written = files_there(detector, seed, camera, stage.settings.frames)
        people = [pictures_to_write(scheme, one[None], np.ones(1, bool))[0] for one in pictures[camera]]
        write(folder, view.name, [one if there else None for one, there in zip(people, written, strict=True)])


def biases(detector: DetectorSettings, seed: int, num_people: int) -> Float[np.ndarray, "person keypoint 3"]:
    """The vectors from each person's `KEYPOINTS` to where they are taken to be, all equally long, metres."""
    directions = np.random.default_rng([seed, _STREAM]).standard_normal((num_people, len(KEYPOINTS), 3))
    return detector.keypoint_bias * directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def found_in(
    sight: Sight, scheme: KeypointScheme, detector: DetectorSettings, seed: int, camera: int, frame: int
) -> Found:
    """What the detector finds in a picture of a camera, of whose `KEYPOINTS` there is `sight`."""
    rng = np.random.default_rng([seed, _STREAM, camera, frame])
    order = [*KEYPOINTS]
    places = [order.index(name) for name in scheme.landmarks]
    legs = ("hip", "knee", "ankle", "heel", "toe")
    of_legs = np.array([any(part in name for part in legs) for name in scheme.landmarks])
    chosen = Sight(sight.pixels[:, places], sight.inside[:, places], sight.hidden[:, places], sight.heights)
    return detected(chosen, scheme.mirrored, of_legs, detector, rng)


def files_there(detector: DetectorSettings, seed: int, camera: int, frames: int) -> Bool[np.ndarray, "frame"]:
    """Whether there is a file of each picture of a camera."""
    rng = np.random.default_rng([seed, _STREAM, camera])
    return rng.random(frames) >= detector.keypoint_missing


def sights(stage: Stage, frame: int, shifts: Float[np.ndarray, "person keypoint 3"]) -> Iterator[Sight]:
    """What each camera sees in a frame of keypoints that are shifted in their joints' frames, metres."""
    placed = [*zip(stage.people, stage.poses(frame), shifts, strict=True)]
    points = np.stack([keypoint_points(person.anatomy, pose, shift) for person, pose, shift in placed])
    statures = np.array([person.anatomy.stature for person in stage.people])
    meshes = [person.posed(pose) for person, pose, _ in placed]
    props = stage.scene.props
    if props is not None:
        room = stage.scene.mesh
        meshes.append(Mesh(room.vertices, room.normals, room.faces[props]))
    surface = merged(meshes)
    for view in stage.views:
        yield _sight(view, points, statures, surface)


def _sight(view: View, points: Float[np.ndarray, "person keypoint 3"], statures: np.ndarray, surface: Mesh) -> Sight:
    pixels, depths = view.project(points.reshape(-1, 3))
    size = np.array([view.width, view.height])
    inside = (depths > 0.1) & (pixels >= -0.5).all(1) & (pixels < size - 0.5).all(1)
    hidden = inside & _hidden(view, pixels, depths, surface)
    shape = points.shape[:2]
    heights = view.matrix[1, 1] * statures / np.maximum(depths.reshape(shape).mean(1), 0.1)
    return Sight(pixels.reshape(*shape, 2), inside.reshape(shape), hidden.reshape(shape), heights)


def _hidden(
    view: View, pixels: Float[np.ndarray, "n 2"], depths: Float[np.ndarray, "n"], surface: Mesh
) -> Bool[np.ndarray, "n"]:
    """Whether points lie 13 cm or more behind a surface: their own flesh does not hide them."""
    coarse = 4  # pixels of a picture are one of the depth map's
    window = Window(0, 0, -(-view.width // coarse), -(-view.height // coarse))
    corners, corner_depths = view.project(surface.vertices)
    hits = rasterize((corners - (coarse - 1) / 2.0) / coarse, corner_depths, surface.faces, window)
    nearest = np.full((window.height, window.width), np.inf)
    nearest[hits.rows, hits.columns] = hits.depths
    column, row = np.clip(np.nan_to_num(pixels / coarse).astype(int), 0, [window.width - 1, window.height - 1]).T
    return nearest[row, column] < depths - 0.13
