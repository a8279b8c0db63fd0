"""The masks of an example pose: from files, else from the empty scene, without wrong ones."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import Bool, UInt8

from sogjax.errors import InputError, counted
from sogjax.io.example_poses import ExamplePose
from sogjax.io.image_file import read_mask
from sogjax.io.painted import painted_masks
from sogjax.io.recording import Recording
from sogjax.io.video import read_still
from sogjax.model.camera import Camera
from sogjax.model.rotation import axis_vector
from sogjax.scene.background import BackgroundImage
from sogjax.scene.background_difference import working_size
from sogjax.scene.coarse_views import enlarged
from sogjax.scene.plates import FittedPlate, fitted_plate
from sogjax.scene.segmentation import FoundMasks, largest_parts, masks_from_backgrounds
from sogjax.scene.visual_hull import AGREEING, disagreeing_cameras, hull_coverage

MOST_WRONG = 0.25
"""Share of the cameras whose masks may disagree with the others before nothing is said where the background is unknown.
Colours tell who stands still from the room, but not from a table and a chair."""
FROM_FILE, FROM_PHOTOGRAPH, FROM_CLIP = "file", "empty scene", "background from the clip"

Mask = Bool[np.ndarray, "_h _w"]


@dataclass(frozen=True)
class ExampleMasks:
    """The masks of one example pose by camera (its index in the rig), of the pictures' size."""

    masks: dict[int, Mask]
    origins: dict[int, str]
    """`FROM_FILE`, `FROM_PHOTOGRAPH` or `FROM_CLIP`, of masks that are left out too."""
    left_out: dict[int, Mask]
    """Masks that do not agree with the others."""
    untold: dict[int, Mask]
    """Where a mask says nothing: something stands in front, or what is behind is unknown and colours do not tell.

    Beside other people colours alone do not tell that nobody is there."""
    undecided: bool
    """Whether that is so for the second reason."""
    warnings: tuple[str, ...]
    """One sentence each."""


def example_masks(
    recording: Recording,
    example: ExamplePose,
    images: Mapping[int, UInt8[np.ndarray, "_h _w 3"]],
    learnt: Sequence[BackgroundImage] | None = None,
    known: dict[bool, FoundMasks] | None = None,
) -> ExampleMasks:
    """Find the masks of one example pose.

    `images` are those of all its cameras, `learnt` is the background of every camera of the recording, as its videos
    show it: for frames of these, and where there is neither a mask nor a picture of the empty scene. A photograph is
    compared with the picture of the empty scene, moved to its place if the camera was touched in between. `known` keeps
    what is told from the background, for the next subject that the same pictures show.

    Raises:
        InputError: fewer than two cameras have a picture and a mask, or one of the empty scene; a mask that is empty
            or full.
    """
    names = recording.rig.names
    files = {camera: _checked_mask(example.masks[names[camera]]) for camera in images if names[camera] in example.masks}
    plates = {
        camera: _plate_of(recording, names[camera], images[camera])
        for camera in images
        if camera not in files and names[camera] in recording.background and not (learnt and example.frame is not None)
    }
    photographed = {camera: plate.picture for camera, plate in plates.items()}
    from_clip = {
        camera: learnt[camera]
        for camera in images
        if learnt and camera not in files and camera not in photographed and learnt[camera].known.any()
    }
    backgrounds = photographed | {camera: background.picture for camera, background in from_clip.items()}
    unknown = {camera: ~plate.known for camera, plate in (plates | from_clip).items() if not plate.known.all()}
    of_clip = [camera for camera, background in from_clip.items() if background.origin == "clip"]
    _check_count(recording, example, len(images), [*files, *backgrounds])
    cameras = {camera: recording.rig.camera(names[camera]) for camera in images}
    up = axis_vector(recording.up)
    calm = {camera: background.calm for camera, background in from_clip.items()}
    known = {} if known is None else known

    def make(decide: bool) -> FoundMasks:
        if decide not in known:
            known[decide] = masks_from_backgrounds(
                images, backgrounds, files, cameras, up, unknown, calm, decide, learnt=of_clip
            )
        return known[decide]

    alone = lambda made: _subject_alone(example, names, dict(sorted({**files, **made}.items())))
    made, by_colors = make(True) if backgrounds else FoundMasks({}, {})
    found = alone(made)
    _check_found(recording, example, list(found), [camera for camera in backgrounds if camera not in found])
    painted = {camera: mask for camera, mask in enumerate(painted_masks(recording)) if mask is not None}
    told, undecided = _Told.of_masks(found, cameras, painted), False
    if unknown and example.within is None and example.others is None and len(told.wrong) > MOST_WRONG * len(found):
        certain = _Told.of_masks(alone(make(False).masks), cameras, _with_unknown(painted, unknown, images))
        undecided = len(certain.right) > len(told.right)
        made, told = (certain.found, certain) if undecided else (made, told)
    masks = told.right
    warnings = [_unlike(example, names[camera], share) for camera, share in told.wrong.items()]
    warnings += [_moved(recording, example, names[k], plate) for k, plate in plates.items() if plate.pixels]
    warnings += [_no_subject(recording, example, names[camera]) for camera in backgrounds if camera not in made]
    if len(masks) == 2 and (share := min(hull_coverage(masks, cameras, told.hidden).values())) < AGREEING:
        pair = " and ".join(names[camera] for camera in masks)
        warnings.append(
            f"example pose {example.name!r}: the masks of {pair} agree by only {share:.0%}; look at them with "
            "`sogjax segment` and replace the wrong one, or add a camera"
        )
    untold = {k: told.hidden[k] & ~masks[k] for k in masks if k in told.hidden}
    for k, mask in _beside_others(example, names, made, by_colors).items():
        if k in masks:
            untold[k] = untold.get(k, False) | (mask & ~masks[k])
    return ExampleMasks(
        masks=masks,
        origins={k: FROM_FILE if k in files else FROM_CLIP if k in of_clip else FROM_PHOTOGRAPH for k in told.found},
        left_out={camera: told.found[camera] for camera in told.wrong},
        undecided=undecided,
        untold=untold,
        warnings=tuple(warnings),
    )


def _beside_others(
    example: ExamplePose, names: Sequence[str], made: Mapping[int, Mask], by_colors: Mapping[int, Mask]
) -> dict[int, Mask]:
    """Beside other people, where colours alone tell, or the mask was cut, but not where others are; else nothing.

    Heads and forearms of the floor's colour are cut off there: they would make a body shorter.
    """
    found, seen = dict[int, Mask](), example.others or {}
    for k in made.keys() & by_colors.keys():
        if (others := seen.get(names[k])) is not None:
            found[k] = (made[k] | by_colors[k]) & ~enlarged(others, made[k].shape)
    return found


@dataclass(frozen=True)
class _Told:
    """Masks of one subject, and which of them the others do not confirm."""

    found: dict[int, Mask]
    wrong: dict[int, float]
    """What part of each the others confirm."""
    hidden: dict[int, Mask]
    """Where masks say nothing."""

    @classmethod
    def of_masks(cls, found: dict[int, Mask], cameras: Mapping[int, Camera], hidden: dict[int, Mask]) -> "_Told":
        """The masks held against each other; a single one is confirmed by none."""
        enough = len(found) >= 2
        return cls(found, disagreeing_cameras(found, cameras, hidden) if enough else dict.fromkeys(found, 0.0), hidden)

    @property
    def right(self) -> dict[int, Mask]:
        """The masks that agree."""
        return {camera: mask for camera, mask in self.found.items() if camera not in self.wrong}


def _with_unknown(
    hidden: Mapping[int, Mask], unknown: Mapping[int, Mask], images: Mapping[int, UInt8[np.ndarray, "_h _w 3"]]
) -> dict[int, Mask]:
    """Where masks say nothing, at the pictures' size, if that is so where the background is unknown, too."""
    sized = {k: enlarged(mask, images[k].shape) for k, mask in unknown.items()}
    return {**hidden} | {k: mask | hidden[k] if k in hidden else mask for k, mask in sized.items()}


def _plate_of(recording: Recording, camera: str, image: UInt8[np.ndarray, "_h _w 3"]) -> FittedPlate:
    """The picture of the empty scene, at the place of a photograph of the subject; its light does not matter here."""
    plate = read_still(recording, camera, recording.background[camera])
    size = working_size(image.shape[1], image.shape[0])
    found = fitted_plate(plate, cv2.resize(image, size, interpolation=cv2.INTER_AREA), same_light=True)
    return found if found.pixels else FittedPlate.unseen(plate)


def _moved(recording: Recording, example: ExamplePose, camera: str, plate: FittedPlate) -> str:
    return (
        f"example pose {example.name!r}: {recording.background[camera]} is {plate.pixels:.1f} pixels beside its "
        f"picture of {camera}, and was moved; take both without touching the camera in between"
    )


def _subject_alone(example: ExamplePose, names: Sequence[str], masks: Mapping[int, Mask]) -> dict[int, Mask]:
    """The masks without other people, of the cameras that show the subject apart from them."""
    if example.within is None:
        return dict(masks)
    alone: dict[int, Mask] = {}
    for camera, mask in masks.items():
        if (region := example.within.get(names[camera])) is not None:
            alone[camera] = largest_parts(mask & enlarged(region, mask.shape))
    return {camera: mask for camera, mask in alone.items() if mask.any()}


def _checked_mask(path: Path) -> Mask:
    mask = read_mask(path)
    if mask.all() or not mask.any():
        raise InputError(f"{path}: the mask is {'full' if mask.all() else 'empty'}; white must mark the subject")
    return mask


def _check_count(recording: Recording, example: ExamplePose, num_images: int, usable: list[int]) -> None:
    """Check that at least two cameras have a mask or a picture of the empty scene, as a pose needs."""
    if len(usable) >= 2:
        return
    where = f"{recording.path / 'example_poses' / example.name}: the example pose {example.name!r}"
    if num_images < 2:
        raise InputError(
            f"{where} has pictures of {num_images} of the cameras {', '.join(recording.rig.names)}; "
            "give CAMERA.jpg of at least two, or remove the pose"
        )
    shown = recording.rig.names if example.frame is not None else example.images
    missing = [name for k, name in enumerate(recording.rig.names) if name in shown and k not in usable]
    raise InputError(
        f"{where} has {counted(len(usable), 'picture')} with a mask or an empty background picture, and at least two "
        f"are needed; add CAMERA.mask.png (white = subject) beside the pictures, or the empty scene as "
        f"{recording.path / 'background'}/CAMERA.jpg, for {', '.join(missing)}"
    )


def _check_found(recording: Recording, example: ExamplePose, found: list[int], failed: list[int]) -> None:
    if len(found) >= 2:
        return
    names = ", ".join(recording.rig.names[camera] for camera in failed)
    raise InputError(
        f"{recording.path / 'example_poses' / example.name}: in the pictures of {names} no subject can be told apart "
        f"from the empty scene in {recording.path / 'background'}; give CAMERA.mask.png (white = subject), or pictures "
        "of the empty scene from the same places in the same light"
    )


def _unlike(example: ExamplePose, camera: str, share: float) -> str:
    why = (
        f"its mask does not agree with the other cameras ({share:.0%} of it does)"
        if share < AGREEING
        else "the other cameras agree better without its mask, which may lack a part of the subject"
    )
    return (
        f"example pose {example.name!r}: {camera} is left out, since {why}; look at it with `sogjax segment`, and "
        f"give {camera}.mask.png"
    )


def _no_subject(recording: Recording, example: ExamplePose, camera: str) -> str:
    empty = recording.background.get(camera, "the background learnt from the clip")
    return (
        f"example pose {example.name!r}: {camera} is left out, since no subject can be told apart from {empty}; "
        f"give {camera}.mask.png"
    )
