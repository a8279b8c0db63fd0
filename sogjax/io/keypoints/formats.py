"""AlphaPose's JSON: a list of people, each with the name of the picture.

MMPose's JSON (RTMPose and others): a file a video or a file a picture, by its inferencer or its demo.

OpenPose's JSON, one file a picture; also written by Pose2Sim and, with `--format open`, by AlphaPose.

The formats of keypoint files, told by their content.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from sogjax.errors import InputError
from sogjax.io.keypoint_files import number_in
from sogjax.io.keypoints.people import Person, Picture, cleaned, numbers, people_found, person_of_triples, read_json
from sogjax.io.keypoints.scheme import LARGEST_COUNT


def recognises_alphapose(content: Any) -> bool:
    """Whether the content of a JSON file is a list of people with `image_id`."""
    return isinstance(content, list) and any(isinstance(part, dict) and "image_id" in part for part in content)


def pictures_of_alphapose(path: Path, content: list) -> list[Picture]:
    """The pictures of a file, numbered as their names are.

    Raises:
        InputError: a person without picture, or keypoints of another form.
    """
    found: dict[int | None, list[Person]] = {}
    for part in content:
        image = part.get("image_id") if isinstance(part, dict) else None
        if not isinstance(image, int | str) or isinstance(image, bool) or "keypoints" not in part:
            raise InputError(f"{path}: holds a person without `image_id` and `keypoints`; run the detector again")
        number = image if isinstance(image, int) else number_in(image)
        found.setdefault(number, []).append(person_of_triples(path, part["keypoints"]))
    return [Picture(number, people_found(path, people)) for number, people in found.items()]


def recognises_mmpose(content: Any) -> bool:
    """Whether the content of a JSON file is pictures' instances, or the instances of one picture."""
    if isinstance(content, dict):
        return isinstance(content.get("instance_info"), list) or isinstance(content.get("instances"), list)
    return isinstance(content, list) and any(_is_frame(part) or _is_instance(part) for part in content)


def pictures_of_mmpose(path: Path, content: Any) -> list[Picture]:
    """The pictures of a file, counted from 0.

    Raises:
        InputError: instances without keypoints, or keypoints of another form.
    """
    if isinstance(content, dict) and isinstance(content.get("instance_info"), list):
        return [_frame(path, part, 1) for part in content["instance_info"]]  # the demo counts from 1
    if isinstance(content, dict):
        return [_frame(path, content, 0)]
    if any(_is_frame(part) for part in content):
        return [_frame(path, part, 0) for part in content]
    return [_mmpose_picture(path, None, content)]


def _is_frame(part: Any) -> bool:
    return isinstance(part, dict) and "instances" in part


def _is_instance(part: Any) -> bool:
    return isinstance(part, dict) and "keypoints" in part and "image_id" not in part


def _frame(path: Path, part: Any, first: int) -> Picture:
    number = part.get("frame_id") if isinstance(part, dict) else None
    if not _is_frame(part) or isinstance(number, bool) or not isinstance(number, int | None):
        raise InputError(f"{path}: holds a picture without `frame_id` and `instances`; run the detector again")
    return _mmpose_picture(path, None if number is None else number - first, part["instances"])


def _mmpose_picture(path: Path, number: int | None, instances: Any) -> Picture:
    if not isinstance(instances, list):
        raise InputError(f"{path}: `instances` of a picture is no list; run the detector again")
    return Picture(number, people_found(path, [_person(path, instance) for instance in instances]))


def _person(path: Path, instance: Any) -> Person:
    points = numbers(instance.get("keypoints")) if isinstance(instance, dict) else None
    if points is None or points.ndim != 2 or points.shape[1] not in (2, 3) or len(points) > LARGEST_COUNT:
        raise InputError(f"{path}: the `keypoints` of a person are not pairs of pixels; run the detector again")
    scores = np.ones(len(points)) if "keypoint_scores" not in instance else numbers(instance["keypoint_scores"])
    if scores is None or scores.shape != (len(points),):
        raise InputError(f"{path}: a person has not one of `keypoint_scores` per keypoint; run the detector again")
    return cleaned(np.column_stack([points[:, :2], scores]))


_KEYS = ("pose_keypoints_2d", "pose_keypoints")
"""Since version 1.0, and before it."""


def recognises_openpose(content: Any) -> bool:
    """Whether the content of a JSON file is a picture's people, or such pictures by their names."""
    return isinstance(content, dict) and (_is_picture(content) or any(_is_picture(part) for part in content.values()))


def pictures_of_openpose(path: Path, content: dict) -> list[Picture]:
    """The pictures of a file.

    Raises:
        InputError: people without keypoints, or keypoints of another form.
    """
    if _is_picture(content):
        return [_picture(path, content, None)]
    return [_picture(path, part, number_in(name)) for name, part in content.items() if _is_picture(part)]


def _is_picture(content: Any) -> bool:
    return isinstance(content, dict) and isinstance(content.get("people"), list)


def _picture(path: Path, content: dict, number: int | None) -> Picture:
    people = []
    for person in content["people"]:
        key = next((key for key in _KEYS if isinstance(person, dict) and key in person), None)
        if key is None:
            raise InputError(f"{path}: a person has no pose_keypoints_2d; run the detector on bodies")
        people.append(person_of_triples(path, person[key]))
    return Picture(number, people_found(path, people))


MAX_BYTES = 512 * 2**20
"""Of one JSON file: half an hour of three people with 133 keypoints."""


@dataclass(frozen=True)
class KeypointFormat:
    """A format of JSON files of keypoints."""

    name: str
    recognises: Callable[[Any], bool]
    pictures: Callable[[Path, Any], list[Picture]]


FORMATS: tuple[KeypointFormat, ...] = (
    KeypointFormat("OpenPose", recognises_openpose, pictures_of_openpose),
    KeypointFormat("AlphaPose", recognises_alphapose, pictures_of_alphapose),
    KeypointFormat("MMPose", recognises_mmpose, pictures_of_mmpose),
)


def read_pictures(path: Path) -> list[Picture]:
    """The pictures of a JSON file of any known format; each has a number, from the file or its name.

    Raises:
        InputError: no JSON, no known format, or something wrong inside.
    """
    content = read_json(path, MAX_BYTES)
    if content == []:  # a picture without people, by AlphaPose or MMPose
        return [_numbered(path, Picture(None, ()))]
    known = next((known for known in FORMATS if known.recognises(content)), None)
    if known is None:
        names = ", ".join(known.name for known in FORMATS)
        raise InputError(f"{path}: holds no keypoints of a known format ({names}); run the detector again")
    return [_numbered(path, picture) for picture in known.pictures(path, content)]


def _numbered(path: Path, picture: Picture) -> Picture:
    number = number_in(path.name) if picture.number is None else picture.number
    if number is None:
        raise InputError(f"{path}: neither it nor its name says of which picture it is; call it CAMERA_000000.json")
    return Picture(number, picture.people)
