"""The calibration drawn into the pictures: floor grid, axes, a person's size and the other cameras' frusta."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.io.calibration.rig import CameraRig
from sogjax.model.rotation import world_from_upright
from sogjax.view.projection import picture_points
from sogjax.view.tiles import TITLE_HEIGHT, titled_grid, write_label

FLOOR, FRUSTUM, FIGURE = (235, 235, 120), (80, 170, 255), (80, 220, 60)
AXES = ((60, 60, 235), (60, 200, 60), (235, 110, 60))
"""BGR of the world's x, y and z axis."""

Line = Float[np.ndarray, "2 3"]


def room_sheet(
    rig: CameraRig,
    images: Sequence[UInt8[np.ndarray, "_h _w 3"]],
    up: str,
    target: Float[np.ndarray, "3"],
    metre: float,
    title: str,
) -> UInt8[np.ndarray, "h w 3"]:
    """Every camera's picture (BGR) with what the calibration says is there, side by side.

    Args:
        rig: the cameras, one for each picture; its unit of length is the usual distance from them to `target`, so
            that a calibration in a wrong unit can be drawn too.
        images: the pictures at any size.
        up: the world's vertical.
        target: what the cameras look at (world); the floor grid lies below it, at height 0.
        metre: what the calibration takes for a metre, in the rig's unit.
        title: written above the pictures.
    """
    sizes = [rig.image_size(name) for name in rig.names]
    cell = 10.0 ** round(np.log10(0.25 / metre))  # a metre where the set-up is of usual size
    legend = f"floor cells of {cell:g} m; axes x red, y green, z blue; figure of 1.7 m"
    grid, canvas = titled_grid(sizes, f"{title}; {legend}")
    lines, colors, owners = zip(*_lines(rig, up, target, cell * metre, metre), strict=True)
    # what is outside of a picture, or bent by a lens, is drawn piece by piece
    shares = np.linspace(0.0, 1.0, 48)[None, :, None]
    ends = np.stack(lines)
    pixels, _ = picture_points(rig, ends[:, :1] * (1.0 - shares) + ends[:, 1:] * shares)
    names, _ = picture_points(rig, np.linalg.inv(_poses(rig))[None, :, :3, 3])
    for k, (image, size) in enumerate(zip(images, sizes, strict=True)):
        fit = grid.fit(k, size)
        area = fit.area(canvas[TITLE_HEIGHT:], image)
        area[:] = (0.75 * area).astype(np.uint8)  # so that thin lines are visible
        for piece, color, owner in zip(fit.pixels(pixels[k]), colors, owners, strict=True):
            if owner != k:
                _polyline(area, piece, color)
        for other, (x, y) in enumerate(fit.pixels(names[k, 0])):
            if other != k and 0 <= x < area.shape[1] and 0 <= y < area.shape[0]:
                write_label(area, rig.names[other], (int(x) + 4, int(y) - 4))
        write_label(area, rig.names[k], (6, 16))
    return canvas


def _poses(rig: CameraRig) -> Float[np.ndarray, "camera 4 4"]:
    return np.asarray(rig.cameras.camera_from_world, float)


def _lines(
    rig: CameraRig, up: str, target: np.ndarray, cell: float, metre: float
) -> list[tuple[Line, tuple[int, int, int], int]]:
    """Lines in the world, their colours, and the camera whose frustum they are of, -1 for none."""
    upright = world_from_upright(up)
    below = upright.T @ target
    floor = [(line @ upright.T, FLOOR, -1) for line in _grid(np.round(below / cell)[:2] * cell, cell)]
    figure = [(line @ upright.T, FIGURE, -1) for line in _figure(below[:2], metre)]
    axes = [(np.stack([np.zeros(3), cell * axis]), color, -1) for axis, color in zip(np.eye(3), AXES, strict=True)]
    frusta = [(line, FRUSTUM, camera) for camera in range(len(rig)) for line in _frustum(rig, camera)]
    return [*floor, *figure, *axes, *frusta]


def _grid(middle: Float[np.ndarray, "2"], cell: float) -> list[Line]:
    """Lines on the floor of the upright frame, eight cells along each side."""
    half, lines = 4 * cell, []
    for step in np.linspace(-half, half, 9):
        lines.append(np.array([[middle[0] + step, middle[1] - half, 0], [middle[0] + step, middle[1] + half, 0]]))
        lines.append(np.array([[middle[0] - half, middle[1] + step, 0], [middle[0] + half, middle[1] + step, 0]]))
    return lines


def _figure(place: Float[np.ndarray, "2"], metre: float) -> list[Line]:
    """A stick figure 1.7 m tall on the floor of the upright frame: what a person's size would be."""
    joints = {"left": (0.0, 0.12, 0.0), "right": (0.0, -0.12, 0.0), "hips": (0.0, 0.0, 0.88), "top": (0.0, 0.0, 1.7)}
    joints |= {"hand": (0.0, 0.45, 0.85), "other": (0.0, -0.45, 0.85), "neck": (0.0, 0.0, 1.42)}
    points = {name: np.array([*place, 0.0]) + metre * np.array(offset) for name, offset in joints.items()}
    bones = [("left", "hips"), ("right", "hips"), ("hips", "top"), ("neck", "hand"), ("neck", "other")]
    return [np.stack([points[a], points[b]]) for a, b in bones]


def _frustum(rig: CameraRig, camera: int) -> list[Line]:
    """The edges of a camera's field of view, up to 0.12 of the distance to what it looks at."""
    matrix = np.asarray(rig.cameras.intrinsics, float)[camera]
    width, height = rig.image_size(rig.names[camera])
    pose = np.linalg.inv(_poses(rig)[camera])
    corners = np.array([[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]])
    plane = (corners - matrix[:2, 2]) / np.array([matrix[0, 0], matrix[1, 1]])
    far = 0.12 * np.concatenate([plane, np.ones((4, 1))], axis=1) @ pose[:3, :3].T + pose[:3, 3]
    edges = [np.stack([pose[:3, 3], corner]) for corner in far]
    return edges + [np.stack([far[k], far[(k + 1) % 4]]) for k in range(4)]


def _polyline(area: np.ndarray, pixels: Float[np.ndarray, "point 2"], color: tuple[int, int, int]) -> None:
    places = np.where(np.isfinite(pixels), np.clip(pixels, -1e4, 1e4), 0).round().astype(int).tolist()
    seen = ~np.isnan(pixels.sum(axis=1))
    for k in np.flatnonzero(seen[:-1] & seen[1:]):
        cv2.line(area, tuple(places[k]), tuple(places[k + 1]), color, 1, cv2.LINE_AA)
