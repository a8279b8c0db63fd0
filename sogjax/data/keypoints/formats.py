"""The formats of keypoint files, told by their content."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sogjax.data.keypoint_files import number_in
from sogjax.data.keypoints.alphapose import pictures_of_alphapose, recognises_alphapose
from sogjax.data.keypoints.mmpose import pictures_of_mmpose, recognises_mmpose
from sogjax.data.keypoints.openpose import pictures_of_openpose, recognises_openpose
from sogjax.data.keypoints.people import Picture, read_json
from sogjax.errors import InputError

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
