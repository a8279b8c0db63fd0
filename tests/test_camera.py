"""The camera against OpenCV's own projection and undistortion."""

import cv2
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from sogjax.model.camera import NEAR, Camera, distort, project, project_points, undistort
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
