"""The register of a recording's files: one list by which it is opened, checked, told from others and replaced.

A recording needs the pictures of its cameras and a calibration; all else is optional.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.pose_description import read_initial_poses
from sogjax.io.recording_settings import read_recording_settings


@dataclass(frozen=True)
class RecordingFile:
    """A file or folder that a recording may have."""

    name: str
    holds: str
    """What is in it."""
    check: Callable[[Path], object] | None = None
    """Reads it and complains of what is wrong; None where that takes the cameras, and `open_recording` does it."""
    is_folder: bool = False
    rendered: bool = False
    """Whether `sogjax synth` writes it."""

    def of(self, recording: Path) -> Path:
        """Its path in a recording, there or not."""
        return recording / self.name

    def checked(self, recording: Path) -> Path | None:
        """Its path if it is there and holds what it should; None: it is not there.

        Raises:
            InputError: something is wrong inside.
        """
        path = self.of(recording)
        if not path.exists():
            return None
        if self.check is not None:
            self.check(path)
        return path


def _folder(name: str, holds: str, rendered: bool = False) -> RecordingFile:
    return RecordingFile(name, holds, is_folder=True, rendered=rendered)


SETTINGS = RecordingFile("recording.yaml", "what the other files do not say", read_recording_settings, rendered=True)
CALIBRATION = RecordingFile("calibration.toml", "the cameras; other formats are found by content", rendered=True)
VIDEOS = _folder("videos", "a video of each camera", rendered=True)
SYNCHRONIZED = _folder("synchronized_videos", "the videos of a FreeMoCap recording")
IMAGES = _folder("images", "a folder of numbered pictures of each camera, in place of its video")
BACKGROUND = _folder("background", "a picture of the empty scene of each camera", rendered=True)
OCCLUDERS = _folder("occluders", "a picture of each camera, white where something in front hides all behind it")
EXAMPLE_POSES = _folder("example_poses", "a folder of pictures and masks of each pose", rendered=True)
KEYPOINTS = _folder("keypoints", "where a detector saw joints: `sogjax.io.keypoint_files`", rendered=True)
POSE = _folder("pose", "the keypoints of a Pose2Sim project", rendered=True)
POSE_SYNC = _folder("pose-sync", "the same keypoints, synchronised by Pose2Sim")
OUTPUT_DATA = _folder("output_data", "the keypoints of a FreeMoCap recording, here or in `raw_data`")
INITIAL_POSE = RecordingFile("initial_pose.yaml", "rough poses of frame 0", read_initial_poses, rendered=True)
GROUND_TRUTH = RecordingFile("ground_truth.npz", "true markers and joints", load_ground_truth, rendered=True)
ACTOR = RecordingFile("actor.yaml", "the actor that runs over several recordings take for this one")
PROJECT = RecordingFile("Config.toml", "the settings of a Pose2Sim project")

RECORDING_FILES = (
    *(SETTINGS, CALIBRATION, VIDEOS, SYNCHRONIZED, IMAGES, BACKGROUND, OCCLUDERS, EXAMPLE_POSES, KEYPOINTS, POSE),
    *(POSE_SYNC, OUTPUT_DATA, INITIAL_POSE, GROUND_TRUTH, ACTOR, PROJECT),
)


def files_of(recording: Path) -> list[Path]:
    """All files in a recording and in the folders that belong to it, sorted."""
    inside = [path for part in RECORDING_FILES if part.is_folder for path in part.of(recording).rglob("*")]
    return sorted(path for path in [*recording.iterdir(), *inside] if path.is_file())


def folder_around(path: Path) -> str:
    """The remedy if something inside a recording was given instead of it; else empty."""
    inside = path.is_file() or path.name in [part.name for part in RECORDING_FILES if part.is_folder]
    for folder in path.resolve().parents[:2] if inside else ():
        if any(part.of(folder).is_dir() for part in (VIDEOS, IMAGES, SYNCHRONIZED)):
            return f"give the folder of the recording, {folder}"
    return ""


def named_subjects(recording: Path) -> tuple[str, ...]:
    """The `subject` of recording.yaml, by whose names takes share actor files; empty where nobody is named.

    The `actor` of an example pose does not count: it only tells people of one recording apart, and somebody of the same
    name in another recording may wear other clothes.

    Raises:
        InputError: recording.yaml cannot be read.
    """
    return read_recording_settings(SETTINGS.of(recording)).subject


def posed_subjects(recording: Path) -> tuple[str | None, ...]:
    """The subjects of whom a recording has example poses; None stands for a subject without a name.

    Raises:
        InputError: recording.yaml cannot be read.
    """
    examples = read_recording_settings(SETTINGS.of(recording)).example_poses
    if examples is None:
        folder = EXAMPLE_POSES.of(recording)
        return (None,) if folder.is_dir() and any(folder.iterdir()) else ()
    return tuple(dict.fromkeys(example.actor for example in examples))
