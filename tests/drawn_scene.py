"""Pictures of a body drawn from its own blobs: discs, the nearest one in front, on a plain background."""

import cv2
import jax.numpy as jnp
import numpy as np
from body_cases import posed
from rig_cases import opencv_pixels

from sogjax.actor.colors import colored
from sogjax.energy.frame_energy import standard_terms
from sogjax.energy.views import whole_image_overlap
from sogjax.scene.cells import CellGrid, stack_cells
from sogjax.scene.quadtree import Candidates
from sogjax.solve.ascent import ConditionedAscent
from sogjax.tracking.culling import ImageReader
from sogjax.tracking.solving import pose_scales
from sogjax.tracking.tracker import Tracker

BACKGROUND = (70, 70, 70)
DISC = 1.35
"""Radius of a disc that a blob of sigma 1 stands for."""


def in_colors(body, hues=(0.0, 170.0)):
    """The body in strong colours that change slowly from blob to blob (hues in OpenCV's half degrees)."""
    hue = np.linspace(*hues, body.num_blobs).astype(np.uint8)
    hsv = np.stack([hue, np.full_like(hue, 220), np.where(np.arange(len(hue)) % 2, 220, 170)], axis=-1)
    rgb = cv2.cvtColor(hsv.astype(np.uint8)[None], cv2.COLOR_HSV2RGB)[0] / 255.0
    return colored(body, rgb)


def standing(body, height, position=(0.0, 0.0)):
    """The rest pose with the root at a height above a place (metres); the world's z points upwards."""
    names = list(body.skeleton.dof_names)
    pose = np.array(body.poses["rest"], np.float32)
    for name, value in zip(("root_x", "root_y", "root_z"), (*position, height), strict=True):
        pose[names.index(name)] = value
    return pose


def draw(body, pose, rig, masks=False, disc=DISC):
    """One BGR image a camera of the rig (or where the body is seen)."""
    blobs, _ = posed(body, jnp.asarray(pose, jnp.float32))
    means, sigmas, colors = (np.asarray(part, float) for part in (blobs.means, blobs.sigmas, blobs.colors))
    images = []
    for name in rig.names:
        camera, (width, height) = rig.camera(name), rig.image_size(name)
        world = np.asarray(camera.camera_from_world, float)
        depth = means @ world[2, :3] + world[2, 3]
        pixels = opencv_pixels(rig, name, means)
        radius = disc * sigmas * float(camera.focal_length) / depth
        image = np.full((height, width, 3), (0, 0, 0) if masks else BACKGROUND, np.uint8)
        for blob in np.argsort(-depth):
            color = (255, 255, 255) if masks else tuple(int(c) for c in np.rint(colors[blob, ::-1] * 255))
            centre = tuple(int(v) for v in np.rint(pixels[blob] * 16))
            cv2.circle(image, centre, int(np.rint(radius[blob] * 16)), color, -1, cv2.LINE_8, 4)
        images.append(image[..., 0] > 0 if masks else image)
    return images


def grids_of(rig, depth):
    return tuple(CellGrid.from_depth(*rig.image_size(name), depth) for name in rig.names)


def cells_of(rig, images, depth):
    return stack_cells(images, grids_of(rig, depth))


def make_tracker(body, rig, depth=6, solver=None, color_space="hsv_cylinder", tolerance=0.15, extrapolation=0.5):
    """A tracker with the settings of a small scene."""
    reader = ImageReader(
        candidates=Candidates.from_grids(grids_of(rig, depth), rig.cameras),
        color_radius=0.3,
        color_tolerance=tolerance,
        color_space=color_space,
    )
    return Tracker(
        body=body,
        cameras=rig.cameras,
        normalizers=whole_image_overlap(rig.cameras.image_size),
        reader=reader,
        terms=standard_terms(acceleration_weight=0.05),
        solver=ConditionedAscent() if solver is None else solver,
        scales=pose_scales(body.skeleton),
        extrapolation=extrapolation,
    )


def landmark_error(body, pose, truth):
    """Mean distance of the landmarks in two poses (metres)."""
    found, expected = (np.asarray(posed(body, jnp.asarray(p, jnp.float32))[1], float) for p in (pose, truth))
    return np.linalg.norm(found - expected, axis=1).mean()


def moved(body, pose, changes):
    """The pose with other values added to some degrees of freedom."""
    pose = np.array(pose, np.float32)
    for name, value in changes.items():
        pose[list(body.skeleton.dof_names).index(name)] += value
    return pose
