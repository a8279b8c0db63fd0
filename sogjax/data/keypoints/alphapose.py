"""AlphaPose's JSON: a list of people, each with the name of the picture."""

from pathlib import Path
from typing import Any

from sogjax.data.keypoint_files import number_in
from sogjax.data.keypoints.people import Person, Picture, people_found, person_of_triples
from sogjax.errors import InputError


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
