"""Where the blobs of motions are in the pictures, and which limbs too few cameras see to place them."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from sogjax.io.calibration.rig import CameraRig
from sogjax.io.motion import Motion
from sogjax.view.projection import picture_points

HALF = 1.1774
"""Radius, in units of sigma, at which a Gaussian has fallen to a half."""
IN_FRONT = 0.08
"""Metres by which a blob must be nearer than another to hide it."""
ENOUGH = 2
"""Cameras that place a limb."""
SHOWN = 0.5
"""Part of a limb's blobs that a camera must see."""
MOST_FRAMES = 400
"""Frames that are looked at; others are like those before them."""


class SeenBlobs(NamedTuple):
    """Blobs in the pictures as recorded."""

    pixels: Float[np.ndarray, "camera frame blob 2"]
    """NaN where a camera cannot show it."""
    sigmas: Float[np.ndarray, "camera frame blob"]
    """Pixels."""
    depths: Float[np.ndarray, "camera frame blob"]
    """Metres."""


MOSTLY = 0.5
"""Part of a limb that things in front hide, above which it counts as hidden."""


def seen_blobs(rig: CameraRig, motion: Motion, step: int = 1) -> SeenBlobs:
    """The blobs of every `step`-th frame."""
    pixels, depths = picture_points(rig, np.asarray(motion.blob_means[::step], np.float32))
    focal = np.asarray(rig.cameras.focal_length, float).reshape(-1, 1, 1)
    sigmas = focal * np.asarray(motion.blob_sigma, float) / np.maximum(depths, 1e-3)
    return SeenBlobs(pixels, sigmas, depths)


def hidden_limbs(rig: CameraRig, motions: Sequence[Motion]) -> list[Bool[np.ndarray, "frame limb"]]:
    """Of each actor, the limbs that fewer than two cameras show, or mostly hidden by what stands in front."""
    step = max(motions[0].num_frames // MOST_FRAMES, 1)
    seen = [seen_blobs(rig, motion, step) for motion in motions]
    joined = SeenBlobs(*(np.concatenate(parts, axis=2) for parts in zip(*seen, strict=True)))
    ends = np.cumsum([0, *(len(motion.blob_sigma) for motion in motions)])
    parts = np.concatenate([_parts(motion) + 1000 * number for number, motion in enumerate(motions)])
    shown = np.stack([_shown(rig, camera, joined, parts) for camera in range(len(rig))])
    rows = np.arange(motions[0].num_frames) // step
    return [
        _hidden(motion, shown[:, :, first:stop])[rows] | _behind_things(motion)
        for motion, first, stop in zip(motions, ends[:-1], ends[1:], strict=True)
    ]


def _behind_things(motion: Motion) -> Bool[np.ndarray, "#frame #limb"]:
    """The limbs that painted or learnt occluders hide mostly."""
    return np.zeros((1, 1), bool) if motion.limb_hidden is None else np.asarray(motion.limb_hidden) > MOSTLY


def _parts(motion: Motion) -> np.ndarray:
    """The limb of each blob; -1 for the trunk's."""
    if motion.joint_limb is None:
        return np.full(len(motion.blob_sigma), -1)
    return np.asarray(motion.joint_limb)[np.asarray(motion.blob_joint, int)]


def _shown(rig: CameraRig, camera: int, blobs: SeenBlobs, parts: np.ndarray) -> Bool[np.ndarray, "frame blob"]:
    """Whether a camera shows the middle of each blob."""
    pixels, sigmas, depths = blobs.pixels[camera], blobs.sigmas[camera].astype(np.float32), blobs.depths[camera]
    size = np.array(rig.image_size(rig.names[camera]))
    with np.errstate(invalid="ignore"):
        inside = ((pixels > -0.5) & (pixels < size - 0.5)).all(axis=-1)
        apart = pixels[:, :, None] - pixels[:, None]
        near = (apart**2).sum(axis=-1) < (HALF * sigmas[:, None]) ** 2
    nearer = depths[:, None] < depths[:, :, None] - IN_FRONT
    others = parts[:, None] != parts[None]
    return inside & ~(near & nearer & others).any(axis=2)


def _hidden(motion: Motion, shown: Bool[np.ndarray, "camera frame blob"]) -> Bool[np.ndarray, "frame limb"]:
    limbs = 0 if motion.limb_names is None else len(motion.limb_names)
    parts, enough = _parts(motion), min(ENOUGH, len(shown))
    seen = [shown[:, :, parts == limb].mean(axis=2) >= SHOWN for limb in range(limbs) if (parts == limb).any()]
    if len(seen) < limbs:
        return np.zeros((shown.shape[1], limbs), bool)
    return (
        np.stack([each.sum(axis=0) < enough for each in seen], axis=1) if seen else np.zeros((shown.shape[1], 0), bool)
    )
