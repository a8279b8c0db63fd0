"""Whom a recording shows: by these names its takes share actor files."""

from pathlib import Path

from sogjax.data.recording_settings import read_recording_settings

OWN_ACTOR = "actor.yaml"
"""The actor file that lies beside a recording's videos."""


def named_subjects(recording: Path) -> tuple[str, ...]:
    """The `subject` of recording.yaml; empty where nobody is named.

    The `actor` of an example pose does not count: it only tells people of one recording apart, and somebody of the same
    name in another recording may wear other clothes.

    Raises:
        InputError: recording.yaml cannot be read.
    """
    return read_recording_settings(recording / "recording.yaml").subject


def posed_subjects(recording: Path) -> tuple[str | None, ...]:
    """Of whom a recording has example poses; None stands for a subject without a name.

    Raises:
        InputError: recording.yaml cannot be read.
    """
    examples = read_recording_settings(recording / "recording.yaml").example_poses
    if examples is None:
        folder = recording / "example_poses"
        return (None,) if folder.is_dir() and any(folder.iterdir()) else ()
    return tuple(dict.fromkeys(example.actor for example in examples))


def actor_files(folder: Path, subjects: tuple[str, ...]) -> list[Path]:
    """The actor file of each subject in a folder of them, there or not."""
    return [folder / f"{subject}.yaml" for subject in subjects]
