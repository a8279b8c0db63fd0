"""Calibrations with a common mistake undone; a check tries which one the pictures fit."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np

from sogjax.io.calibration.rig import CameraRig

_FLIP = np.diag([-1.0, 1.0, 1.0, 1.0])


def unit_rig(rig: CameraRig, scale: float) -> CameraRig:
    """The rig with `scale` (metres) as its unit of length, so that a wrong unit does no harm."""
    poses = np.array(rig.cameras.camera_from_world, float)
    poses[:, :3, 3] /= scale
    return _with_poses(rig, poses)


def mirrored_rig(rig: CameraRig) -> CameraRig:
    """The rig in a world whose x axis is reversed, and the cameras' x axes with it, so that rotations stay such."""
    return _with_poses(rig, _FLIP @ np.asarray(rig.cameras.camera_from_world, float) @ _FLIP)


def exchanged_rig(rig: CameraRig, first: int, second: int) -> CameraRig:
    """The rig with the calibrations of two cameras exchanged; their names keep their order."""
    order = list(range(len(rig)))
    order[first], order[second] = second, first
    return CameraRig(rig.names, rig.select([rig.names[k] for k in order]).cameras)


def _with_poses(rig: CameraRig, poses: np.ndarray) -> CameraRig:
    cameras = rig.cameras
    like = cameras.camera_from_world.dtype
    changed = replace(cameras, camera_from_world=jnp.asarray(poses, like))
    return CameraRig(rig.names, changed)
