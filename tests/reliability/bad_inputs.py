"""Inputs that are wrong in one place: a good workplace, and what is damaged in it."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from puppet import PUPPET

from sogjax.io.actor_file import load_body
from sogjax.io.ground_truth import GroundTruth, save_ground_truth
from sogjax.io.motion import motion_from_poses
from sogjax.io.motion_data import save_motion

Damage = Callable[[Path], object]
"""Done to a workplace."""

TRACK = ("track", "recording=walk", "actor=actor.yaml", "out=new/results")
ACTOR = ("actor", "recording=walk", "body=body.yaml", "out=new/actor.yaml")
SEGMENT = ("segment", "recording=walk", "out=new/masks")
EXPORT = ("export", "motion=motion.npz", "to=new.bvh")
EVALUATE = ("evaluate", "motion=motion.npz", "truth=truth.npz")
VIEW = ("view", "motion=motion.npz", "recording=walk", "out=new.rrd")

CAMERAS = ("left", "right", "door")
SIZE = (64, 48)
FRAMES = 4

CALIBRATION = """[{name}]
name = "{name}"
size = [64, 48]
matrix = [[60.0, 0.0, 31.5], [0.0, 60.0, 23.5], [0.0, 0.0, 1.0]]
distortions = [0.0, 0.0, 0.0, 0.0]
rotation = [1.2, -0.5, 0.3]
translation = [0.1, 0.2, 3.0]
"""


@dataclass(frozen=True)
class BadInput:
    """One thing that is wrong, and the command that meets it."""

    family: str
    what: str
    damage: Damage
    command: tuple[str, ...]


def make_workplace(folder: Path) -> None:
    """A recording in which nobody is seen, an actor, a body, a motion and its truth; all of it good."""
    walk = folder / "walk"
    for camera, name in enumerate(CAMERAS):
        _video(walk / "videos" / f"{name}.mp4", camera)
        _picture(walk / "example_poses" / "tpose" / f"{name}.jpg", np.full((48, 64, 3), 90, np.uint8))
        mask = np.zeros((48, 64), np.uint8)
        mask[10:40, 20:40] = 255
        _picture(walk / "example_poses" / "tpose" / f"{name}.mask.png", mask)
    (walk / "calibration.toml").write_text("\n".join(CALIBRATION.format(name=name) for name in CAMERAS))
    (walk / "recording.yaml").write_text("up: z\n")
    (walk / "initial_pose.yaml").write_text("pose: rest\nposition: [0.0, 0.0, 1.0]\nheading: 0.0\n")
    for name in ("actor.yaml", "body.yaml"):
        (folder / name).write_text(PUPPET)
    body = load_body(folder / "actor.yaml")
    poses = np.zeros((FRAMES, body.skeleton.num_dofs), np.float32)
    motion = motion_from_poses(body, poses, 25.0)
    save_motion(folder / "motion.npz", motion)
    save_ground_truth(folder / "truth.npz", GroundTruth(25.0, np.asarray(motion.blob_means, float), ("shin", "shirt")))


def write(path: str, content: str | bytes) -> Damage:
    """A file with other content."""
    data = content.encode() if isinstance(content, str) else content

    def damage(folder: Path) -> None:
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(data)

    return damage


def edit(path: str, old: str, new: str) -> Damage:
    """The first place where a text file has `old` (a regular expression) made `new`."""

    def damage(folder: Path) -> None:
        text, count = re.subn(old, lambda _: new, (folder / path).read_text(), count=1)
        assert count == 1, f"{path} has no {old}"
        (folder / path).write_text(text)

    return damage


def cut(path: str, part: float) -> Damage:
    """Only the first part of a file."""

    def damage(folder: Path) -> None:
        data = (folder / path).read_bytes()
        (folder / path).write_bytes(data[: int(len(data) * part)])

    return damage


def gone(path: str) -> Damage:
    """No such file."""
    return lambda folder: (folder / path).unlink()


def picture(path: str, width: int, height: int, value: int) -> Damage:
    """A picture of one brightness."""
    return lambda folder: _picture(folder / path, np.full((height, width), value, np.uint8))


def arrays(path: str, **changes: np.ndarray | None) -> Damage:
    """An npz with some arrays changed, or left out (None)."""

    def damage(folder: Path) -> None:
        with np.load(folder / path) as old:
            content = {name: old[name] for name in old.files} | changes
        np.savez(folder / path, **{name: value for name, value in content.items() if value is not None})  # pyright: ignore[reportArgumentType]

    return damage


def video(path: str, **options: float | tuple[int, int]) -> Damage:
    """Another video."""
    return lambda folder: _video(folder / path, 0, **options)  # pyright: ignore[reportArgumentType]


def nothing(folder: Path) -> None:
    """The command itself is wrong."""


def _video(path: Path, camera: int, frames: int = FRAMES, fps: float = 25.0, size: tuple[int, int] = SIZE) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), fps, size)
    for frame in range(frames):
        writer.write(np.full((size[1], size[0], 3), 20 + 12 * frame + 50 * camera, np.uint8))
    writer.release()


def _picture(path: Path, image: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), image)
