"""Whether the people of keypoints are where somebody is seen: detectors find people in mirrors and posters, too."""

from collections.abc import Mapping

import cv2
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from sogjax.model.camera import NEAR, Camera, distort, near_picture, project_points

Mask = Bool[np.ndarray, "_rows _columns"]

LEAST_SEEN = 0.6
"""Share of somebody's keypoints that must be on what is not the background, the mean over the cameras. People have 0.9,
hidden to the hips 0.6; who is nowhere has the share that other people cover by chance."""
FEWEST_POINTS = 4
"""Keypoints in a picture that tell whether somebody is there."""


def seen_share(
    points: Float[np.ndarray, "keypoint 3"], cameras: Mapping[int, Camera], masks: Mapping[int, Mask]
) -> float:
    """The share of a person's keypoints (metres, world; NaN where unknown) on masks, the mean over the cameras.

    `masks` say what is not the background, or may not be, and `cameras` are those of pictures of that size. NaN where
    no camera tells.
    """
    known = points[np.isfinite(points).all(-1)]
    if len(known) < FEWEST_POINTS:
        return float("nan")
    shares = [_on_mask(known, cameras[k], mask) for k, mask in masks.items()]
    told = [share for share in shares if share is not None]
    return float(np.mean(told)) if told else float("nan")


def _on_mask(points: Float[np.ndarray, "keypoint 3"], camera: Camera, mask: Mask) -> float | None:
    """The share of points on a mask, a pixel beside it included; None: too few are in the picture."""
    undistorted, depths = project_points(camera, jnp.asarray(points, camera.intrinsics.dtype))
    usable = np.asarray(near_picture(camera, undistorted, 0.5)) & (np.asarray(depths) > NEAR)
    pixels = np.asarray(distort(camera, undistorted), float)
    columns, rows = np.rint(np.where(usable[:, None], pixels, -1.0)).astype(int).T
    inside = (rows >= 0) & (rows < mask.shape[0]) & (columns >= 0) & (columns < mask.shape[1])
    if inside.sum() < FEWEST_POINTS:
        return None
    wide = cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    return float(wide[rows[inside], columns[inside]].mean())
