"""Recordings of a few tiny frames, for tests of what reads them."""

from pathlib import Path

import cv2
import numpy as np

SIZE = (64, 48)
FPS = 25.0


def toml_camera(name, /, **changes):
    """The table of a camera, as text of TOML values, in a calibration file."""
    values = {
        "name": f'"{name}"',
        "size": str(list(SIZE)),
        "matrix": "[[60.0, 0.0, 31.5], [0.0, 60.0, 23.5], [0.0, 0.0, 1.0]]",
        "distortions": "[0.0, 0.0, 0.0, 0.0]",
        "rotation": "[1.2, -0.5, 0.3]",
        "translation": "[0.1, 0.2, 3.0]",
        "fisheye": "false",
    } | changes
    lines = [f"{key} = {value}" for key, value in values.items() if value is not None]
    return "\n".join([f"[{name}]", *lines, ""])


def write_calibration(folder, *tables):
    """Write `calibration.toml` with the tables of `toml_camera`."""
    path = folder / "calibration.toml"
    path.write_text("\n".join(tables))
    return path


def frame_image(camera, frame, size=SIZE):
    """An image whose brightness tells the camera's number and the frame, even after compression."""
    width, height = size
    image = np.full((height, width, 3), 20 + 12 * frame, np.uint8)
    image[:, : width // 2] = 20 + 50 * camera
    return image


def frame_of(image):
    """The frame that an image of `frame_image` belongs to."""
    return round((float(image[:, image.shape[1] * 3 // 4].mean()) - 20) / 12)


def write_video(path, camera=0, frames=4, fps=FPS, size=SIZE):
    """Write the images of `frame_image` as a video."""
    path.parent.mkdir(parents=True, exist_ok=True)
    code = cv2.VideoWriter.fourcc(*("MJPG" if path.suffix == ".avi" else "mp4v"))
    writer = cv2.VideoWriter(str(path), code, fps, size)
    for frame in range(frames):
        writer.write(frame_image(camera, frame, size))
    writer.release()


def write_images(folder, camera=0, frames=4, first=0, size=SIZE):
    """Write the images of `frame_image` as a folder of png files."""
    for frame in range(frames):
        write_image(folder / f"{first + frame:06d}.png", frame_image(camera, frame, size))


def write_image(path, image):
    """Write one image."""
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), image)


def snapshot(folder):
    """Every file below a folder with its content."""
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def make_recording(folder, cameras=("left", "right"), settings="up: z\n", frames=4):
    """Write a recording with videos, and return its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    write_calibration(folder, *(toml_camera(name) for name in cameras))
    for index, name in enumerate(cameras):
        write_video(folder / "videos" / f"{name}.mp4", index, frames)
    (folder / "recording.yaml").write_text(settings)
    return folder


def named_recording(folder, subject=None, poses=False):
    """A recording that is only looked at: whom it shows, and whether it has example poses."""
    make_recording(folder, settings=f"up: z\nsubject: {subject}\n" if subject else "up: z\n")
    if poses:
        (folder / "example_poses" / "tpose").mkdir(parents=True)
    return folder


def shared_recording(name):
    """A recording beside the project, or None where it is absent."""
    folder = Path(__file__).parents[2] / "shared" / "recordings" / name
    return folder if folder.is_dir() else None
