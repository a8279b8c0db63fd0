"""A small rig made by hand, and recordings whose pictures are given by hand too."""

from pathlib import Path

import cv2
import jax.numpy as jnp
import numpy as np

from sogjax.io.calibration.rig import CameraRig
from sogjax.io.recording import Recording
from sogjax.model.camera import Camera


def ring_rig(num_cameras=3, size=(320, 240), distortion=(-0.2, 0.05, 1e-3, -2e-3, 0.01), distance=3.0):
    """Cameras on a circle that look at (0, 0, 1.2), z being up."""
    poses = []
    for k in range(num_cameras):
        angle = 2.0 * np.pi * k / num_cameras + 0.3
        center = np.array([distance * np.cos(angle), distance * np.sin(angle), 1.6])
        forward = np.array([0.0, 0.0, 1.2]) - center
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        rotation = np.stack([right, np.cross(forward, right), forward])
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = rotation, -rotation @ center
        poses.append(pose)
    matrix = np.array([[260.0, 0.0, 161.3], [0.0, 262.0, 118.2], [0.0, 0.0, 1.0]])
    matrix[:2] *= size[0] / 320.0
    cameras = Camera(
        intrinsics=_stack([matrix] * num_cameras),
        camera_from_world=_stack(poses),
        distortion=_stack([np.array(distortion)] * num_cameras),
        image_size=_stack([np.array(size, float)] * num_cameras),
    )
    return CameraRig(tuple(f"cam{k}" for k in range(num_cameras)), cameras)


def _stack(rows):
    return jnp.asarray(np.stack(rows), jnp.float32)


def opencv_pixels(rig, name, points):
    camera = rig.camera(name)
    pose = np.asarray(camera.camera_from_world, float)
    rotation, _ = cv2.Rodrigues(pose[:3, :3])
    matrix, distortion = np.asarray(camera.intrinsics, float), np.asarray(camera.distortion, float)
    flat = np.asarray(points, float).reshape(-1, 1, 3)
    pixels, _ = cv2.projectPoints(flat, rotation, pose[:3, 3], matrix, distortion)
    return pixels.reshape(*np.shape(points)[:-1], 2)


def black(rig):
    return [np.zeros((rig.image_size(n)[1], rig.image_size(n)[0], 3), np.uint8) for n in rig.names]


def recording_of(rig, num_frames, first_frame=0, up="z"):
    """A recording without files: its pictures are given by hand."""
    return Recording(
        path=Path("walk"), name="walk", rig=rig, fps=50.0, up=up, first_frame=first_frame,
        num_frames=num_frames, sources={}, frame_offset={}, background={}, example_poses=(),
        initial_poses=None, ground_truth=None, warnings=(),
    )  # fmt: skip
