"""How much of an actor its own example poses explain: what a run with it is held against."""

from collections.abc import Sequence

import cv2
import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, UInt8

from sogjax.actor.silhouettes import PosedPictures
from sogjax.energy.posed import Posed
from sogjax.model.body import Body
from sogjax.model.camera import Camera
from sogjax.quality.limb_confidence import frame_fit
from sogjax.quality.limb_evidence import LimbBlobs, blob_evidence
from sogjax.scene.foreground import subject_colors

ROWS = 160
"""Cells of a picture's height, about: colours are compared as tracking compares them."""


def explained_examples(
    body: Body, poses: Sequence[Float[Array, "dof"]], pictures: Sequence[PosedPictures], rig: Camera
) -> float:
    """Part of the visible area that shows the actor's own colours, the mean over its example poses.

    Args:
        body: the actor, upright in the recording's world.
        poses: of the pictures.
        pictures: of the example poses.
        rig: all cameras.
    """
    found = [
        _explained(body, jnp.asarray(pose), *_cells(posed, rig)) for pose, posed in zip(poses, pictures, strict=True)
    ]
    return float(np.mean(found))


def _cells(
    posed: PosedPictures, rig: Camera
) -> tuple[Camera, UInt8[np.ndarray, "camera rows columns 3"], Float[np.ndarray, "camera"], Bool[np.ndarray, "camera"]]:
    """The pictures of a pose (RGB) in cells, the sides of these in pixels, and which cameras have a picture."""
    columns, rows = np.asarray(rig.image_size, int).T
    sides = np.maximum(np.rint(rows / ROWS), 1).astype(int)
    cells = np.zeros((len(rows), int((-(-rows // sides)).max()), int((-(-columns // sides)).max()), 3), np.uint8)
    for k, image in posed.images.items():
        reduced = _averaged(image, int(sides[k]))
        cells[k, : reduced.shape[0], : reduced.shape[1]] = reduced[..., ::-1]
    present = np.isin(np.arange(len(rows)), list(posed.images))
    return rig, cells, sides.astype(np.float32), present


def _averaged(image: UInt8[np.ndarray, "_h _w 3"], side: int) -> UInt8[np.ndarray, "rows columns 3"]:
    height, width = image.shape[:2]
    rows, columns = -(-height // side), -(-width // side)
    whole = cv2.copyMakeBorder(image, 0, rows * side - height, 0, columns * side - width, cv2.BORDER_REPLICATE)
    return cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_AREA)  # pyright: ignore[reportReturnType]


def _explained(
    body: Body,
    pose: Float[Array, "dof"],
    rig: Camera,
    cells: UInt8[np.ndarray, "camera rows columns 3"],
    sides: Float[np.ndarray, "camera"],
    present: Bool[np.ndarray, "camera"],
) -> float:
    colors = subject_colors(np.asarray(body.blob_colors), np.asarray(body.blob_sigmas) ** 2)
    arrays = (jnp.asarray(part) for part in (cells, sides, present, colors.astype(np.float32)))
    return float(_fit(body, LimbBlobs.from_body(body), pose, rig, *arrays))


@eqx.filter_jit
def _fit(
    body: Body, limbs: LimbBlobs, pose: Array, rig: Camera, cells: Array, sides: Array, present: Array, colors: Array
) -> Float[Array, ""]:
    posed = Posed.from_pose(body, pose)
    evidence = blob_evidence(limbs, posed, rig, None, cells, sides, colors, present)
    return frame_fit(limbs, evidence, posed, rig, None).explained[0]
