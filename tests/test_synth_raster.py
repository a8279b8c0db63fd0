"""The z-buffer against half-planes, closed forms and a triangulation without gaps."""

import numpy as np
import pytest
from scipy.spatial import Delaunay

from sogjax.synth.raster import Window, rasterize
from sogjax.synth.surface import surface_nets

WINDOW = Window(0, 0, 64, 48)
TRIANGLE = np.array([[0, 1, 2]])


def clockwise(corners):
    """Corners so ordered that the face is seen from its outside (image y points down)."""
    a, b = corners[1] - corners[0], corners[2] - corners[0]
    return corners if a[0] * b[1] - a[1] * b[0] < 0 else corners[::-1]


def image_of(hits, window=WINDOW):
    picture = np.full((window.height, window.width), -1)
    picture[hits.rows, hits.columns] = hits.faces
    return picture


@pytest.mark.parametrize("seed", range(8))
def test_a_triangle_covers_the_pixels_whose_centres_lie_in_it(seed):
    corners = clockwise(np.random.default_rng(seed).uniform(-20, 80, (3, 2)))
    hits = rasterize(corners, np.ones(3), TRIANGLE, WINDOW)
    x, y = np.meshgrid(np.arange(64.0), np.arange(48.0))
    inside = np.ones((48, 64), bool)
    for k in range(3):
        (xa, ya), (xb, yb) = corners[k], corners[(k + 1) % 3]
        inside &= (xb - xa) * (y - ya) - (yb - ya) * (x - xa) <= 0
    np.testing.assert_array_equal(image_of(hits) >= 0, inside)


def test_the_number_of_pixels_is_the_area():
    corners = clockwise(np.array([[3.3, 2.1], [60.2, 10.4], [20.7, 45.9]]))
    hits = rasterize(corners, np.ones(3), TRIANGLE, WINDOW)
    a, b = corners[1] - corners[0], corners[2] - corners[0]
    assert len(hits.faces) == pytest.approx(0.5 * abs(a[0] * b[1] - a[1] * b[0]), rel=0.01)


def test_the_back_of_a_face_is_not_seen():
    corners = clockwise(np.array([[3.0, 2.0], [60.0, 10.0], [20.0, 45.0]]))
    assert len(rasterize(corners, np.ones(3), TRIANGLE[:, ::-1], WINDOW).faces) == 0
    assert len(rasterize(corners, np.ones(3), TRIANGLE[:, ::-1], WINDOW, cull=False).faces) > 0


def test_a_face_that_reaches_behind_the_camera_is_left_out():
    corners = clockwise(np.array([[3.0, 2.0], [60.0, 10.0], [20.0, 45.0]]))
    assert len(rasterize(corners, np.array([1.0, 1.0, -1.0]), TRIANGLE, WINDOW).faces) == 0


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_the_nearer_of_two_faces_is_seen(order):
    corners = clockwise(np.array([[5.0, 5.0], [55.0, 6.0], [30.0, 40.0]]))
    depths = np.repeat([2.0, 3.0], 3)
    faces = np.array([[0, 1, 2], [3, 4, 5]])[order]
    hits = rasterize(np.concatenate([corners, corners]), depths, faces, WINDOW)
    assert set(hits.faces) == {order.index(0)}
    np.testing.assert_allclose(hits.depths, 2.0, rtol=1e-9)


def test_a_triangulation_has_no_gaps():
    points = np.concatenate(
        [np.random.default_rng(3).uniform(0, [63, 47], (300, 2)), [[0, 0], [63, 0], [0, 47], [63, 47]]]
    )
    points[:40] = np.round(points[:40])  # corners on pixel centres, edges along rows
    faces = Delaunay(points).simplices
    hits = rasterize(points, np.ones(len(points)), faces, WINDOW, cull=False)
    assert (image_of(hits) >= 0).all()


def test_depth_and_attributes_are_those_of_the_plane_in_space():
    corners = np.array([[-1.0, -1.0, 3.0], [1.5, -0.5, 6.0], [0.2, 1.4, 4.0]])
    pixels = clockwise(20.0 * corners[:, :2] / corners[:, 2:] + [30.0, 22.0])
    if not np.allclose(pixels[0], 20.0 * corners[0, :2] / corners[0, 2] + [30.0, 22.0]):
        corners = corners[::-1]
    hits = rasterize(pixels, corners[:, 2], TRIANGLE, WINDOW)
    points = hits.interpolated(corners, TRIANGLE)
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    rays = np.stack([(hits.columns - 30.0) / 20.0, (hits.rows - 22.0) / 20.0, np.ones(len(hits.rows))], 1)
    expected = rays * (normal @ corners[0] / (rays @ normal))[:, None]
    np.testing.assert_allclose(points, expected, atol=1e-5)
    np.testing.assert_allclose(hits.depths, expected[:, 2], rtol=1e-9)


def test_a_sphere_has_the_outline_and_depth_of_a_sphere():
    centre, radius, focal = np.array([0.1, -0.05, 3.0]), 0.5, 120.0
    sphere = lambda points: np.linalg.norm(points - centre, axis=1) - radius
    vertices, faces = surface_nets(sphere, centre - 0.6, centre + 0.6, 0.05)
    window = Window(0, 0, 120, 90)
    pixels = focal * vertices[:, :2] / vertices[:, 2:] + [60.0, 45.0]
    hits = rasterize(pixels, vertices[:, 2], faces, window)
    x, y = np.meshgrid((np.arange(120) - 60.0) / focal, (np.arange(90) - 45.0) / focal)
    rays = np.stack([x, y, np.ones_like(x)], -1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    along = rays @ centre
    miss = np.sqrt(centre @ centre - along**2)
    assert np.mean((image_of(hits, window) >= 0) != (miss < radius)) < 0.003
    hit = miss[hits.rows, hits.columns] < 0.95 * radius
    depth = ((along - np.sqrt(np.maximum(radius**2 - miss**2, 0))) * rays[..., 2])[hits.rows, hits.columns]
    np.testing.assert_allclose(hits.depths[hit], depth[hit], atol=0.01)


def test_a_window_is_a_part_of_the_picture():
    corners = clockwise(np.array([[3.0, 2.0], [60.0, 10.0], [20.0, 45.0]]))
    whole = image_of(rasterize(corners, np.ones(3), TRIANGLE, WINDOW))
    part = Window(10, 6, 31, 20)
    seen = image_of(rasterize(corners, np.ones(3), TRIANGLE, part), part)
    np.testing.assert_array_equal(seen, whole[part.slices])
