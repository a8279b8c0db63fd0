"""Frames that somebody should look at: the person cut out of some cameras' pictures, with the skeleton on it."""

from collections.abc import Iterable, Sequence

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.io.calibration.rig import CameraRig
from sogjax.io.motion import Motion
from sogjax.view.overlay import Overlay
from sogjax.view.projection import picture_points
from sogjax.view.tiles import write_label

CAMERAS = 4
"""The cameras that are shown of each frame at most, spread evenly over all."""
HEIGHT = 320
"""Height of a cut-out in pixels."""


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
    overlays = {k: Overlay(rig, motions, cameras=[rig.names[k]], width=rig.image_size(rig.names[k])[0]) for k in chosen}
    rows = []
    for frame, images in frames:
        means = [motion.blob_means[motion.frame == frame].reshape(-1, 3) for motion in motions]
        pixels = picture_points(rig, np.concatenate(means)[None].astype(np.float32))[0][:, 0]
        cuts = [_cut(overlay.draw(images, frame), pixels[k], rig.names[k]) for k, overlay in overlays.items()]
        row = np.hstack(cuts)
        write_label(row, f"frame {frame}", (6, HEIGHT - 8))
        rows.append(row)
    width = max(row.shape[1] for row in rows)
    return np.vstack([np.pad(row, ((0, 0), (0, width - row.shape[1]), (0, 0))) for row in rows])


def _cut(image: np.ndarray, points: Float[np.ndarray, "point 2"], name: str) -> UInt8[np.ndarray, "height width 3"]:
    """The part of a picture around points, with a border of a fifth of their size; all of it where it shows none."""
    points = points[np.isfinite(points).all(axis=1)]
    if len(points):
        lowest, highest = points.min(axis=0), points.max(axis=0)
        border = 0.2 * (highest - lowest).max() + 4.0
        size = np.array(image.shape[1::-1])
        low = np.clip(lowest - border, 0, size - 2).astype(int)
        high = np.clip(np.ceil(highest + border), low + 2, size).astype(int)
        image = image[low[1] : high[1], low[0] : high[0]]
    width = max(round(image.shape[1] * HEIGHT / image.shape[0]), 2)
    cut = cv2.resize(image, (width, HEIGHT), interpolation=cv2.INTER_AREA)
    write_label(cut, name, (6, 14))
    return cut  # pyright: ignore[reportReturnType]
