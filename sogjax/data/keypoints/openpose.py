"""OpenPose's JSON, one file a picture; also written by Pose2Sim and, with `--format open`, by AlphaPose."""

from pathlib import Path
from typing import Any

from sogjax.data.keypoint_files import number_in
from sogjax.data.keypoints.people import Picture, people_found, person_of_triples
from sogjax.errors import InputError

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
