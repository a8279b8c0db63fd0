"""Cameras as a viewer without lens distortion needs them."""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.data.calibration import CameraRig
from sogjax.view.tiles import shrink


@dataclass(frozen=True)
class PictureCamera:
    """A camera as a viewer gets it: its pictures smaller, and freed of their lens distortion.

    Here pixel (0, 0) is the left upper CORNER of the picture, as in Rerun.
    """

    name: str
    intrinsics: Float[np.ndarray, "3 3"]
    world_from_camera: Float[np.ndarray, "4 4"]
    scale: Float[np.ndarray, "2"]
    size: tuple[int, int]
    maps: tuple[np.ndarray, np.ndarray] | None
    """For `cv2.remap` of the smaller picture; None without distortion."""

    def jpeg(self, image: UInt8[np.ndarray, "h w 3"], quality: int) -> bytes:
        """A picture (BGR) as recorded, made smaller and freed of distortion."""
        small = shrink(image, self.size)
        if self.maps is not None:
            small = cv2.remap(small, *self.maps, cv2.INTER_LINEAR)
        return cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()

    def pixels(self, pixels: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """Undistorted pixels of the picture as recorded, as pixels of the small one."""
        return (pixels + 0.5) * self.scale


def picture_camera(rig: CameraRig, name: str, picture_width: int) -> PictureCamera:
    """The camera `name`, its pictures at most `picture_width` pixels wide."""
    camera, (width, height) = rig.camera(name), rig.image_size(name)
    factor = min(1.0, picture_width / width)
    size = (round(factor * width), round(factor * height))
    scale = np.array(size, float) / (width, height)
    matrix = np.array(camera.intrinsics, float)
    matrix[:2, 2] += 0.5
    matrix[:2] *= scale[:, None]
    maps = None
    distortion = np.array(camera.distortion, float)
    fisheye = camera.fisheye is not None and bool(camera.fisheye)
    if distortion.any() or fisheye:
        centred = matrix - np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
        make, coefficients = cv2.initUndistortRectifyMap, distortion
        if fisheye:
            make, coefficients = cv2.fisheye.initUndistortRectifyMap, distortion[:4]
        x, y = make(centred, coefficients, np.eye(3), centred, size, cv2.CV_16SC2)
        maps = (x, y)
    pose = np.linalg.inv(np.array(camera.camera_from_world, float))
    return PictureCamera(name, matrix, pose, scale, size, maps)
