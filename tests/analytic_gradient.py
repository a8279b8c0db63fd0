"""The closed-form gradient of Eq. 10, written pair by pair and joint by joint in numpy, for checking `jax.grad`.

Nothing here is used to track, and nothing of the terms' own formulas, `overlap.py`, the projection or the forward
kinematics is used here: only the numbers held by the models are.
"""

import numpy as np
from jaxtyping import Float

from sogjax.energy.posed import History
from sogjax.energy.priors import AccelerationPenalty, LimitPenalty
from sogjax.energy.similarity import Similarity
from sogjax.energy.views import Views
from sogjax.model.body import Body
from sogjax.model.camera import NEAR

Vector = Float[np.ndarray, "n"]


StandardTerms = tuple[Similarity, LimitPenalty, AccelerationPenalty]


def energy_gradient(body: Body, pose: Vector, views: Views, history: History, terms: StandardTerms) -> Vector:
    """Gradient of Eq. 10 by the pose, in float64."""
    seen, limits, smooth = terms
    transform = np.asarray(body.skeleton.parameter_transform, float)
    joint_params = transform @ np.asarray(pose, float)
    by_joint_param = float(seen.weight) * _similarity_gradient(body, joint_params, views, seen)
    by_joint_param -= float(limits.weight) * _limit_gradient(body, joint_params)
    gradient = transform.T @ by_joint_param
    if bool(history.known):
        middle = 0.5 * (np.asarray(history.before_previous, float) + np.asarray(pose, float))
        gradient -= float(smooth.weight) * (middle - np.asarray(history.previous, float))
    return gradient


def _limit_gradient(body: Body, joint_params: Vector) -> Vector:
    lower, upper = (np.asarray(limit, float) for limit in body.skeleton.joint_limits())
    too_high = np.where(joint_params > upper, joint_params - upper, 0.0)
    too_low = np.where(joint_params < lower, joint_params - lower, 0.0)
    return 2.0 * (too_high + too_low)


def _similarity_gradient(body: Body, joint_params: Vector, views: Views, similarity: Similarity) -> Vector:
    """Sum over cameras and blobs of dE/d(blob position) . d(blob position)/d(joint parameter)."""
    origins, rotations = _joint_frames(body, joint_params)
    offsets = np.asarray(body.blobs.offsets, float)
    positions = np.array([origins[j] + rotations[j] @ o for j, o in zip(body.blobs.joints, offsets, strict=True)])
    by_position = _position_gradients(body, positions, views, similarity)
    axes = np.asarray(body.skeleton.axes, float)
    revolute = np.asarray(body.skeleton.revolute)
    gradient = np.zeros(len(joint_params))
    for blob, joint in enumerate(body.blobs.joints):
        ancestor = joint
        while ancestor >= 0:
            axis = rotations[ancestor] @ axes[ancestor]
            moved = np.cross(axis, positions[blob] - origins[ancestor]) if revolute[ancestor] else axis
            gradient[ancestor] += moved @ by_position[blob]
            ancestor = body.skeleton.parents[ancestor]
    return gradient


def _joint_frames(body: Body, joint_params: Vector) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Origin and rotation of every joint's frame, by walking the tree; Rodrigues' formula for the rotations."""
    skeleton = body.skeleton
    offsets, axes = np.asarray(skeleton.offsets, float), np.asarray(skeleton.axes, float)
    origins: list[np.ndarray] = []
    rotations: list[np.ndarray] = []
    for joint, parent in enumerate(skeleton.parents):
        origin, rotation = (origins[parent], rotations[parent]) if parent >= 0 else (np.zeros(3), np.eye(3))
        value, axis = joint_params[joint], axes[joint]
        origin = origin + rotation @ offsets[joint]
        if skeleton.revolute[joint]:
            columns = [
                e * np.cos(value) + np.cross(axis, e) * np.sin(value) + axis * (axis @ e) * (1 - np.cos(value))
                for e in np.eye(3)
            ]
            rotation = rotation @ np.stack(columns, axis=1)
        else:
            origin = origin + rotation @ (axis * value)
        origins.append(origin)
        rotations.append(rotation)
    return origins, rotations


def _position_gradients(body: Body, positions: np.ndarray, views: Views, similarity: Similarity) -> np.ndarray:
    """Gradient of Eq. 9 by the position of every blob in the world."""
    gradients = np.zeros_like(positions)
    num_cameras = len(views.normalizers)
    for camera in range(num_cameras):
        world = np.asarray(views.cameras.camera_from_world[camera], float)
        matrix = np.asarray(views.cameras.intrinsics[camera], float)
        points = positions @ world[:3, :3].T + world[:3, 3]
        in_camera = _one_camera(body, points, matrix, camera, views, similarity)
        gradients += in_camera @ world[:3, :3] / float(views.normalizers[camera]) / num_cameras
    return gradients


def _one_camera(
    body: Body, points: np.ndarray, matrix: np.ndarray, camera: int, views: Views, similarity: Similarity
) -> np.ndarray:
    """Gradient of Eq. 8 by the position of every blob in the frame of one camera."""
    focal = np.sqrt(matrix[0, 0] * matrix[1, 1])
    image_means = np.asarray(views.images.means[camera], float)
    image_sigmas = np.asarray(views.images.sigmas[camera], float)
    colors = np.asarray(views.color_similarities[camera], float)
    body_sigmas = np.asarray(body.blob_sigmas, float)
    k = float(similarity.exponent)
    seen = [b for b in range(len(points)) if points[b, 2] > NEAR]
    pixel = {b: matrix[:2, :2] @ (points[b, :2] / points[b, 2]) + matrix[:2, 2] for b in seen}
    sigma = {b: body_sigmas[b] * focal / points[b, 2] for b in seen}
    gradient = np.zeros_like(points)
    for i in range(len(image_sigmas)):
        variance = {b: sigma[b] ** 2 + image_sigmas[i] ** 2 for b in seen}
        away = {b: image_means[i] - pixel[b] for b in seen}
        overlap = {
            b: colors[b, i]
            * 2.0
            * np.pi
            * (sigma[b] * image_sigmas[i]) ** 2
            / variance[b]
            * np.exp(-k * (away[b] @ away[b]) / variance[b])
            for b in seen
        }
        if similarity.capped and sum(overlap.values()) >= np.pi * image_sigmas[i] ** 2:
            continue
        for b in seen:
            by_pixel = overlap[b] * 2.0 * k * away[b] / variance[b]
            growth = image_sigmas[i] ** 2 / (sigma[b] ** 2 * variance[b]) + k * (away[b] @ away[b]) / variance[b] ** 2
            by_sigma = overlap[b] * 2.0 * sigma[b] * growth
            by_ray = matrix[:2, :2].T @ by_pixel
            x, y, z = points[b]
            gradient[b] += [
                by_ray[0] / z,
                by_ray[1] / z,
                -(by_ray[0] * x + by_ray[1] * y) / z**2 - by_sigma * sigma[b] / z,
            ]
    return gradient
