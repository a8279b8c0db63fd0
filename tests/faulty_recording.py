"""Copies of a rendered recording with one thing wrong in each."""

import shutil

import cv2
import numpy as np

from sogjax.check.calibration import mirrored_rig, unit_rig
from sogjax.io.calibration.load import load_calibration
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.calibration.tables import write_toml
from sogjax.model.camera import Camera
from sogjax.synth.cache import cached_recording
from sogjax.synth.settings import SynthSettings

SETTINGS = SynthSettings(cameras=6, width=320, height=240, frames=40)
WRONG, OTHER = "cam02", "cam04"


def copied(folder):
    """The recording as it was rendered, to be spoilt."""
    return shutil.copytree(cached_recording(SETTINGS), folder)


def frames_of(path):
    """All pictures of a video."""
    capture = cv2.VideoCapture(str(path))
    images = []
    while (read := capture.read())[0]:
        images.append(read[1])
    capture.release()
    return images


def write_frames(path, images):
    """Write a video anew."""
    height, width = images[0].shape[:2]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), SETTINGS.fps, (width, height))
    for image in images:
        writer.write(image)
    writer.release()


def refilmed(folder, change, camera=WRONG):
    """Another list of pictures in one camera's video."""
    path = folder / "videos" / f"{camera}.mp4"
    write_frames(path, change(frames_of(path)))


def started_late(folder, frames=3):
    """One camera begins so many frames after the others; all have as many frames."""
    for path in (folder / "videos").iterdir():
        refilmed(folder, lambda i, late=path.stem == WRONG: i[frames:] if late else i[:-frames], path.stem)


def exchanged_videos(folder):
    """The videos of two cameras under each other's name."""
    first, second = (folder / "videos" / f"{name}.mp4" for name in (WRONG, OTHER))
    first.rename(folder / "kept")
    second.rename(first)
    (folder / "kept").rename(second)


def frame_repeated(folder):
    """One frame stands twice, the next one is lost."""
    refilmed(folder, lambda images: [*images[:20], images[19], *images[21:]])


def frame_lost(folder):
    """One frame is lost."""
    refilmed(folder, lambda images: images[:20] + images[21:])


def darkened(folder):
    """Values times 0.6."""
    refilmed(folder, lambda images: [np.rint(0.6 * image).astype(np.uint8) for image in images])


def recalibrated(folder, change):
    """Another calibration in the file."""
    path = folder / "calibration.toml"
    write_toml(path, change(load_calibration(path)))


def mirrored(folder):
    """The world's x axis is reversed."""
    recalibrated(folder, mirrored_rig)


def in_millimetres(folder):
    """Lengths are millimetres, though recording.yaml says metres."""
    recalibrated(folder, lambda rig: unit_rig(rig, 1e-3))


def turned(folder, degrees=5.0):
    """One camera is turned about its vertical."""
    recalibrated(folder, lambda rig: _turned(rig, degrees))


def _turned(rig, degrees):
    turn = np.tile(np.eye(4), (len(rig), 1, 1))
    turn[rig.names.index(WRONG), :3, :3] = cv2.Rodrigues(np.array([0.0, np.deg2rad(degrees), 0.0]))[0]
    return moved(rig, turn)


def looking_backwards(folder):
    """Poses of cameras with OpenGL's axes: y up, z backwards."""
    recalibrated(folder, lambda rig: moved(rig, np.diag([1.0, -1.0, -1.0, 1.0])))


def moved(rig, changes):
    """The rig with its poses changed, seen from the cameras."""
    poses = changes @ np.array(rig.cameras.camera_from_world, float)
    cameras = rig.cameras
    changed = cameras.camera_from_world.at[...].set(poses)
    return CameraRig(rig.names, Camera(cameras.intrinsics, changed, cameras.distortion, cameras.image_size))


def exchanged_calibration(folder):
    """The calibrations of two cameras under each other's name."""
    path = folder / "calibration.toml"
    text = path.read_text()
    path.write_text(text.replace(WRONG, "kept").replace(OTHER, WRONG).replace("kept", OTHER))


def wrong_vertical(folder):
    """The vertical is said to be another axis."""
    path = folder / "recording.yaml"
    path.write_text(path.read_text().replace("up: z", "up: y"))
