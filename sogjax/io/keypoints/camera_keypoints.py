"""The keypoints of one camera: of a JSON file, a folder of them or an array, and whether they are of its pictures."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError, counted
from sogjax.io.keypoint_files import json_files
from sogjax.io.keypoints.formats import cleaned, read_pictures
from sogjax.io.keypoints.scheme import Person
from sogjax.io.npz_file import check_npy


def read_keypoint_array(path: Path) -> Float[np.ndarray, "camera frame all_keypoints 3"]:
    """Keypoints of one person: x, y in pixels and confidence, which is 1 where the file gives none.

    An array of one camera has no camera axis in the file. NaN stands for a keypoint that was not found.

    Raises:
        InputError: no npy, pickled objects inside, or an array of another form.
    """
    most_bytes = 4 * 2**30
    check_npy(path)
    if path.stat().st_size > most_bytes:
        raise InputError(f"{path}: is larger than {most_bytes} bytes; give a file of keypoints")
    try:
        values = np.load(path, allow_pickle=False, mmap_mode="r")
    except (OSError, ValueError, EOFError) as error:
        raise InputError(f"{path}: is not readable as npy ({error}); write it again") from error
    form = "(camera, frame, point, 2 or 3) or (frame, point, 2 or 3)"
    if values.dtype.kind not in "fiu" or values.ndim not in (3, 4) or values.shape[-1] not in (2, 3, 4):
        raise InputError(
            f"{path}: is of the shape {values.shape} and type {values.dtype}; keypoints are {form} numbers"
        )
    values = values[None] if values.ndim == 3 else values
    if values.shape[2] in (543, 553):  # MediaPipe's holistic model without and with irises: the body comes first
        values = values[:, :, :33]
    points = np.array(values[..., :2], np.float64)
    # A third number is MediaPipe's depth; only a fourth is a confidence.
    scores = np.array(values[..., 3]) if values.shape[-1] == 4 else np.ones(values.shape[:-1])
    scores = np.where(np.isfinite(points).all(-1), scores, 0.0)
    return cleaned(np.concatenate([points, scores[..., None]], axis=-1))


@dataclass(frozen=True)
class CameraKeypoints:
    """The people of a camera's pictures."""

    path: Path
    pictures: dict[int, tuple[Person, ...]]
    """The people of each picture, by its number as the files count."""
    warnings: tuple[str, ...] = ()

    @property
    def people(self) -> list[Person]:
        """The people of all pictures."""
        return [person for people in self.pictures.values() for person in people]


def read_camera(path: Path) -> CameraKeypoints:
    """The keypoints of one camera: a JSON file, or a folder of them."""
    files = json_files(path) if path.is_dir() else [path]
    pictures: dict[int, tuple[Person, ...]] = {}
    wrong: list[str] = []
    for file in files:
        try:
            found = read_pictures(file)
        except InputError as error:
            wrong.append(str(error))
            continue
        for picture in found:
            assert picture.number is not None
            if picture.number in pictures:
                raise InputError(f"{file}: the picture {picture.number} occurs twice; keep the files of one run")
            pictures[picture.number] = picture.people
    if len(wrong) == len(files):
        raise InputError(wrong[0] if wrong else f"{path}: holds no JSON files; run the detector again")
    skipped = f"{counted(len(wrong), 'file')} of {len(files)} left out, the first: {wrong[0]}" if wrong else ""
    return CameraKeypoints(path, pictures, (f"{path}: {skipped}",) if wrong else ())


def of_array(path: Path, points: np.ndarray, num_images: int | None) -> CameraKeypoints:
    """The keypoints of one camera out of an array (frame, all_keypoints, 3)."""
    if num_images is not None and len(points) != num_images:
        raise InputError(f"{path}: has {counted(len(points), 'frame')}, the video {num_images}; run the detector again")
    people = ((person,) if (person[:, 2] > 0.0).any() else () for person in points)
    return CameraKeypoints(path, dict(enumerate(people)))


def with_image_numbers(found: CameraKeypoints, first_image: int, num_images: int | None) -> CameraKeypoints:
    """The keypoints with their pictures counted from 0, as the camera's images are.

    `first_image` is the number in the name of the camera's first image, 0 of a video; None images: not known.
    """
    numbers = sorted(found.pictures)
    if not numbers:
        return found
    starts = (first_image, 0) if first_image else (0, 1)
    fits = lambda start: numbers[0] >= start and (num_images is None or numbers[-1] - start < num_images)
    start = next((start for start in starts if fits(start)), None)
    if start is None:
        count = counted(num_images or 0, "image")
        raise InputError(
            f"{found.path}: has keypoints of the pictures {numbers[0]} to {numbers[-1]}, but the camera has {count}; "
            "run the detector on this recording"
        )
    warnings = found.warnings
    reached = numbers[-1] - start + 1
    if num_images is not None and reached < 0.9 * num_images:
        warnings += (f"{found.path}: ends with the picture {reached} of {num_images}",)
    return CameraKeypoints(found.path, {number - start: found.pictures[number] for number in numbers}, warnings)


def check_pixels(found: CameraKeypoints, size: tuple[int, int]) -> None:
    """Check that keypoints lie in pictures of (width, height)."""
    people = found.people
    points = np.concatenate(people) if people else np.zeros((0, 3))
    points = points[points[:, 2] > 0.0]
    if not len(points):
        raise InputError(f"{found.path}: has nobody with a keypoint; run the detector again")
    if np.abs(points[:, :2]).max() <= 2.0:
        raise InputError(
            f"{found.path}: its coordinates are shares of the picture; write pixels (OpenPose: --keypoint_scale 0)"
        )
    sure = points[points[:, 2] >= 0.3]
    sure = sure if len(sure) else points
    margin = 0.05 * np.array(size)  # detectors put keypoints that far outside
    outside = ((sure[:, :2] < -margin) | (sure[:, :2] > np.array(size) + margin)).any(-1).mean()
    if outside > 0.2:
        raise InputError(
            f"{found.path}: {100 * outside:.0f} % of its keypoints lie outside the camera's pictures of "
            f"{size[0]}x{size[1]}; run the detector on the recorded pictures"
        )
