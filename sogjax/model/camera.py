"""Pinhole cameras: projection of 3-D blobs (Eq. 4) and undistortion of image blob centres."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.model.rotation import transform_points
from sogjax.model.sog import Sog

NEAR = 0.05
"""Metres. A blob nearer to the camera plane than this, or behind it, is not seen."""

UNDISTORT_ITERATIONS = 12


class Camera(eqx.Module):
    """A calibrated camera with OpenCV axes (x right, y down, z forward), or a stack of them.

    Pixel (0, 0) is the centre of the first pixel. The images keep their lens distortion: blob centres of the
    images are undistorted once (`undistort`), so that projection is the plain pinhole of Eq. 4.
    """

    intrinsics: Float[Array, "*camera 3 3"]
    camera_from_world: Float[Array, "*camera 4 4"]
    distortion: Float[Array, "*camera 5"]
    """OpenCV's k1 k2 p1 p2 k3."""
    image_size: Float[Array, "*camera 2"]
    """Width and height in pixels."""

    @property
    def focal_length(self) -> Float[Array, "*camera"]:
        """One focal length in pixels: the geometric mean of fx and fy."""
        return jnp.sqrt(self.intrinsics[..., 0, 0] * self.intrinsics[..., 1, 1])


def project_points(camera: Camera, points_world: Float[Array, "n 3"]) -> tuple[Float[Array, "n 2"], Float[Array, "n"]]:
    """Undistorted pixels and depths (metres) of points; a depth below `NEAR` marks a pixel as meaningless."""
    pose = jnp.broadcast_to(camera.camera_from_world, (points_world.shape[0], 4, 4))
    points_camera = transform_points(pose, points_world)
    depth = points_camera[:, 2]
    safe_depth = jnp.where(depth > NEAR, depth, 1.0)
    rays = points_camera[:, :2] / safe_depth[:, None]
    matrix = camera.intrinsics
    pixels = jnp.einsum("ij,nj->ni", matrix[:2, :2], rays, precision="highest") + matrix[None, :2, 2]
    return pixels, depth


def projection_jacobian(camera: Camera, points_world: Float[Array, "n 3"]) -> Float[Array, "n 2 3"]:
    """Derivatives of the pixels of points by the points (pixels a metre); 0 for points nearer than `NEAR`."""
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
    """Where the lens puts undistorted `pixels` in the picture as recorded (OpenCV's model)."""
    return _pixels_from_rays(camera, _distort_rays(camera.distortion, _rays_from_pixels(camera, pixels)))


def undistort(camera: Camera, pixels: Float[Array, "n 2"]) -> Float[Array, "n 2"]:
    """Undistorted pixels of `pixels` in the picture as recorded, by fixed-point iteration."""
    distorted = _rays_from_pixels(camera, pixels)
    rays = distorted
    for _ in range(UNDISTORT_ITERATIONS):
        rays = rays - (_distort_rays(camera.distortion, rays) - distorted)
    return _pixels_from_rays(camera, rays)


def _rays_from_pixels(camera: Camera, pixels: Float[Array, "n 2"]) -> Float[Array, "n 2"]:
    focal = jnp.stack([camera.intrinsics[0, 0], camera.intrinsics[1, 1]])
    return (pixels - camera.intrinsics[None, :2, 2]) / focal[None, :]


def _pixels_from_rays(camera: Camera, rays: Float[Array, "n 2"]) -> Float[Array, "n 2"]:
    focal = jnp.stack([camera.intrinsics[0, 0], camera.intrinsics[1, 1]])
    return rays * focal[None, :] + camera.intrinsics[None, :2, 2]


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
