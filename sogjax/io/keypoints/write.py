"""Writes keypoints as the detectors' programs do, in the folders where they are looked for."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from sogjax.io.files import atomic_path, write_file
from sogjax.io.keypoints.scheme import KeypointScheme

People = Float[np.ndarray, "person all_keypoints 3"]

_DECIMALS = 3
_OTHER_PARTS = (
    *("face_keypoints_2d", "hand_left_keypoints_2d", "hand_right_keypoints_2d", "pose_keypoints_3d"),
    *("face_keypoints_3d", "hand_left_keypoints_3d", "hand_right_keypoints_3d"),
)


def write_openpose(folder: Path, camera: str, pictures: Sequence[People | None]) -> None:
    """`CAMERA/CAMERA_000000000000_keypoints.json` and so on, as OpenPose's --write_json; no file for None."""
    _write_pictures(lambda number: folder / camera / f"{camera}_{number:012d}_keypoints.json", pictures)


def write_pose2sim(folder: Path, camera: str, pictures: Sequence[People | None]) -> None:
    """`CAMERA_json/CAMERA_000000.json` and so on, as Pose2Sim's pose estimation; no file for None."""
    _write_pictures(lambda number: folder / f"{camera}_json" / f"{camera}_{number:06d}.json", pictures)


def write_alphapose(folder: Path, camera: str, pictures: Sequence[People | None]) -> None:
    """`CAMERA/alphapose-results.json`."""
    people = [
        {
            "image_id": f"{number}.jpg",
            "category_id": 1,
            "keypoints": _rounded(person),
            "score": round(float(person[:, 2].sum()), _DECIMALS),
        }
        for number, picture in enumerate(pictures)
        for person in ([] if picture is None else picture)
    ]
    _write(folder / camera / "alphapose-results.json", people)


def write_mmpose(folder: Path, camera: str, pictures: Sequence[People | None]) -> None:
    """`CAMERA.json` as MMPose's inferencer writes for a video."""
    frames = [
        {
            "frame_id": number,
            "instances": [
                {"keypoints": np.round(person[:, :2], _DECIMALS).tolist(), "keypoint_scores": _rounded(person[:, 2])}
                for person in picture
            ],
        }
        for number, picture in enumerate(pictures)
        if picture is not None
    ]
    _write(folder / f"{camera}.json", frames)


def write_mediapipe(folder: Path, camera: str, pictures: Sequence[People | None]) -> None:
    """`CAMERA.npy` (frame, point, x y): the first person of each picture, NaN where a keypoint was not found."""
    count = next((picture.shape[1] for picture in pictures if picture is not None and len(picture)), 33)
    array = np.full((len(pictures), count, 2), np.nan)
    for number, picture in enumerate(pictures):
        if picture is not None and len(picture):
            there = picture[0, :, 2] > 0.0
            array[number, there] = picture[0, there, :2]
    with atomic_path(folder / f"{camera}.npy") as temporary:
        np.save(temporary, array)


WRITERS: dict[str, tuple[Callable[[Path, str, Sequence[People | None]], None], str]] = {
    "openpose": (write_openpose, "BODY_25"),
    "pose2sim": (write_pose2sim, "HALPE_26"),
    "mmpose": (write_mmpose, "COCO_17"),
    "alphapose": (write_alphapose, "HALPE_26"),
    "mediapipe": (write_mediapipe, "MEDIAPIPE_33"),
}
"""How a program writes the pictures of a camera, and its usual scheme, by its name."""


def pictures_to_write(
    scheme: KeypointScheme, points: Float[np.ndarray, "frame person keypoint 3"], there: Bool[np.ndarray, "frame"]
) -> list[People | None]:
    """The people of each picture with all keypoints of the scheme's files; None for pictures without a file."""
    pictures: list[People | None] = []
    for people, written in zip(points, there, strict=True):
        found = people[(people[..., 2] > 0.0).any(-1)]
        whole = np.zeros((len(found), scheme.count, 3))
        whole[:, list(scheme.indices)] = found
        pictures.append(whole if written else None)
    return pictures


def _write_pictures(path_of: Callable[[int], Path], pictures: Sequence[People | None]) -> None:
    for number, picture in enumerate(pictures):
        if picture is not None:
            people = [
                {"person_id": [-1], "pose_keypoints_2d": _rounded(person)} | {part: [] for part in _OTHER_PARTS}
                for person in picture
            ]
            _write(path_of(number), {"version": 1.3, "people": people})


def _write(path: Path, content: object) -> None:
    write_file(path, json.dumps(content, separators=(",", ":")))


def _rounded(values: Float[np.ndarray, "..."]) -> list[float]:
    return np.round(values, _DECIMALS).ravel().tolist()
