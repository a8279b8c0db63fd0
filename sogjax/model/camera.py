"""Pinhole cameras: projection of 3-D blobs (Eq. 4) and undistortion of image blob centres."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.model.compiled import applied
from sogjax.model.rotation import transform_points
from sogjax.model.sog import Sog

NEAR = 0.05
"""Metres. A blob nearer to the camera plane than this, or behind it, is not seen."""

UNDISTORT_ITERATIONS = 12

MAX_FISHEYE_ANGLE = 1.45
"""Radians from the optical axis (83 degrees). What a fisheye lens shows beyond lies here when it is undistorted: a
pinhole picture ends at 90 degrees."""

MAX_MAGNIFICATION = 4.0

CELL_MARGIN = 0.2
"""Picture sizes outside the picture within which the lens model is asked for a cell."""


class Camera(eqx.Module):
    """A calibrated camera with OpenCV axes (x right, y down, z forward), or a stack of them.

    Pixel (0, 0) is the centre of the first pixel. The images keep their lens distortion: blob centres of the
    images are undistorted once (`undistort`), so that projection is the plain pinhole of Eq. 4.
    """

    intrinsics: Float[Array, "*camera 3 3"]
    camera_from_world: Float[Array, "*camera 4 4"]
    distortion: Float[Array, "*camera 5"]
    """OpenCV's k1 k2 p1 p2 k3; of a fisheye lens k1 k2 k3 k4 and a 0."""
    image_size: Float[Array, "*camera 2"]
    """Width and height in pixels."""
    fisheye: Bool[Array, "*camera"] | None = None
    """Which cameras have OpenCV's fisheye model; None if no camera has it: nothing is computed for it then."""

    @property
    def focal_length(self) -> Float[Array, "*camera"]:
        """One focal length in pixels: the geometric mean of fx and fy."""
        return jnp.sqrt(self.intrinsics[..., 0, 0] * self.intrinsics[..., 1, 1])


def camera_of(cameras: Camera, index: int) -> Camera:
    """One camera of a stack."""
    return jax.tree.map(lambda leaf: jnp.asarray(np.asarray(leaf)[index]), cameras)


def project_points(camera: Camera, points_world: Float[Array, "n 3"]) -> tuple[Float[Array, "n 2"], Float[Array, "n"]]:
    """Undistorted pixels and depths (metres) of points; a depth below `NEAR` marks a pixel as meaningless."""
    pose = jnp.broadcast_to(camera.camera_from_world, (points_world.shape[0], 4, 4))
    points_camera = transform_points(pose, points_world)
    depth = points_camera[:, 2]
    safe_depth = jnp.where(depth > NEAR, depth, 1.0)
    rays = points_camera[:, :2] / safe_depth[:, None]
    matrix = camera.intrinsics
    pixels = applied(matrix[None, :2, :2], rays) + matrix[None, :2, 2]
    return pixels, depth


def point_depths(camera: Camera, points_world: Float[Array, "n 3"]) -> Float[Array, "n"]:
    """Depths of points along the camera's axis (metres)."""
    return (
        jnp.matmul(points_world, camera.camera_from_world[2, :3], precision="highest") + camera.camera_from_world[2, 3]
    )


def projection_jacobian(camera: Camera, points_world: Float[Array, "n 3"]) -> Float[Array, "n 2 3"]:
    """Derivatives of the pixels of points by the points (pixels per metre); 0 for points nearer than `NEAR`."""
    rotation = camera.camera_from_world[:3, :3]
    points_camera = jnp.matmul(points_world, rotation.T, precision="highest") + camera.camera_from_world[None, :3, 3]
    depth = points_camera[:, 2]
    inverse = jnp.where(depth > NEAR, 1.0 / jnp.where(depth > NEAR, depth, 1.0), 0.0)
    rays = points_camera[:, :2] * inverse[:, None]
    by_ray = (rotation[None, :2, :] - rays[:, :, None] * rotation[None, 2:, :]) * inverse[:, None, None]
    return jnp.einsum("ij,njk->nik", camera.intrinsics[:2, :2], by_ray, precision="highest")


def project(camera: Camera, blobs: Sog) -> Sog:
    """Project a 3-D Sog into the image of one camera (Eq. 4): undistorted pixels.

    Blobs behind the camera, or nearer than `NEAR`, are masked out; their gradient is zero.
    """
    pixels, depth = project_points(camera, blobs.means)
    seen = blobs.mask & (depth > NEAR)
    sigmas = blobs.sigmas * camera.focal_length / jnp.where(seen, depth, 1.0)
    return Sog(
        means=jnp.where(seen[:, None], pixels, 0.0),
        sigmas=jnp.where(seen, sigmas, 1.0),
        colors=blobs.colors,
        mask=seen,
    )


def distort(camera: Camera, pixels: Float[Array, "n 2"]) -> Float[Array, "n 2"]:
    """Where the lens puts undistorted `pixels` in the picture as recorded (OpenCV's models)."""
    rays = _rays_from_pixels(camera, pixels)
    distorted = _distort_rays(_polynomial(camera), rays)
    if camera.fisheye is not None:
        distorted = jnp.where(camera.fisheye, _fisheye_rays(camera.distortion, rays), distorted)
    return _pixels_from_rays(camera, distorted)


def near_picture(camera: Camera, pixels: Float[Array, "n 2"], margin: float) -> Bool[Array, "n"]:
    """Whether `distort` means something for undistorted `pixels`: at most `margin` picture sizes outside.

    Farther out the polynomial model folds back; the fisheye model does not.
    """
    size = camera.image_size[None, :]
    near = jnp.all((pixels > -margin * size) & (pixels < (1.0 + margin) * size), axis=1)
    return near if camera.fisheye is None else near | camera.fisheye


def cells_at(
    camera: Camera, cell_size: Float[Array, ""], pixels: Float[Array, "n 2"]
) -> tuple[Int[Array, "n 2"], Bool[Array, "n"]]:
    """The cell (column, row) of the picture as recorded that shows undistorted `pixels`, and which of them are in it.

    Cells are squares with sides of `cell_size` pixels; for what is outside the picture, a cell of it all the same.
    """
    recorded = distort(camera, pixels)
    inside = jnp.all((recorded > -0.5) & (recorded < camera.image_size[None, :] - 0.5), axis=1)
    inside &= near_picture(camera, pixels, CELL_MARGIN)
    return jnp.floor((jnp.where(inside[:, None], recorded, 0.0) + 0.5) / cell_size).astype(jnp.int32), inside


def undistort(camera: Camera, pixels: Float[Array, "n 2"]) -> Float[Array, "n 2"]:
    """Undistorted pixels of `pixels` in the picture as recorded, by iteration."""
    distorted = _rays_from_pixels(camera, pixels)
    coefficients, rays = _polynomial(camera), distorted
    for _ in range(UNDISTORT_ITERATIONS):
        rays = rays - (_distort_rays(coefficients, rays) - distorted)
    if camera.fisheye is not None:
        rays = jnp.where(camera.fisheye, _rays_of_fisheye(camera.distortion, distorted), rays)
    return _pixels_from_rays(camera, rays)


def undistorted_sizes(camera: Camera, pixels: Float[Array, "n 2"], sizes: Float[Array, "n"]) -> Float[Array, "n"]:
    """Lengths (pixels) around `pixels` of the picture as recorded, after `undistort`.

    Polynomial distortion is weak and leaves them; a fisheye picture grows towards its border, by at most
    `MAX_MAGNIFICATION`.
    """
    if camera.fisheye is None:
        return sizes
    x, y = jnp.eye(2, dtype=pixels.dtype)
    moved = lambda direction: jax.jvp(
        lambda where: undistort(camera, where), (pixels,), (jnp.broadcast_to(direction, pixels.shape),)
    )[1]
    by_x, by_y = moved(x), moved(y)
    area = jnp.abs(by_x[:, 0] * by_y[:, 1] - by_x[:, 1] * by_y[:, 0])
    growth = jnp.clip(jnp.sqrt(jnp.maximum(area, 1e-6)), 1.0 / MAX_MAGNIFICATION, MAX_MAGNIFICATION)
    return jnp.where(camera.fisheye, sizes * growth, sizes)


def _rays_from_pixels(camera: Camera, pixels: Float[Array, "n 2"]) -> Float[Array, "n 2"]:
    focal = jnp.stack([camera.intrinsics[0, 0], camera.intrinsics[1, 1]])
    return (pixels - camera.intrinsics[None, :2, 2]) / focal[None, :]


def _pixels_from_rays(camera: Camera, rays: Float[Array, "n 2"]) -> Float[Array, "n 2"]:
    focal = jnp.stack([camera.intrinsics[0, 0], camera.intrinsics[1, 1]])
    return rays * focal[None, :] + camera.intrinsics[None, :2, 2]


def _polynomial(camera: Camera) -> Float[Array, "5"]:
    """The coefficients of the polynomial model: 0 for a fisheye camera, so that this branch stays finite."""
    if camera.fisheye is None:
        return camera.distortion
    return jnp.where(camera.fisheye, jnp.zeros_like(camera.distortion), camera.distortion)


def _distort_rays(distortion: Float[Array, "5"], rays: Float[Array, "n 2"]) -> Float[Array, "n 2"]:
    k1, k2, p1, p2, k3 = distortion
    x, y = rays[:, 0], rays[:, 1]
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return jnp.stack(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
        ],
        axis=-1,
    )


def _fisheye_rays(distortion: Float[Array, "5"], rays: Float[Array, "n 2"]) -> Float[Array, "n 2"]:
    """A ray at the angle t from the axis goes to the radius t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8)."""
    radius = _safe_lengths(rays)
    return rays * (_fisheye_radius(distortion, jnp.arctan(radius)) / radius)[:, None]


def _rays_of_fisheye(distortion: Float[Array, "5"], distorted: Float[Array, "n 2"]) -> Float[Array, "n 2"]:
    """The inverse, by Newton's steps for the angle, which stays below `MAX_FISHEYE_ANGLE`."""
    radius = _safe_lengths(distorted)
    inside = lambda angle: jnp.clip(angle, 0.0, MAX_FISHEYE_ANGLE)
    angle = inside(radius)
    for _ in range(UNDISTORT_ITERATIONS):
        value, slope = jax.jvp(lambda t: _fisheye_radius(distortion, t), (angle,), (jnp.ones_like(angle),))
        angle = inside(angle - (value - radius) / jnp.where(jnp.abs(slope) > 1e-3, slope, 1e-3))
    return distorted * (jnp.tan(angle) / radius)[:, None]


def _fisheye_radius(distortion: Float[Array, "5"], angle: Float[Array, "n"]) -> Float[Array, "n"]:
    k1, k2, k3, k4, _ = distortion
    squared = angle * angle
    return angle * (1.0 + squared * (k1 + squared * (k2 + squared * (k3 + squared * k4))))


def _safe_lengths(rays: Float[Array, "n 2"]) -> Float[Array, "n"]:
    """Lengths, not quite 0 on the axis, where the ratio of two of them still means something."""
    return jnp.sqrt(jnp.sum(rays * rays, axis=1) + 1e-12)
