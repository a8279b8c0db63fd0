"""Films a stage with some of its cameras: plates, stills and videos."""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.io import recording_files
from sogjax.io.files import atomic_path
from sogjax.io.video import VideoWriter
from sogjax.synth.anatomy import Pose
from sogjax.synth.exercises import EXAMPLE_POSES
from sogjax.synth.light import drifted
from sogjax.synth.picture import Person, Shadows, Shot, mask_of, shot_of
from sogjax.synth.plate import Plate, plate_of
from sogjax.synth.scene import Scene
from sogjax.synth.settings import SynthSettings
from sogjax.synth.stage import Stage

_JPEG_QUALITY = 95
_NOISE, _VIDEO, _STILL, _EMPTY = 7, 0, 1, 2
"""Streams of random numbers: pictures have the same noise whichever process renders them."""


def num_pictures(settings: SynthSettings) -> int:
    """How many pictures a recording takes, which is how often `film` yields for all cameras together."""
    stills = len(EXAMPLE_POSES) * settings.actors if settings.example_poses else 0
    return settings.cameras * (1 + stills + settings.frames)


def example_folder(stage: Stage, actor: int, pose: str) -> str:
    """Name of the folder of an example pose."""
    return pose if stage.settings.actors == 1 else f"{stage.settings.actor_names[actor]}_{pose}"


def film(stage: Stage, cameras: Sequence[int], folder: Path) -> Iterator[None]:
    """Write everything that some cameras see into a recording's folder; yields after each picture."""
    plates = {}
    for camera in cameras:
        plates[camera] = plate_of(stage.scene, stage.views[camera])
        if stage.settings.background:
            empty = stage.sensors[camera].exposed(plates[camera].total, _rng(stage, camera, _EMPTY, 0))
            _write_image(recording_files.BACKGROUND.of(folder) / f"{stage.views[camera].name}.jpg", empty)
        yield
    if stage.settings.example_poses:
        yield from _stills(stage, _bare(stage, plates), folder)
    yield from _videos(stage, plates, folder)


def _bare(stage: Stage, plates: dict[int, Plate]) -> dict[int, Plate]:
    """The plates of the stills, which are taken before tables and chairs are brought in."""
    if stage.scene is stage.bare:
        return plates
    return {camera: plate_of(stage.bare, stage.views[camera]) for camera in plates}


def _stills(stage: Stage, plates: dict[int, Plate], folder: Path) -> Iterator[None]:
    for actor, person in enumerate(stage.people):
        for number, pose in enumerate(EXAMPLE_POSES):
            shots = _shots(stage.bare, stage, plates, [person], [stage.example_pose(actor, pose)])
            place = recording_files.EXAMPLE_POSES.of(folder) / example_folder(stage, actor, pose)
            for camera, shot in shots:
                rng = _rng(stage, camera, _STILL, 10 * actor + number)
                name = stage.views[camera].name
                _write_image(place / f"{name}.jpg", stage.sensors[camera].exposed(shot.light, rng))
                _write_image(place / f"{name}.mask.png", np.uint8(255) * mask_of(shot).astype(np.uint8))
                yield


def _videos(stage: Stage, plates: dict[int, Plate], folder: Path) -> Iterator[None]:
    with ExitStack() as stack:
        writers = {}
        for camera in plates:
            path = recording_files.VIDEOS.of(folder) / f"{stage.views[camera].name}.mp4"
            writers[camera] = stack.enter_context(VideoWriter(path, stage.settings.fps))
        for frame in range(stage.settings.frames):
            for camera, shot in _shots(stage.scene, stage, plates, stage.people, stage.poses(frame)):
                rng = _rng(stage, camera, _VIDEO, frame)
                writers[camera].write(stage.sensors[camera].exposed(_drifted(stage, shot, frame), rng))
                yield


def _drifted(stage: Stage, shot: Shot, frame: int) -> Float[np.ndarray, "row column 3"]:
    """The light of a shot under the room's light at a frame."""
    drift = stage.settings.light_drift
    return shot.light * drifted(drift, frame / max(stage.settings.frames - 1, 1)) if drift else shot.light


def _shots(
    scene: Scene, stage: Stage, plates: dict[int, Plate], people: Sequence[Person], poses: Sequence[Pose]
) -> Iterator[tuple[int, Shot]]:
    """What each camera sees of people in poses; surface and shadows are made once for all cameras."""
    meshes = [person.figure.posed(pose) for person, pose in zip(people, poses, strict=True)]
    furniture = None if scene.props is None else scene.shadow
    shadows = Shadows.of(meshes, furniture) if stage.settings.shadows else None
    for camera, plate in plates.items():
        yield camera, shot_of(stage.views[camera], plate, people, meshes, shadows)


def _rng(stage: Stage, camera: int, kind: int, number: int) -> np.random.Generator:
    return np.random.default_rng([stage.settings.seed, _NOISE, camera, kind, number])


def _write_image(path: Path, image: UInt8[np.ndarray, "..."]) -> None:
    parameters = [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY] if path.suffix == ".jpg" else []
    encoded = cv2.imencode(path.suffix, image, parameters)[1]
    with atomic_path(path) as temporary:
        temporary.write_bytes(encoded.tobytes())
