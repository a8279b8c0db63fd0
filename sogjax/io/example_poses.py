"""Example poses: what `recording.yaml` lists of them, and their images, matched to the cameras by name."""

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Bool

from sogjax.errors import InputError
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.files import visible_files
from sogjax.io.image_file import IMAGE_SUFFIXES, read_image, read_mask, read_painted
from sogjax.io.pose_description import PoseDescription, parse_initial_pose
from sogjax.io.yaml_entry import Entry


@dataclass(frozen=True)
class ExampleSettings:
    """An entry of `example_poses`."""

    name: str
    actor: str | None = None
    initial_pose: PoseDescription | None = None
    frame: int | None = None
    """The frame of the videos, in the recording's own numbering; None: the pictures lie in the folder `name`."""


def read_examples(entry: Entry) -> tuple[ExampleSettings, ...]:
    """The list `example_poses`: frame numbers, and mappings with the `name` of a folder or a `frame`."""
    examples: list[ExampleSettings] = []
    for item in entry.items():
        example = _example(item)
        if any(_repeats(example, other) for other in examples):
            key = "name" if example.frame is None else "frame"
            repeated = item.mapping()[key] if isinstance(item.value, dict) else item
            raise repeated.error("each folder once, and each frame once for an actor")
        examples.append(example)
    return tuple(examples)


def _repeats(one: ExampleSettings, other: ExampleSettings) -> bool:
    """Whether two entries show the same; a frame may show several actors, each by its name."""
    several = one.frame is not None and None not in (one.actor, other.actor) and one.actor != other.actor
    return one.name == other.name and not several


def _example(entry: Entry) -> ExampleSettings:
    if not isinstance(entry.value, dict):
        frame = _frame(entry)
        return ExampleSettings(frame_name(frame), frame=frame)
    key = "frame" if "frame" in entry.value else "name"
    given = entry.given(("actor", "initial_pose"), required=(key,))
    frame = _frame(given["frame"]) if key == "frame" else None
    return ExampleSettings(
        name=given["name"].file_name("the name of a folder in example_poses/") if frame is None else frame_name(frame),
        actor=given["actor"].file_name() if "actor" in given else None,
        initial_pose=parse_initial_pose(given["initial_pose"]) if "initial_pose" in given else None,
        frame=frame,
    )


def _frame(entry: Entry) -> int:
    return entry.whole("the number of a frame of the videos, or {name: FOLDER} or {frame: NUMBER} with its keys")


def frame_name(frame: int) -> str:
    """How the example pose that a frame of the videos shows is called."""
    return f"frame_{frame}"


@dataclass(frozen=True)
class ExamplePose:
    """Images of a subject in a pose that shows its size and colours (Section 5.2)."""

    name: str
    actor: str | None
    images: dict[str, Path]
    """The picture of each camera."""
    masks: dict[str, Path]
    """The mask of each camera that has one; white = subject."""
    initial_pose: PoseDescription | None
    frame: int | None = None
    """The recording's number, where the images are a frame of the videos; None: they are files."""
    within: dict[str, Bool[np.ndarray, "_rows _columns"]] | None = None
    """Where each camera sees the subject, at any size, if others are seen too; a camera without an entry is not used.
    None: nobody else is seen."""
    others: dict[str, Bool[np.ndarray, "_rows _columns"]] | None = None
    """Where these cameras see others who are not hidden from them, at any size. None: nobody else is seen."""

    def of_everybody(self, cameras: Iterable[str]) -> "ExamplePose":
        """The same pictures with all people in them as the subject: nobody else is anywhere."""
        nowhere = np.zeros((1, 1), bool)
        return replace(self, within=None, others=dict.fromkeys(cameras, nowhere))


def find_background(folder: Path, rig: CameraRig, calibrated: Iterable[str]) -> dict[str, Path]:
    """The images of the empty scene in `folder`, by camera of `rig` that has one.

    Raises:
        InputError: an image of no calibrated camera, of another size, or one that does not open.
    """
    images = _by_camera(folder, calibrated, mask=False)
    images = {camera: images[camera] for camera in rig.names if camera in images}
    _check_sizes(rig, images, {})
    return images


def find_occluders(folder: Path, rig: CameraRig, calibrated: Iterable[str]) -> dict[str, Path]:
    """The pictures of what stands in front in `folder`, by camera of `rig` that has one.

    Raises:
        InputError: an image of no calibrated camera, of another size than its pictures, or one that does not open.
    """
    images = _by_camera(folder, calibrated, mask=False)
    images = {camera: images[camera] for camera in rig.names if camera in images}
    for camera, path in images.items():
        height, width = read_painted(path).shape
        if (width, height) != rig.image_size(camera):
            wanted = "{}x{}".format(*rig.image_size(camera))
            raise InputError(
                f"{path}: is {width}x{height}, but the pictures of {camera!r} are {wanted}; paint what stands in front "
                "in white over one of them, and keep its size"
            )
    return images


def find_example_poses(
    folder: Path,
    rig: CameraRig,
    calibrated: Iterable[str],
    settings: tuple[ExampleSettings, ...] | None,
    frames: range | None,
) -> tuple[ExamplePose, ...]:
    """The example poses: those that `settings` of recording.yaml list, else one for every folder in `folder`.

    `rig` has the cameras that are used, of all that are `calibrated`; `frames` are the numbers of the frames of the
    videos, None where they are not known.

    Raises:
        InputError: a listed one is missing or empty, an image or mask does not fit its camera, or there is no such
            frame.
    """
    if settings is None:
        settings = tuple(ExampleSettings(path.name) for path in visible_files(folder) if path.is_dir())
    return tuple(
        _from_images(folder / entry.name, rig, calibrated, entry)
        if entry.frame is None
        else _from_videos(folder, entry, entry.frame, frames or range(entry.frame, entry.frame + 1))
        for entry in settings
    )


def _from_videos(folder: Path, entry: ExampleSettings, frame: int, frames: range) -> ExamplePose:
    if frame not in frames:
        raise InputError(
            f"{folder.parent / 'recording.yaml'}: example_poses: there is no frame {frame}; "
            f"the frames are {frames[0]} to {frames[-1]}"
        )
    return ExamplePose(entry.name, entry.actor, {}, {}, entry.initial_pose, frame)


def _from_images(folder: Path, rig: CameraRig, calibrated: Iterable[str], entry: ExampleSettings) -> ExamplePose:
    if not folder.is_dir():
        raise InputError(f"{folder}: there is no such example pose; make the folder or correct recording.yaml")
    images, masks = (_by_camera(folder, calibrated, mask) for mask in (False, True))
    for camera, mask in masks.items():
        if camera not in images:
            raise InputError(f"{mask}: is a mask without its image; add {camera}.jpg or {camera}.png")
    images, masks = ({name: paths[name] for name in rig.names if name in paths} for paths in (images, masks))
    if not images:
        raise InputError(f"{folder}: holds no image of any camera; put CAMERA.jpg files there or remove it")
    _check_sizes(rig, images, masks)
    return ExamplePose(entry.name, entry.actor, images, masks, entry.initial_pose)


def _by_camera(folder: Path, calibrated: Iterable[str], mask: bool) -> dict[str, Path]:
    """The masks of a folder, or its other images, by the cameras that they are named after."""
    suffix = ".mask.png"
    found: dict[str, Path] = {}
    for path in visible_files(folder):
        if path.suffix.lower() not in IMAGE_SUFFIXES or path.name.endswith(suffix) != mask:
            continue
        camera = path.name.removesuffix(suffix).removesuffix(path.suffix)
        if camera not in calibrated:
            raise InputError(
                f"{path}: there is no camera {camera!r} in the calibration, which has: "
                f"{', '.join(sorted(calibrated))}; rename or remove the image"
            )
        if camera in found:
            raise InputError(f"{folder}: holds both {found[camera].name} and {path.name}; remove one")
        found[camera] = path
    return found


def _check_sizes(rig: CameraRig, images: dict[str, Path], masks: dict[str, Path]) -> None:
    with ThreadPoolExecutor() as pool:
        image_shapes = list(pool.map(lambda path: read_image(path).shape, images.values()))
        mask_shapes = list(pool.map(lambda path: read_mask(path).shape, masks.values()))
    for (camera, path), (height, width, _) in zip(images.items(), image_shapes, strict=True):
        check_size(path, (width, height), rig, camera)
    for (camera, path), (height, width) in zip(masks.items(), mask_shapes, strict=True):
        if (width, height) != rig.image_size(camera):
            wanted = "{}x{}".format(*rig.image_size(camera))
            raise InputError(f"{path}: the mask is {width}x{height}, its image {wanted}; make them the same size")


def check_size(path: Path, size: tuple[int, int], rig: CameraRig, camera: str) -> None:
    """Check the (width, height) of images against the calibration.

    Raises:
        InputError: they differ.
    """
    width, height = calibrated = rig.image_size(camera)
    if size == calibrated:
        return
    remedy = "convert the images to that size, or calibrate theirs, if all of this camera have it"
    if size == (height, width):
        remedy = "turn the images by 90 degrees, or calibrate them as they stand"
    raise InputError(
        f"{path}: its images are {size[0]}x{size[1]}, but the calibration of {camera!r} is for "
        f"{width}x{height}; {remedy}"
    )
