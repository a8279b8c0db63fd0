"""MMPose's JSON (RTMPose and others): a file a video or a file a picture, by its inferencer or its demo."""

from pathlib import Path
from typing import Any

import numpy as np

from sogjax.data.keypoints.people import Person, Picture, cleaned, numbers, people_found
from sogjax.data.keypoints.scheme import LARGEST_COUNT
from sogjax.errors import InputError


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
    return [_picture(path, None, content)]


def _is_frame(part: Any) -> bool:
    return isinstance(part, dict) and "instances" in part


def _is_instance(part: Any) -> bool:
    return isinstance(part, dict) and "keypoints" in part and "image_id" not in part


def _frame(path: Path, part: Any, first: int) -> Picture:
    number = part.get("frame_id") if isinstance(part, dict) else None
    if not _is_frame(part) or isinstance(number, bool) or not isinstance(number, int | None):
        raise InputError(f"{path}: holds a picture without `frame_id` and `instances`; run the detector again")
    return _picture(path, None if number is None else number - first, part["instances"])


def _picture(path: Path, number: int | None, instances: Any) -> Picture:
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
