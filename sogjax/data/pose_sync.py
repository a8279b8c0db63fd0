"""Time offsets that Pose2Sim found: its `pose-sync/` holds the files of `pose/` under shifted numbers."""

from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path

from sogjax.data.keypoint_files import files_in, json_files, number_in
from sogjax.data.name_match import matched_names

FOLDER, SHIFTED = "pose", "pose-sync"
COMPARED = 5
"""Shifted files of a camera that are looked for among those that were not."""
MAX_BYTES = 2**20


def shifted_offsets(path: Path, cameras: Iterable[str]) -> dict[str, int]:
    """By camera of a project its `frame_offset`, other than 0: by how much more its pictures are numbered in `pose/`.

    A camera of which nothing can be told has none.
    """
    before, after = (files_in(path / name) for name in (FOLDER, SHIFTED))
    if before is None or after is None:
        return {}
    cameras = [*cameras]
    names, shifted = (matched_names(cameras, found.by_name) for found in (before, after))
    offsets = {
        camera: _offset(before.by_name[names[camera]], after.by_name[shifted[camera]])
        for camera in cameras
        if camera in names and camera in shifted
    }
    return {camera: offset for camera, offset in offsets.items() if offset}


def said(offsets: Mapping[str, int]) -> str:
    """A sentence on what was found."""
    shown = ", ".join(f"{camera} by {offset:+d}" for camera, offset in offsets.items())
    return f"frames are shifted as in {SHIFTED}/ ({shown}); write `frame_offset` into recording.yaml if that is wrong"


def _offset(before: Path, after: Path) -> int:
    """What most of the shifted files say; the largest are looked at, as pictures of nobody are all alike."""
    if not (before.is_dir() and after.is_dir()):
        return 0
    shifted = sorted(json_files(after), key=lambda file: -file.stat().st_size)[:COMPARED]
    by_size: dict[int, list[Path]] = {file.stat().st_size: [] for file in shifted}
    for file in json_files(before):
        by_size.get(file.stat().st_size, []).append(file)
    votes: Counter[int] = Counter()
    for file in shifted:
        size = file.stat().st_size
        same = [other for other in by_size[size] if size < MAX_BYTES and other.read_bytes() == file.read_bytes()]
        numbers = number_in(same[0].name) if len(same) == 1 else None, number_in(file.name)
        if None not in numbers:
            votes[numbers[0] - numbers[1]] += 1  # pyright: ignore[reportOperatorIssue]
    best = votes.most_common(1)
    return best[0][0] if best and best[0][1] > sum(votes.values()) // 2 else 0
