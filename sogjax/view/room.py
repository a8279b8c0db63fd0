"""The calibration drawn into the pictures: floor grid, axes and the other cameras' frusta."""

from collections.abc import Sequence

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.io.calibration.rig import CameraRig
from sogjax.model.rotation import world_from_upright
from sogjax.view.projection import picture_points
from sogjax.view.sheets import TITLE_HEIGHT, WIDTH, write
from sogjax.view.tiles import grid_for

GRID, FRUSTUM, FIGURE = (235, 235, 120), (80, 170, 255), (80, 220, 60)
AXES = ((60, 60, 235), (60, 200, 60), (235, 110, 60))
"""BGR of the world's x, y and z axis."""
CELLS = 8
"""Of the floor grid, along each side; a cell is one metre wide where the set-up is of usual size."""
PIECES = 48
"""Points along a line: what is outside of a picture, or bent by a lens, is drawn piece by piece."""
FRUSTUM_DEPTH = 0.12
"""In units of the distance between cameras and what they look at."""

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
    grid = grid_for(sizes, WIDTH)
    columns, rows = grid.size
    canvas = np.zeros((TITLE_HEIGHT + rows, columns, 3), np.uint8)
    cell = 10.0 ** round(np.log10(0.25 / metre))
    lines, colors, owners = _drawing(rig, up, target, cell * metre, metre)
    points = _cut(np.stack(lines))
    pixels, _ = picture_points(rig, points)
    names, _ = picture_points(rig, _centres(rig)[None])
    for k, (image, size) in enumerate(zip(images, sizes, strict=True)):
        fit = grid.fit(k, size)
        area = fit.place(canvas[TITLE_HEIGHT:], image)
        _dim(area)
        for piece, color, owner in zip(fit.pixels(pixels[k]), colors, owners, strict=True):
            if owner != k:
                _polyline(area, piece, color)
        for other, place in enumerate(fit.pixels(names[k, 0])):
            if other != k and np.isfinite(place).all() and _inside(place, area):
                write(area, rig.names[other], (int(place[0]) + 4, int(place[1]) - 4))
        write(area, rig.names[k], (6, 16))
    write(canvas, f"{title}; floor cells of {cell:g} m; axes x red, y green, z blue; figure of 1.7 m", (6, 18))
    return canvas


def _drawing(
    rig: CameraRig, up: str, target: np.ndarray, cell: float, metre: float
) -> tuple[list[Line], list[tuple[int, int, int]], list[int]]:
    """Lines in the world, their colours, and the camera whose frustum they are of, -1 for none."""
    world = world_from_upright(up)
    middle = np.round((world.T @ target) / cell) * cell
    floor = [line @ world.T for line in _grid(middle[:2], cell)]
    axes = [np.stack([np.zeros(3), cell * axis]) for axis in np.eye(3)]
    figure = [line @ world.T for line in _figure((world.T @ target)[:2], metre)]
    drawn = [
        (floor, GRID, -1),
        (figure, FIGURE, -1),
        *(([axis], color, -1) for axis, color in zip(axes, AXES, strict=True)),
    ]
    drawn += [(_frustum(rig, k, FRUSTUM_DEPTH), FRUSTUM, k) for k in range(len(rig))]
    lines = [line for part, _, _ in drawn for line in part]
    colors = [color for part, color, _ in drawn for _ in part]
    return lines, colors, [owner for part, _, owner in drawn for _ in part]


def _grid(middle: Float[np.ndarray, "2"], cell: float) -> list[Line]:
    """Lines on the floor of the upright frame."""
    half = CELLS / 2 * cell
    lines = []
    for step in np.linspace(-half, half, CELLS + 1):
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


def _frustum(rig: CameraRig, camera: int, depth: float) -> list[Line]:
    """The edges of a camera's field of view, from its place to `depth` metres."""
    matrix = np.asarray(rig.cameras.intrinsics, float)[camera]
    width, height = rig.image_size(rig.names[camera])
    pose = np.linalg.inv(np.asarray(rig.cameras.camera_from_world, float)[camera])
    corners = np.array([[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]])
    plane = (corners - matrix[:2, 2]) / np.array([matrix[0, 0], matrix[1, 1]])
    far = depth * np.concatenate([plane, np.ones((4, 1))], axis=1) @ pose[:3, :3].T + pose[:3, 3]
    edges = [np.stack([pose[:3, 3], corner]) for corner in far]
    return edges + [np.stack([far[k], far[(k + 1) % 4]]) for k in range(4)]


def _centres(rig: CameraRig) -> Float[np.ndarray, "camera 3"]:
    return np.linalg.inv(np.asarray(rig.cameras.camera_from_world, float))[:, :3, 3]


def _cut(lines: Float[np.ndarray, "line 2 3"]) -> Float[np.ndarray, "line point 3"]:
    shares = np.linspace(0.0, 1.0, PIECES)[None, :, None]
    return lines[:, :1] * (1.0 - shares) + lines[:, 1:] * shares


def _polyline(area: np.ndarray, pixels: Float[np.ndarray, "point 2"], color: tuple[int, int, int]) -> None:
    places = np.where(np.isfinite(pixels), np.clip(pixels, -1e4, 1e4), 0).round().astype(int).tolist()
    seen = ~np.isnan(pixels.sum(axis=1))
    for k in np.flatnonzero(seen[:-1] & seen[1:]):
        cv2.line(area, tuple(places[k]), tuple(places[k + 1]), color, 1, cv2.LINE_AA)


def _dim(area: np.ndarray) -> None:
    """A little darker, so that thin lines are visible."""
    area[:] = (0.75 * area).astype(np.uint8)


def _inside(place: np.ndarray, area: np.ndarray) -> bool:
    return bool(0 <= place[0] < area.shape[1] and 0 <= place[1] < area.shape[0])
