"""Where the subject is in the pictures: masks of example poses and of a few frames of the videos.

Whether each video shows what its camera's still pictures show, or names were mixed up, or cameras moved.
"""

from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from sogjax.check.clip import Clip, working_picture
from sogjax.check.findings import Finding
from sogjax.io.example_poses import ExamplePose
from sogjax.io.image_file import read_mask
from sogjax.io.recording import Recording
from sogjax.io.video import read_prepared, read_still
from sogjax.scene.plate_difference import plate_difference, reduced_mask
from sogjax.scene.segmentation import first_guess, is_subject

MOST_POSES = 2

Mask = Bool[np.ndarray, "_h _w"]
Picture = UInt8[np.ndarray, "_h _w 3"]


@dataclass(frozen=True)
class Moment:
    """One moment as all cameras show it, at the working size of masks."""

    label: str
    filmed: bool
    """From the videos; else photographed as an example pose."""
    pictures: dict[int, Picture]
    """By camera (its index in the rig) that is present, BGR."""
    masks: dict[int, Mask]
    """By camera; absent where no subject was found."""


def example_moments(recording: Recording) -> list[Moment]:
    """The first few example poses, with their masks, or masks made from the empty background pictures."""
    plates = plates_of(recording)
    pictured = [example for example in recording.example_poses if example.frame is None]
    return [_example_moment(recording, example, plates) for example in pictured[:MOST_POSES]]


def video_moments(clip: Clip, offsets: Sequence[int]) -> list[Moment]:
    """A few frames of the videos, each camera `offsets` frames later, with masks where there are plates.

    Raises:
        InputError: a video that ends early.
    """
    recording = clip.recording
    plates = plates_of(recording)
    stills = clip.stills if not any(offsets) else _stills_apart(clip, offsets)
    with ThreadPoolExecutor() as pool:
        moments = []
        for index, pictures in stills.items():
            masks = pool.map(lambda k, shown=pictures: _from_plate(shown[k], plates.get(k)), pictures)
            found = {camera: mask for camera, mask in zip(pictures, masks, strict=True) if mask is not None}
            moments.append(Moment(f"frame {clip.frame_number(index)}", True, pictures, found))
    return moments


def without_masks_of(moment: Moment, cameras: Collection[int]) -> Moment:
    """A moment without the masks of some cameras, whose pictures show another place than their plates."""
    return replace(moment, masks={camera: mask for camera, mask in moment.masks.items() if camera not in cameras})


def plates_of(recording: Recording) -> dict[int, Picture]:
    """The pictures of the empty scene by camera (its index in the rig), at the working size."""
    names = recording.rig.names
    return {
        camera: working_picture(read_still(recording, name, recording.background[name]))
        for camera, name in enumerate(names)
        if name in recording.background
    }


def _example_moment(recording: Recording, example: ExamplePose, plates: Mapping[int, Picture]) -> Moment:
    names = recording.rig.names
    shown = [camera for camera, name in enumerate(names) if name in example.images]
    with ThreadPoolExecutor() as pool:
        pictures = dict(
            zip(shown, pool.map(lambda k: _example_picture(recording, example, names[k]), shown), strict=True)
        )
        find = lambda k: _example_mask(example, names[k], pictures[k], plates.get(k))
        masks = dict(zip(shown, pool.map(find, shown), strict=True))
    return Moment(
        f"example pose {example.name}", False, pictures, {k: mask for k, mask in masks.items() if mask is not None}
    )


def _example_picture(recording: Recording, example: ExamplePose, name: str) -> Picture:
    return working_picture(read_still(recording, name, example.images[name]))


def _example_mask(example: ExamplePose, name: str, picture: Picture, plate: Picture | None) -> Mask | None:
    if name not in example.masks:
        return _from_plate(picture, plate)
    mask = reduced_mask(read_mask(example.masks[name]))
    return mask if mask.any() and not mask.all() else None


def _from_plate(picture: Picture, plate: Picture | None) -> Mask | None:
    """What differs from the empty scene; None where there is no plate or no subject."""
    if plate is None:
        return None
    guess = first_guess(plate_difference(picture, plate))
    return guess if is_subject(guess) else None


def _at_working_size(camera: int, image: np.ndarray | None) -> Picture | None:
    return None if image is None else working_picture(image)


def _stills_apart(clip: Clip, offsets: Sequence[int]) -> dict[int, dict[int, Picture]]:
    """The pictures as they belong together with other offsets, read again."""
    names = clip.recording.rig.names
    moved = {name: clip.recording.frame_offset[name] + int(more) for name, more in zip(names, offsets, strict=True)}
    recording = replace(clip.recording, frame_offset=moved)
    border = int(np.abs(offsets).max())
    stills = {}
    for index in sorted({int(np.clip(k, border, max(clip.num_frames - 1 - border, border))) for k in clip.stills}):
        frame = clip.first + index
        shown = next(read_prepared(recording, _at_working_size, frame, frame + 1))
        stills[index] = {camera: picture for camera, picture in enumerate(shown) if picture is not None}
    return stills


SIZE = (96, 72)
"""Pixels to which pictures are made smaller before they are compared."""
SAME = 0.55
"""Correlation of two pictures' fine structure above which they show the same place."""
MARGIN = 0.2


def references_of(plates: Mapping[int, Picture], photographed: Moment | None) -> dict[int, tuple[str, Picture]]:
    """By camera a still picture of what it sees: the empty scene, else an example pose."""
    found = (
        {camera: ("example pose", picture) for camera, picture in photographed.pictures.items()}
        if (photographed is not None)
        else {}
    )
    return {**found, **{camera: ("background picture", picture) for camera, picture in plates.items()}}


def place_findings(
    names: tuple[str, ...], references: Mapping[int, tuple[str, Picture]], filmed: Mapping[int, Picture]
) -> list[Finding]:
    """Videos (by camera a picture of each) that show what another camera's still pictures show, or what none shows."""
    likeness = place_likeness(references, filmed)
    findings, paired = [], set()
    for camera, row in likeness.items():
        if row[camera] >= SAME or camera in paired:
            continue
        other = max(row, key=row.__getitem__)
        label = references[camera][0]
        if row[other] < max(SAME, row[camera] + MARGIN):
            what = f"the video of {names[camera]} does not show the place of its {label} (likeness {row[camera]:.2f})"
            cause = "the camera was moved in between, or one of the files belongs to another camera"
            remedy = f"compare both; take the {label} again, or rename the file"
            findings.append(Finding("warning", "files", what, cause, remedy, (names[camera],)))
            continue
        back = likeness.get(other, {}).get(camera, 0.0)
        paired |= {camera, other} if back >= SAME else {camera}
        what = f"the video of {names[camera]} shows what the {references[other][0]} of {names[other]} shows"
        what += ", and the other way round" if back >= SAME else ""
        cause, remedy = "videos under the wrong names", f"swap the names of {names[camera]} and {names[other]}"
        findings.append(Finding("warning", "files", what, cause, remedy, (names[camera], names[other])))
    if likeness and not findings:
        findings.append(Finding("ok", "files", "every video shows the place that its camera's still pictures show"))
    return findings


def place_likeness(
    references: Mapping[int, tuple[str, Picture]], filmed: Mapping[int, Picture]
) -> dict[int, dict[int, float]]:
    """For each camera with a reference how alike its video's picture is with the reference of every camera."""
    structures = {camera: _structure(picture) for camera, (_, picture) in references.items()}
    rows = {}
    for camera in references.keys() & filmed.keys():
        own = _structure(filmed[camera])
        rows[camera] = {other: float((own * reference).mean()) for other, reference in structures.items()}
    return rows


def _structure(picture: Picture) -> Float[np.ndarray, "h w"]:
    """Edges and patterns of a picture, whatever its exposure: mean 0, variance 1."""
    grey = cv2.resize(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), SIZE, interpolation=cv2.INTER_AREA)
    light = np.log1p(grey.astype(np.float32))
    fine = light - cv2.GaussianBlur(light, (0, 0), 6.0)
    return (fine - fine.mean()) / max(float(fine.std()), 1e-6)
