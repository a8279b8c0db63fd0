"""The photographs of the empty scene, held against the clip: moved and matched where that is sure, else left out.

Photographs of example poses show the empty scene, too, outside of the subject's mask.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.errors import InputError
from sogjax.io.image_file import read_mask
from sogjax.io.recording import Recording
from sogjax.io.video import read_still
from sogjax.run.clip import Clip, SampleKind, spread_frames
from sogjax.run.terminal import say
from sogjax.scene.background import BackgroundImage
from sogjax.scene.background_difference import background_difference, disc, working_size
from sogjax.scene.plates import FittedPlate, fitted_plate, median_picture

LOOKED_AT = 9
"""Frames whose median is what a camera shows; somebody who moves is not in it."""
SCENE_SECONDS = 10.0
"""Seconds of the recording that they are spread over, at least: who hardly moved in a shorter clip is in the median."""
BORDER = 0.02
"""Width left out around masks, and around what differs from the clip, as a part of a picture's longer side: masks are
rough, shadows begin there."""


def scene_samples(clip: Clip) -> SampleKind:
    """The pictures that photographs of the empty scene are held against: of the clip, or around a short one."""
    first, last = sorted((clip.numbers[0], clip.numbers[-1]))
    wanted, every = round(SCENE_SECONDS * clip.recording.fps), clip.recording.frames
    first = max(min(first, (first + last - wanted) // 2, every[-1] - wanted), every[0])
    frames = range(first, min(max(last, first + wanted), every[-1]) + 1)
    return SampleKind.at_working_size(f"scene_{first}_{frames[-1]}", clip.recording, spread_frames(frames, LOOKED_AT))


def fitted_plates(clip: Clip, more: Sequence[SampleKind] = ()) -> dict[str, FittedPlate]:
    """The picture of the empty scene of each camera that has one, as the videos would show it.

    `more` are samples that will be needed too, and are taken on the way.

    Raises:
        InputError: a picture or video cannot be read.
    """
    recording, kind = clip.recording, scene_samples(clip)
    shown = clip.sampled([kind, *more])[0]

    def fitted(name: str) -> FittedPlate:
        of_camera = shown[recording.rig.names.index(name)]
        plate, frames = (
            read_still(recording, name, recording.background[name]),
            list(map(np.asarray, of_camera.values())),
        )
        return fitted_plate(plate, median_picture(frames)) if frames else FittedPlate.unseen(plate)

    names = [name for name in recording.rig.names if name in recording.background]
    with ThreadPoolExecutor() as pool:
        return dict(zip(names, pool.map(fitted, names), strict=True))


def say_plates(clip: Clip, plates: Mapping[str, FittedPlate], choice: str) -> list[str]:
    """Say what is to be said of the pictures; returns the cameras whose pictures cannot be used.

    Raises:
        InputError: one cannot be used, and pictures were asked for (`choice`).
    """
    paths = clip.recording.background
    for name, plate in plates.items():
        said = plate.said(str(paths[name]))
        if said is not None and not plate.fits and choice == "pictures":
            raise InputError(f"{said}; or set images.background=auto to do without it")
        if said is not None:
            say(f"warning: {said}")
    return [name for name, plate in plates.items() if not plate.fits]


def with_example_plates(
    clip: Clip, learnt: Sequence[BackgroundImage] | None
) -> tuple[tuple[BackgroundImage, ...] | None, float]:
    """The background with what photographs of example poses show of the empty scene, where it is not known else.

    Only pictures with masks count, as far as they agree with the clip; where no background is given, every camera must
    have one. Also returns what part of the pictures they add; with nothing to add, what was given comes back.

    Raises:
        InputError: a picture, mask or video cannot be read.
    """
    recording = clip.recording
    names = [name for name in recording.rig.names if _masked_pictures(recording, name)]
    given = None if learnt is None else tuple(learnt)
    if not names:
        return given, 0.0
    shown = clip.sampled([scene_samples(clip)])[0]

    def filled(camera: int) -> BackgroundImage:
        name, frames = recording.rig.names[camera], list(map(np.asarray, shown[camera].values()))
        own = given[camera] if given else unseen_background(recording, name)
        return _filled(own, _example_plates(recording, name, frames)) if frames and name in names else own

    with ThreadPoolExecutor() as pool:
        found = tuple(pool.map(filled, range(len(shown))))
    known = lambda cameras: float(np.mean([camera.known.mean() for camera in cameras]))
    added = known(found) - (known(given) if given else 0.0)
    enough = given is not None or all(camera.known.any() for camera in found)
    return (found, added) if added and enough else (given, 0.0)


def unseen_background(recording: Recording, camera: str) -> BackgroundImage:
    """A background that photographs will fill: not one to learn again from a clip that is unsuitable."""
    return replace(BackgroundImage.nothing(*working_size(*recording.rig.image_size(camera))), origin="picture")


def _masked_pictures(recording: Recording, camera: str) -> list[tuple[Path, Path]]:
    """The pictures of example poses of a camera, with their masks."""
    return [
        (example.images[camera], example.masks[camera])
        for example in recording.example_poses
        if camera in example.images and camera in example.masks
    ]


def _example_plates(
    recording: Recording, camera: str, frames: Sequence[UInt8[np.ndarray, "rows columns 3"]]
) -> list[FittedPlate]:
    """The pictures of example poses that fit, where they show no subject and what the clip shows, at the frames' size.

    Where they differ from the clip, the subject may stand there in all of it, or a table was brought in since.
    """
    scene, found = median_picture(frames), []
    size = (scene.shape[1], scene.shape[0])
    border = disc(2 * round(BORDER * max(size)) + 1)
    for picture, mask in _masked_pictures(recording, camera):
        subject = cv2.resize(read_mask(mask).astype(np.uint8), size, interpolation=cv2.INTER_AREA)
        plate = fitted_plate(
            cv2.resize(read_still(recording, camera, picture), size, interpolation=cv2.INTER_AREA), scene
        )
        away = tuple(round(part) for part in plate.shift)
        subject = np.roll(cv2.dilate(subject, border), away[::-1], (0, 1)) > 0
        if plate.fits:
            changed = cv2.dilate(background_difference(scene, plate.picture).changed.astype(np.uint8), border) > 0
            found.append(replace(plate, known=plate.known & ~subject & ~changed))
    return found


def _filled(own: BackgroundImage, plates: Sequence[FittedPlate]) -> BackgroundImage:
    """A background with the median of some pictures where it is not known and they are."""
    if not plates:
        return own
    there = np.any([plate.known for plate in plates], axis=0)
    shown: Float[np.ndarray, "rows columns 3"] = np.zeros((*there.shape, 3))
    values = np.ma.masked_array(
        [plate.picture[there] for plate in plates],
        [np.repeat(~plate.known[there][:, None], 3, axis=1) for plate in plates],
    )
    shown[there] = np.ma.median(values, axis=0)
    return own.filled(replace(BackgroundImage.from_photograph(np.rint(shown).astype(np.uint8)), known=there))
