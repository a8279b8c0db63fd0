"""Frames that somebody should look at: the person cut out of some cameras' pictures, with the skeleton on it."""

from collections.abc import Iterable, Sequence

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.io.calibration.rig import CameraRig
from sogjax.io.motion import Motion
from sogjax.view.overlay import Overlay, write_label
from sogjax.view.projection import picture_points

CAMERAS = 4
"""Shown of each frame, at most: spread evenly over all."""
HEIGHT = 320
"""Of a cut-out, pixels."""
BORDER = 0.2
"""Around the body, in parts of its size."""


def closeups(
    frames: Iterable[tuple[int, Sequence[np.ndarray | None]]], rig: CameraRig, motions: Sequence[Motion]
) -> UInt8[np.ndarray, "height width 3"]:
    """One picture (BGR), a row for each frame.

    Args:
        frames: the recording's numbers, with the BGR pictures of all cameras.
        rig: all cameras.
        motions: of all actors.
    """
    step = max(len(rig) / CAMERAS, 1.0)
    chosen = [int(k * step) for k in range(min(CAMERAS, len(rig)))]
    overlays = [
        Overlay(rig, motions, cameras=[rig.names[k]], width=rig.image_size(rig.names[k])[0], columns=1) for k in chosen
    ]
    rows = []
    for frame, images in frames:
        boxes = _boxes(rig, motions, frame)
        drawn = [overlay.draw(images, frame) for overlay in overlays]
        row = np.hstack([_cut(image, boxes[k], rig.names[k]) for k, image in zip(chosen, drawn, strict=True)])
        write_label(row, f"frame {frame}", (6, HEIGHT - 8))
        rows.append(row)
    width = max(row.shape[1] for row in rows)
    return np.vstack([np.pad(row, ((0, 0), (0, width - row.shape[1]), (0, 0))) for row in rows])


def _boxes(rig: CameraRig, motions: Sequence[Motion], frame: int) -> Float[np.ndarray, "camera 2 2"]:
    """Lowest and highest x, y of all actors' blobs; NaN in a camera that sees none."""
    means = [motion.blob_means[motion.frame == frame].reshape(-1, 3) for motion in motions]
    pixels = picture_points(rig, np.concatenate(means)[None].astype(np.float32))[0][:, 0]
    known = np.isfinite(pixels).all(axis=-1, keepdims=True)
    lowest = np.where(known, pixels, np.inf).min(axis=1)
    highest = np.where(known, pixels, -np.inf).max(axis=1)
    boxes = np.stack([lowest, highest], axis=1)
    return np.where(np.isfinite(boxes).all(axis=(1, 2), keepdims=True), boxes, np.nan)


def _cut(image: np.ndarray, box: Float[np.ndarray, "2 2"], name: str) -> UInt8[np.ndarray, "height width 3"]:
    """The part of a picture around a box; all of it where there is none."""
    size = np.array(image.shape[1::-1])
    if np.isfinite(box).all():
        border = BORDER * (box[1] - box[0]).max() + 4.0
        low = np.clip(box[0] - border, 0, size - 2).astype(int)
        high = np.clip(np.ceil(box[1] + border), low + 2, size).astype(int)
        image = image[low[1] : high[1], low[0] : high[0]]
    width = max(round(image.shape[1] * HEIGHT / image.shape[0]), 2)
    cut = cv2.resize(image, (width, HEIGHT), interpolation=cv2.INTER_AREA)
    write_label(cut, name, (6, 14))
    return cut  # pyright: ignore[reportReturnType]
