"""The JSON files of keypoint detectors, told by their content, as people in pictures before their scheme is known."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.files import read_text
from sogjax.io.keypoint_files import number_in
from sogjax.io.keypoints.scheme import LARGEST_COUNT, Person


@dataclass(frozen=True)
class Picture:
    """The people of one picture who have a keypoint at all."""

    number: int | None
    """The picture's, as the file counts; None where the file is of one picture and says no number."""
    people: tuple[Person, ...]


def read_pictures(path: Path) -> list[Picture]:
    """The pictures of a JSON file of any known format; each has a number, from the file or its name.

    Raises:
        InputError: no JSON, no known format, or something wrong inside.
    """
    content = _json(path)
    if content == []:  # a picture without people, by AlphaPose or MMPose
        return [_numbered(path, Picture(None, ()))]
    for pictures_of in FORMATS.values():
        if (found := pictures_of(path, content)) is not None:
            return [_numbered(path, picture) for picture in found]
    names = ", ".join(FORMATS)
    raise InputError(f"{path}: holds no keypoints of a known format ({names}); run the detector again")


def _json(path: Path) -> Any:
    """The content of a JSON file; NaN and Infinity, which some programs write, are taken as numbers."""
    text = read_text(path, 512 * 2**20)  # half an hour of three people with 133 keypoints
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())[:100]
        raise InputError(f"{path}: is not valid JSON ({reason}); run the detector again, or remove the file") from error


def _numbered(path: Path, picture: Picture) -> Picture:
    number = number_in(path.name) if picture.number is None else picture.number
    if number is None:
        raise InputError(f"{path}: neither it nor its name says of which picture it is; call it CAMERA_000000.json")
    return Picture(number, picture.people)


def _openpose(path: Path, content: Any) -> list[Picture] | None:
    """A file a picture, as also Pose2Sim writes it; with AlphaPose's `--format open`, pictures by their names."""
    is_picture = lambda part: isinstance(part, dict) and isinstance(part.get("people"), list)
    parts = [*content.items()] if isinstance(content, dict) else []
    named = [(number_in(name), part) for name, part in parts if is_picture(part)]
    pictures = [(None, content)] if is_picture(content) else named
    found = [(number, [_of_openpose(path, person) for person in part["people"]]) for number, part in pictures]
    return [_picture(path, number, people) for number, people in found] or None


def _of_openpose(path: Path, person: Any) -> Person:
    keys = ("pose_keypoints_2d", "pose_keypoints")  # since version 1.0, and before it
    key = next((key for key in keys if isinstance(person, dict) and key in person), None)
    if key is None:
        raise InputError(f"{path}: a person has no pose_keypoints_2d; run the detector on bodies")
    return _of_triples(path, person[key])


def _alphapose(path: Path, content: Any) -> list[Picture] | None:
    """A list of people, each with the name of the picture."""
    if not isinstance(content, list) or not any(isinstance(part, dict) and "image_id" in part for part in content):
        return None
    found: dict[int | None, list[Person]] = {}
    for part in content:
        image = part.get("image_id") if isinstance(part, dict) else None
        if not isinstance(image, int | str) or isinstance(image, bool) or "keypoints" not in part:
            raise InputError(f"{path}: holds a person without `image_id` and `keypoints`; run the detector again")
        number = image if isinstance(image, int) else number_in(image)
        found.setdefault(number, []).append(_of_triples(path, part["keypoints"]))
    return [_picture(path, number, people) for number, people in found.items()]


def _mmpose(path: Path, content: Any) -> list[Picture] | None:
    """A file a video or a file a picture (RTMPose and others), by MMPose's inferencer or its demo."""
    if isinstance(content, dict):
        if isinstance(content.get("instance_info"), list):
            return [_frame(path, part, 1) for part in content["instance_info"]]  # the demo counts from 1
        return [_frame(path, content, 0)] if isinstance(content.get("instances"), list) else None
    parts = [part for part in content if isinstance(part, dict)] if isinstance(content, list) else []
    if any("instances" in part for part in parts):
        return [_frame(path, part, 0) for part in content]
    if any("keypoints" in part and "image_id" not in part for part in parts):
        return [_of_instances(path, None, content)]
    return None


def _frame(path: Path, part: Any, first: int) -> Picture:
    number = part.get("frame_id") if isinstance(part, dict) else None
    whole = isinstance(part, dict) and "instances" in part
    if not whole or isinstance(number, bool) or not isinstance(number, int | None):
        raise InputError(f"{path}: holds a picture without `frame_id` and `instances`; run the detector again")
    return _of_instances(path, None if number is None else number - first, part["instances"])


def _of_instances(path: Path, number: int | None, instances: Any) -> Picture:
    if not isinstance(instances, list):
        raise InputError(f"{path}: `instances` of a picture is no list; run the detector again")
    return _picture(path, number, [_of_pairs(path, instance) for instance in instances])


def _of_pairs(path: Path, instance: Any) -> Person:
    points = _numbers(instance.get("keypoints")) if isinstance(instance, dict) else None
    if points is None or points.ndim != 2 or points.shape[1] not in (2, 3) or len(points) > LARGEST_COUNT:
        raise InputError(f"{path}: the `keypoints` of a person are not pairs of pixels; run the detector again")
    scores = np.ones(len(points)) if "keypoint_scores" not in instance else _numbers(instance["keypoint_scores"])
    if scores is None or scores.shape != (len(points),):
        raise InputError(f"{path}: a person has not one of `keypoint_scores` per keypoint; run the detector again")
    return cleaned(np.column_stack([points[:, :2], scores]))


FORMATS: dict[str, Callable[[Path, Any], list[Picture] | None]] = {
    "OpenPose": _openpose,
    "AlphaPose": _alphapose,
    "MMPose": _mmpose,
}
"""What makes pictures of a file's content, by name of the format; None: the content is of another one."""


def _of_triples(path: Path, values: Any) -> Person:
    """The keypoints x1, y1, c1, x2, y2, c2, ..."""
    flat = _numbers(values)
    if flat is None or flat.ndim != 1 or len(flat) % 3 or len(flat) > 3 * LARGEST_COUNT:
        raise InputError(f"{path}: the keypoints of a person are not x, y, confidence in turn; run the detector again")
    return cleaned(flat.reshape(-1, 3))


def _numbers(values: Any) -> Float[np.ndarray, "..."] | None:
    """Nested lists of numbers as an array, null as NaN; None where they are something else."""
    if not isinstance(values, list):
        return None
    try:
        return np.array(values, float)
    except (TypeError, ValueError, OverflowError, RecursionError):
        return None


def cleaned(points: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
    """Keypoints with all numbers 0 where there is none: no confidence, or a number that is no place."""
    farthest = 1e6  # pixels; coordinates beyond it are of no picture
    with np.errstate(invalid="ignore"):
        there = np.isfinite(points).all(-1) & (np.abs(points[..., :2]) < farthest).all(-1) & (points[..., 2] > 0)
    kept = np.where(there[..., None], points, 0.0)
    kept[..., 2] = np.clip(kept[..., 2], 0.0, 1.0)
    return kept


def _picture(path: Path, number: int | None, people: list[Person]) -> Picture:
    most = 100  # no detector finds more people in a picture
    if len(people) > most:
        raise InputError(f"{path}: has {len(people)} people in a picture, more than {most}; is it damaged?")
    if len({len(person) for person in people if len(person)}) > 1:
        raise InputError(f"{path}: its people have different numbers of keypoints; run the detector again")
    return Picture(number, tuple(person for person in people if (person[:, 2] > 0.0).any()))
