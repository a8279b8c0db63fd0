"""Time offsets that Pose2Sim found: its `pose-sync/` holds the files of `pose/` under shifted numbers."""

from collections import Counter
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import NamedTuple

from sogjax.data.keypoint_files import files_in, json_files, number_in
from sogjax.data.name_match import matched_names

FOLDER, SHIFTED = "pose", "pose-sync"
COMPARED = 5
"""Shifted files of a camera that are looked for among those that were not."""
MAX_BYTES = 2**20


class Shifts(NamedTuple):
    """What Pose2Sim's files tell of the cameras' offsets."""

    offsets: dict[str, int]
    """By camera its `frame_offset`: by how much more its pictures are numbered in `pose/`."""
    untold: tuple[str, ...]
    """Cameras of which that cannot be told."""

    def without(self, cameras: Collection[str]) -> "Shifts":
        """Of the other cameras."""
        offsets = {camera: offset for camera, offset in self.offsets.items() if camera not in cameras}
        return Shifts(offsets, tuple(camera for camera in self.untold if camera not in cameras))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on what is shifted, and on what is not known."""
        found = []
        shown = ", ".join(f"{camera} by {offset:+d}" for camera, offset in self.offsets.items() if offset)
        if shown:
            remedy = "write `frame_offset` into recording.yaml if that is wrong"
            found.append(f"frames are shifted as in {SHIFTED}/ ({shown}); {remedy}")
        if self.untold:
            found.append(
                f"{SHIFTED}/ does not tell by how much frames of {', '.join(self.untold)} are shifted, since its files "
                f"there are not those of {FOLDER}/ under other numbers: none are; synchronise again, or write "
                "`frame_offset` into recording.yaml"
            )
        return tuple(found)


def pose2sims_shifts(path: Path, cameras: Iterable[str]) -> Shifts:
    """What the files of a project say of these cameras; nothing where Pose2Sim has not synchronised it."""
    before, after = (files_in(path / name) for name in (FOLDER, SHIFTED))
    if before is None or after is None:
        return Shifts({}, ())
    cameras = [*cameras]
    names, shifted = (matched_names(cameras, found.by_name) for found in (before, after))
    told = {
        camera: _offset(before.by_name[names[camera]], after.by_name[shifted[camera]])
        for camera in cameras
        if camera in names and camera in shifted
    }
    offsets = {camera: offset for camera, offset in told.items() if offset is not None}
    return Shifts(offsets, tuple(camera for camera in cameras if camera in names and camera not in offsets))


def _offset(before: Path, after: Path) -> int | None:
    """What most of the shifted files say, if anything; the largest are looked at: pictures of nobody are all alike."""
    if not (before.is_dir() and after.is_dir()):
        return None
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
    return best[0][0] if best and best[0][1] > sum(votes.values()) // 2 else None
