"""What becomes of the pictures of a fisheye lens: viewers get a pinhole's, and blobs tile a pinhole's too."""

import cv2
import jax.numpy as jnp
import numpy as np
import pytest

from sogjax.io.calibration.rig import CameraEntry, rig_from_entries
from sogjax.model.camera import project_points
from sogjax.scene.cells import CellGrid
from sogjax.scene.quadtree import Candidates
from sogjax.view.projection import picture_camera, picture_points

MATRIX = np.array([[260.0, 0.0, 320.0], [0.0, 255.0, 240.0], [0.0, 0.0, 1.0]])
LENS = np.array([0.05, -0.02, 0.003, -0.001])
SIZE = (640, 480)


def fisheye_rig(path):
    entry = CameraEntry("wide", MATRIX, np.eye(3), np.zeros(3), LENS, SIZE, fisheye=True)
    return rig_from_entries(path, [entry])


def recorded_pixel(point):
    pixels, _ = cv2.fisheye.projectPoints(point.reshape(1, 1, 3), np.zeros(3), np.zeros(3), MATRIX, LENS)
    return pixels.reshape(2)


def test_points_are_drawn_where_the_lens_shows_them(tmp_path):
    rig = fisheye_rig(tmp_path)
    points = np.array([[[0.0, 0.0, 2.0], [1.5, 0.4, 2.0], [-2.0, -0.8, 1.5]]])
    pixels, depths = picture_points(rig, points)
    np.testing.assert_allclose(pixels[0, 0], [recorded_pixel(point) for point in points[0]], atol=5e-3)
    np.testing.assert_allclose(depths[0, 0], [2.0, 2.0, 1.5], atol=1e-5)


def test_a_viewers_picture_shows_a_point_where_a_pinhole_camera_does(tmp_path):
    rig = fisheye_rig(tmp_path)
    point = np.array([0.9, -0.5, 2.0])
    image = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    cv2.circle(image, tuple(int(v) for v in np.round(16 * recorded_pixel(point))), 6 * 16, (255, 255, 255), -1, 16, 4)
    camera = picture_camera(rig, "wide", SIZE[0])
    shown = cv2.imdecode(np.frombuffer(camera.jpeg(image), np.uint8), cv2.IMREAD_GRAYSCALE).astype(float)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    centre = np.array([(shown * x).sum(), (shown * y).sum()]) / shown.sum()
    undistorted, _ = project_points(rig.camera("wide"), jnp.asarray(point[None]))
    np.testing.assert_allclose(centre + 0.5, camera.pixels(np.asarray(undistorted))[0], atol=0.5)


@pytest.mark.slow
def test_cells_cover_as_much_of_the_undistorted_picture_as_the_lens_shows(tmp_path):
    """Up to 40 degrees from the axis, a disc of radius f tan(40 degrees), to two percent."""
    rig = fisheye_rig(tmp_path)
    grid = CellGrid(width=SIZE[0], height=SIZE[1], cell_size=4)
    candidates = Candidates.from_grids([grid], rig.cameras)
    cells = slice(0, candidates.shape[0] * candidates.shape[1])
    rays = (np.asarray(candidates.means)[0, cells] - MATRIX[:2, 2]) / MATRIX[[0, 1], [0, 1]]
    limit = np.tan(np.radians(40.0))
    near = (np.linalg.norm(rays, axis=1) < limit) & np.asarray(candidates.inside)[0, cells]
    area = np.sum((2.0 * np.asarray(candidates.sigmas)[0, cells][near]) ** 2)
    np.testing.assert_allclose(area, np.pi * limit**2 * MATRIX[0, 0] * MATRIX[1, 1], rtol=0.02)
