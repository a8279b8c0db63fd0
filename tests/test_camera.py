"""The camera against OpenCV's own projection and undistortion."""

import cv2
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sogjax.model.camera import (
    MAX_FISHEYE_ANGLE,
    NEAR,
    Camera,
    distort,
    project,
    project_points,
    undistort,
    undistorted_sizes,
)
from sogjax.model.sog import Sog

PIXELS = 2e-3
"""Tolerance of float32 in images of 1300 pixels."""

ROTATION_VECTOR = np.array([1.7, 1.05, -0.4])
TRANSLATION = np.array([0.3, 0.9, 3.0])
MATRIX = np.array([[1680.0, 0.0, 640.0], [0.0, 1590.0, 470.0], [0.0, 0.0, 1.0]])


def make_camera(distortion=(0.0, 0.0, 0.0, 0.0, 0.0)):
    transform = np.eye(4)
    transform[:3, :3] = cv2.Rodrigues(ROTATION_VECTOR)[0]
    transform[:3, 3] = TRANSLATION
    return Camera(
        intrinsics=jnp.asarray(MATRIX),
        camera_from_world=jnp.asarray(transform),
        distortion=jnp.asarray(np.array(distortion)),
        image_size=jnp.array([1296.0, 972.0]),
    )


def points_in_view(seed, count=50):
    rng = np.random.default_rng(seed)
    points_camera = np.array([0.0, 0.0, 4.0]) + rng.uniform(-1.0, 1.0, (count, 3)) * [1.0, 0.8, 1.5]
    rotation = cv2.Rodrigues(ROTATION_VECTOR)[0]
    return (points_camera - TRANSLATION) @ rotation


def opencv_pixels(points, distortion):
    pixels, _ = cv2.projectPoints(points, ROTATION_VECTOR, TRANSLATION, MATRIX, np.array(distortion))
    return pixels.reshape(-1, 2)


@pytest.mark.parametrize(
    "distortion",
    [(0.0, 0.0, 0.0, 0.0, 0.0), (-0.047, 0.149, 0.0034, -0.0024, 0.0), (-0.2, 0.06, -0.001, 0.002, -0.01)],
)
def test_projection_then_distortion_is_opencvs(distortion):
    points = points_in_view(0)
    camera = make_camera(distortion)
    pixels, depth = project_points(camera, jnp.asarray(points))
    expected_depth = (points @ cv2.Rodrigues(ROTATION_VECTOR)[0].T + TRANSLATION)[:, 2]
    np.testing.assert_allclose(depth, expected_depth, rtol=1e-5)
    np.testing.assert_allclose(pixels, opencv_pixels(points, np.zeros(5)), atol=PIXELS)
    np.testing.assert_allclose(distort(camera, pixels), opencv_pixels(points, distortion), atol=PIXELS)


@pytest.mark.parametrize("distortion", [(-0.047, 0.149, 0.0034, -0.0024, 0.0), (-0.2, 0.06, -0.001, 0.002, -0.01)])
def test_undistortion_is_opencvs_and_inverts_distortion(distortion):
    camera = make_camera(distortion)
    recorded = np.random.default_rng(1).uniform([0.0, 0.0], [1296.0, 972.0], (40, 2))
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-10)
    expected = cv2.undistortPoints(
        recorded.reshape(-1, 1, 2), MATRIX, np.array(distortion), R=np.eye(3), P=MATRIX, criteria=criteria
    ).reshape(-1, 2)
    found = undistort(camera, jnp.asarray(recorded))
    np.testing.assert_allclose(found, expected, atol=PIXELS)
    np.testing.assert_allclose(distort(camera, found), recorded, atol=PIXELS)


def test_pixel_zero_is_the_centre_of_the_first_pixel():
    """A ray along the optical axis meets the principal point itself, with no half pixel added."""
    camera = make_camera()
    on_axis = (np.array([[0.0, 0.0, 2.0]]) - TRANSLATION) @ cv2.Rodrigues(ROTATION_VECTOR)[0]
    pixels, _ = project_points(camera, jnp.asarray(on_axis))
    np.testing.assert_allclose(pixels, [[640.0, 470.0]], atol=PIXELS)


def test_a_blobs_size_in_the_image_is_that_of_a_small_disc():
    """Eq. 4: points of a disc parallel to the image lie on an ellipse of area pi (s f / z)^2."""
    camera = make_camera()
    centre = np.array([0.2, -0.1, 4.0])
    angles = np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)
    disc = centre + 0.05 * np.stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)], 1)
    rotation = cv2.Rodrigues(ROTATION_VECTOR)[0]
    outline = opencv_pixels((disc - TRANSLATION) @ rotation, np.zeros(5))
    area = cv2.contourArea(outline.astype(np.float32))
    blob = Sog.from_arrays(jnp.asarray((centre - TRANSLATION) @ rotation)[None], jnp.array([0.05]), jnp.zeros((1, 3)))
    np.testing.assert_allclose(np.pi * project(camera, blob).sigmas ** 2, [area], rtol=1e-3)


def test_what_is_behind_the_camera_is_masked_and_has_no_gradient():
    camera = make_camera()
    rotation = cv2.Rodrigues(ROTATION_VECTOR)[0]
    depths = np.array([-2.0, 0.0, 0.5 * NEAR, 2.0])
    points = jnp.asarray((np.array([[0.1, 0.1, depth] for depth in depths]) - TRANSLATION) @ rotation)

    def total(means):
        image = project(camera, Sog.from_arrays(means, jnp.full(4, 0.05), jnp.zeros((4, 3))))
        return jnp.sum(jnp.where(image.mask[:, None], image.means, 0.0)) + jnp.sum(image.sigmas)

    blobs = Sog.from_arrays(points, jnp.full(4, 0.05), jnp.zeros((4, 3)))
    assert project(camera, blobs).mask.tolist() == [False, False, False, True]
    gradient = np.asarray(jax.jit(jax.grad(total))(points))
    assert np.isfinite(gradient).all()
    assert (gradient[:3] == 0.0).all()
    assert (gradient[3] != 0.0).any()


FISHEYE = np.array([[420.0, 0.0, 640.0], [0.0, 415.0, 480.0], [0.0, 0.0, 1.0]])
FISHEYE_LENSES = [(0.0, 0.0, 0.0, 0.0), (0.06, -0.03, 0.01, -0.002), (-0.03, 0.004, 0.0, 0.0)]


def fisheye_camera(coefficients, fisheye=True):
    return Camera(
        intrinsics=jnp.asarray(FISHEYE),
        camera_from_world=jnp.eye(4),
        distortion=jnp.asarray(np.append(coefficients, 0.0)),
        image_size=jnp.array([1280.0, 960.0]),
        fisheye=jnp.array(fisheye),
    )


@pytest.mark.parametrize("lens", FISHEYE_LENSES)
def test_fisheye_distortion_is_opencvs(lens):
    """Angles up to 75 degrees from the axis, and the axis itself."""
    rng = np.random.default_rng(2)
    angles, turns = rng.uniform(0.0, 1.3, 60), rng.uniform(0.0, 2.0 * np.pi, 60)
    rays = np.tan(angles)[:, None] * np.stack([np.cos(turns), np.sin(turns)], 1)
    rays[0] = 0.0
    camera = fisheye_camera(lens)
    undistorted = rays * FISHEYE[[0, 1], [0, 1]] + FISHEYE[:2, 2]
    recorded = cv2.fisheye.distortPoints(rays[:, None], FISHEYE, np.array(lens)).reshape(-1, 2)
    np.testing.assert_allclose(distort(camera, jnp.asarray(undistorted)), recorded, atol=PIXELS)
    inside = np.asarray(recorded)
    expected = cv2.fisheye.undistortPoints(inside[:, None], FISHEYE, np.array(lens), P=FISHEYE).reshape(-1, 2)
    found = np.asarray(undistort(camera, jnp.asarray(inside)))
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=0.05)
    np.testing.assert_allclose(distort(camera, jnp.asarray(found)), inside, atol=PIXELS)


@pytest.mark.slow
def test_fisheye_and_polynomial_cameras_in_one_stack():
    one, other = fisheye_camera(FISHEYE_LENSES[1]), fisheye_camera((-0.2, 0.05, 0.001, -0.002), fisheye=False)
    both = jax.tree.map(lambda *leaves: jnp.stack(leaves), one, other)
    pixels = jnp.asarray(np.random.default_rng(3).uniform([300.0, 200.0], [1000.0, 700.0], (20, 2)))
    for function in (distort, undistort):
        stacked = jax.jit(jax.vmap(function, in_axes=(0, None)))(both, pixels)
        np.testing.assert_allclose(stacked[0], function(one, pixels), atol=PIXELS)
        plain = Camera(other.intrinsics, other.camera_from_world, other.distortion, other.image_size)
        np.testing.assert_allclose(stacked[1], function(plain, pixels), atol=PIXELS)
        gradients = jax.grad(lambda p, f=function: jnp.sum(jax.vmap(f, in_axes=(0, None))(both, p)))(pixels)
        assert np.isfinite(gradients).all()


def test_what_a_fisheye_lens_shows_beside_and_behind_stays_finite():
    camera = fisheye_camera((0.0, 0.0, 0.0, 0.0))
    far = jnp.array([[640.0 + 420.0 * 3.0, 480.0], [640.0, 480.0 - 415.0 * 1.6], [640.0, 480.0]])
    found = np.asarray(undistort(camera, far))
    rim = np.tan(MAX_FISHEYE_ANGLE)
    np.testing.assert_allclose(
        found, [[640.0 + 420.0 * rim, 480.0], [640.0, 480.0 - 415.0 * rim], [640.0, 480.0]], rtol=1e-4
    )


@pytest.mark.slow
def test_sizes_grow_as_the_picture_does():
    """Against finite differences in the middle, at 40 degrees, and bounded at the rim; polynomial lenses leave them."""
    camera = fisheye_camera(FISHEYE_LENSES[1])
    pixels = np.array([[640.0, 480.0], [640.0 + 300.0, 480.0], [640.0, 480.0 - 280.0], [640.0 + 610.0, 480.0]])
    sizes = np.asarray(undistorted_sizes(camera, jnp.asarray(pixels), jnp.full(4, 8.0)))

    def opencv(where):
        return cv2.fisheye.undistortPoints(
            where.reshape(-1, 1, 2), FISHEYE, np.array(FISHEYE_LENSES[1]), P=FISHEYE
        ).reshape(-1, 2)

    step = 0.5 * np.eye(2)
    by_x, by_y = (opencv(pixels + s) - opencv(pixels - s) for s in step)
    expected = 8.0 * np.sqrt(np.abs(by_x[:, 0] * by_y[:, 1] - by_x[:, 1] * by_y[:, 0]))
    np.testing.assert_allclose(sizes[:3], expected[:3], rtol=1e-2)
    assert 8.0 < sizes[3] <= 32.0
    polynomial = make_camera((-0.2, 0.06, -0.001, 0.002, -0.01))
    np.testing.assert_array_equal(undistorted_sizes(polynomial, jnp.asarray(pixels), jnp.full(4, 8.0)), np.full(4, 8.0))
