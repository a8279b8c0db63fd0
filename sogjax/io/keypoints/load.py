"""Keypoints of a recording: where other programs' detectors saw the joints of people, brought to its frames."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError, counted
from sogjax.io.camera_names import matched_names
from sogjax.io.keypoint_files import KeypointFiles, files_in, find_keypoints, number_in
from sogjax.io.keypoints.camera_keypoints import (
    CameraKeypoints,
    check_pixels,
    of_array,
    read_camera,
    read_keypoint_array,
    with_image_numbers,
)
from sogjax.io.keypoints.scheme import KeypointScheme, check_counts, named_scheme, told_scheme
from sogjax.io.recording import Recording
from sogjax.io.source import numbered_images, videos_in


@dataclass(frozen=True)
class Keypoints:
    """Keypoints of the people in the pictures of a recording.

    The people of a picture are in no order: the first of one camera need not be the first of another, nor of the next
    frame.
    """

    scheme: KeypointScheme
    cameras: tuple[str, ...]
    points: Float[np.ndarray, "camera frame person keypoint 3"]
    """x and y in pixels of the recorded (distorted) pictures, (0, 0) being the centre of the first pixel, and
    confidence from 0 to 1; all three 0 where a keypoint was not found. Read-only."""
    warnings: tuple[str, ...] = ()
    """Sentences on what was left out, and why."""

    def __post_init__(self) -> None:
        self.points.setflags(write=False)

    @property
    def num_frames(self) -> int:
        """Number of frames."""
        return self.points.shape[1]

    @property
    def pixels(self) -> Float[np.ndarray, "camera frame person keypoint 2"]:
        """Where the keypoints are; 0 where there is none."""
        return self.points[..., :2]

    @property
    def confidence(self) -> Float[np.ndarray, "camera frame person keypoint"]:
        """How sure the detector was, 0 where there is none."""
        return self.points[..., 2]

    @property
    def seeing(self) -> tuple[str, ...]:
        """The cameras that have any keypoints."""
        pairs = zip(self.cameras, self.confidence, strict=True)
        return tuple(name for name, confidence in pairs if (confidence > 0.0).any())

    def select(self, cameras: Sequence[str]) -> "Keypoints":
        """The keypoints of some cameras, in their order."""
        indices = [self.cameras.index(name) for name in cameras]
        return Keypoints(self.scheme, tuple(cameras), self.points[indices], self.warnings)

    def between(self, first: int, stop: int) -> "Keypoints":
        """The keypoints of the frames from `first` on and before `stop`."""
        return Keypoints(self.scheme, self.cameras, self.points[:, first:stop], self.warnings)


def load_keypoints(recording: Recording, folder: Path | None = None, scheme: str | None = None) -> Keypoints | None:
    """The keypoints of all cameras and frames of a recording; None where it has none.

    What is wrong with one camera's files is a warning, and that camera is left without keypoints.

    Args:
        recording: whose cameras and frames count.
        folder: where the files are; None: where `find_keypoints` finds them.
        scheme: name or file of the scheme; None: what the recording says, else told by the content.

    Raises:
        InputError: no camera's files can be used, they are of other cameras, or the scheme is unknown.
    """
    files = find_keypoints(recording.path) if folder is None else files_in(folder)
    if files is None:
        if folder is not None:
            raise InputError(f"{folder}: holds no keypoints; put CAMERA/*.json, CAMERA.json or CAMERA.npy there")
        return None
    scheme = scheme or recording.keypoint_scheme
    wanted = None if scheme is None else named_scheme(scheme)
    found, warnings = _read(recording, files)
    check_counts({camera.path: camera.people for camera in found.values()}, wanted)
    people = [person for camera in found.values() for person in camera.people]
    kept = wanted or told_scheme(files.folder, people)
    most = max(len(people) for camera in found.values() for people in camera.pictures.values())
    most_kept = 16
    if most > most_kept:
        warnings.append(f"{files.folder}: has up to {most} people in a picture; the {most_kept} surest are used")
    points = _by_frame(recording, found, kept, min(most, most_kept))
    return Keypoints(kept, recording.rig.names, points, tuple(warnings))


def _read(recording: Recording, files: KeypointFiles) -> tuple[dict[str, CameraKeypoints], list[str]]:
    """What was read of each camera, and sentences on those that were left out."""
    if files.of_all is not None:
        given = _of_all(recording, files.of_all)
    else:
        matched = matched_names(recording.rig.names, files.by_name)
        if not matched:
            raise InputError(
                f"{files.folder}: its keypoints are of {', '.join(sorted(files.by_name)[:12])}, the recording's "
                f"cameras are {', '.join(recording.rig.names)}; name them alike"
            )
        given = {camera: files.by_name[name] for camera, name in matched.items()}
    found, warnings = {}, []
    without = [camera for camera in recording.rig.names if camera not in given]
    if without:
        warnings.append(f"{files.folder}: has no keypoints of {', '.join(without)}")
    for camera, source in given.items():
        try:
            found[camera] = _checked(recording, camera, source)
            warnings += found[camera].warnings
        except InputError as error:
            warnings.append(f"{error}; {camera} is used without keypoints")
    if not found:
        raise InputError(warnings[-1].rpartition("; ")[0])
    return found, warnings


def _of_all(recording: Recording, path: Path) -> dict[str, tuple[Path, Float[np.ndarray, "frame all_keypoints 3"]]]:
    """Each camera's part of an array of all, which are in the order of their videos' names."""
    array = read_keypoint_array(path)
    videos = videos_in(next(iter(recording.sources.values())).parent)
    if len(videos) != len(array):
        cameras = counted(len(array), "camera")
        raise InputError(f"{path}: is of {cameras}, the recording has {len(videos)} videos; run the detector again")
    return {camera: (path, array[videos.index(recording.sources[camera])]) for camera in recording.rig.names}


def _checked(recording: Recording, camera: str, source: Path | tuple[Path, np.ndarray]) -> CameraKeypoints:
    """One camera's keypoints by its images, which they are of as far as one can see."""
    images = recording.sources[camera]
    count = None if camera in recording.picked else recording.num_images.get(camera)
    if isinstance(source, tuple):
        found = of_array(*source, count)
    elif source.suffix.lower() == ".npy":
        found = of_array(source, read_keypoint_array(source)[0], count)
    else:
        first = number_in(numbered_images(images)[0].stem) if images.is_dir() else 0
        found = with_image_numbers(read_camera(source), first or 0, count)
    check_pixels(found, recording.rig.image_size(camera))
    return found


def _by_frame(
    recording: Recording, found: dict[str, CameraKeypoints], scheme: KeypointScheme, most: int
) -> Float[np.ndarray, "camera frame person keypoint 3"]:
    points = np.zeros((len(recording.rig), recording.num_frames, most, len(scheme.keypoints), 3), np.float32)
    for camera, keypoints in found.items():
        place = recording.rig.names.index(camera)
        for row, frame in enumerate(recording.frames):
            people = keypoints.pictures.get(_image(recording, camera, frame), ())
            if people and not recording.is_missing(camera, frame):
                surest = sorted(people, key=lambda person: -person[:, 2].sum())[:most]
                points[place, row, : len(surest)] = scheme.chosen(np.stack(surest))
    return points


def _image(recording: Recording, camera: str, frame: int) -> int:
    """Number of the image of a camera's file that shows a frame; -1 where there is none."""
    if not recording.has_image(camera, frame):
        return -1
    number = frame + recording.frame_offset[camera]
    return recording.picked[camera][number] if camera in recording.picked else number
