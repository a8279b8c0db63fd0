"""The pictures of a page: what the cameras show of the actors, cut out, with skeletons or silhouettes over it."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float, UInt8

from sogjax.io.calibration.rig import CameraRig
from sogjax.io.motion import Motion
from sogjax.view.bones import actor_palette
from sogjax.view.overlay import Overlay
from sogjax.view.page.sight import HALF, SeenBlobs, seen_blobs
from sogjax.view.tiles import shrink, write_label

TILE = 470
"""Width of a camera's part in pixels, where there are several."""
BORDER = 0.12
"""Part of the actors' extent that is shown around them."""
LEAST = 0.3
"""Part of a picture's width that is shown at least."""

Picture = UInt8[np.ndarray, "_h _w 3"]
"""BGR."""
FramePictures = tuple[int, Sequence[Picture | None]]
"""The recording's number of a frame, and the pictures of all cameras of the rig, at any size."""


@dataclass(frozen=True)
class Cut:
    """The part of a camera's picture that is shown."""

    camera: int
    low: Float[np.ndarray, "2"]
    size: Float[np.ndarray, "2"]
    """Pixels of the picture as recorded; parts of it may lie outside, and are black."""
    tile: tuple[int, int]
    """Width and height of what is shown, in pixels."""

    def of(self, drawn: Picture, scale: float) -> Picture:
        """Cut it out of a picture that is `scale` times as large as recorded."""
        factor = self.tile[0] / (scale * self.size[0])
        while factor < 0.5:
            drawn, scale, factor = shrink(drawn, (drawn.shape[1] // 2, drawn.shape[0] // 2)), scale / 2, factor * 2
        low = scale * self.low
        matrix = np.array([[factor, 0.0, -factor * low[0]], [0.0, factor, -factor * low[1]]])
        return cv2.warpAffine(drawn, matrix, self.tile, flags=cv2.INTER_AREA)  # pyright: ignore[reportReturnType]


def cuts(rig: CameraRig, motions: Sequence[Motion], cameras: Sequence[int]) -> list[Cut]:
    """What is shown of each camera: all places where the actors are, in parts of equal shape."""
    seen = [seen_blobs(rig, motion, max(motion.num_frames // 60, 1)) for motion in motions]
    boxes = [_box(rig, camera, seen) for camera in cameras]
    aspect = float(np.clip(np.median([size[0] / size[1] for _, size in boxes]), 0.8, 1.5))
    width = TILE if len(boxes) > 1 else 2 * TILE
    tile = width, round(width / aspect)
    found = []
    for camera, (low, size) in zip(cameras, boxes, strict=True):
        wide = np.array([max(size[0], aspect * size[1]), max(size[1], size[0] / aspect)])
        image = np.array(rig.image_size(rig.names[camera]), float)
        begin = low + 0.5 * (size - wide)
        begin = np.where(wide <= image, np.clip(begin, 0.0, np.maximum(image - wide, 0.0)), 0.5 * (image - wide))
        found.append(Cut(camera, begin, wide, tile))
    return found


def _box(rig: CameraRig, camera: int, seen: Sequence[SeenBlobs]) -> tuple[np.ndarray, np.ndarray]:
    """The lowest pixel and the size of what all blobs need, within the picture."""
    image = np.array(rig.image_size(rig.names[camera]), float)
    pixels = np.concatenate([each.pixels[camera].reshape(-1, 2) for each in seen])
    pixels = np.clip(pixels[np.isfinite(pixels).all(axis=1)], 0.0, image)
    if not len(pixels):
        return np.zeros(2), image
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    border = BORDER * float((high - low).max())
    low, high = np.maximum(low - border, 0.0), np.minimum(high + border, image)
    least = LEAST * image[0]
    return low - 0.5 * np.maximum(least - (high - low), 0.0), np.maximum(high - low, least)


class SkeletonPictures:
    """Draws frames with skeletons, cut to the actors.

    Args:
        rig: all cameras.
        motions: of all actors, in the frames that are drawn at least.
        shown: what is shown of each camera.
        width: of the pictures that are drawn on, in pixels.
    """

    def __init__(self, rig: CameraRig, motions: Sequence[Motion], shown: Sequence[Cut], width: int):
        self._rig, self._shown = rig, shown
        sizes = {cut.camera: rig.image_size(rig.names[cut.camera])[0] for cut in shown}
        self._overlays = {
            camera: Overlay(rig, motions, cameras=[rig.names[camera]], width=min(width, size))
            for camera, size in sizes.items()
        }

    def draw(self, frame: int, images: Sequence[Picture | None]) -> Picture:
        """All cameras of a frame side by side."""
        tiles = []
        for cut in self._shown:
            overlay = self._overlays[cut.camera]
            drawn = overlay.draw(images, frame)
            part = cut.of(drawn, drawn.shape[1] / self._rig.image_size(self._rig.names[cut.camera])[0])
            tiles.append(_named(part, self._rig.names[cut.camera], images[cut.camera] is None))
        return beside(tiles)


def beside(tiles: Sequence[Picture]) -> Picture:
    """Tiles of one size side by side, two in a row."""
    tiles = [*tiles, *[np.zeros_like(tiles[0])] * (len(tiles) > 1 and len(tiles) % 2)]
    gap = np.zeros((tiles[0].shape[0], 4, 3), np.uint8)
    rows = [np.hstack([tiles[k], gap, tiles[k + 1]]) for k in range(0, len(tiles) - 1, 2)] or [tiles[0]]
    line = np.zeros((4, rows[0].shape[1], 3), np.uint8)
    return np.vstack([part for row in rows for part in (row, line)][:-1])


def _named(tile: Picture, name: str, missing: bool) -> Picture:
    write_label(tile, f"{name}: no picture" if missing else name, (10, 26), 0.75)
    return tile


def silhouette_pictures(
    rig: CameraRig, motions: Sequence[Motion], shown: Sequence[Cut], frames: Iterable[FramePictures]
) -> Iterator[tuple[int, Picture]]:
    """Frames in which the outline of each actor's blobs is drawn over the pictures."""
    for frame, images in frames:
        row = [motion.of_rows(motion.frame == frame) for motion in motions]
        seen = [seen_blobs(rig, motion) for motion in row if motion.num_frames]
        tiles = []
        for cut in shown:
            image, size = images[cut.camera], rig.image_size(rig.names[cut.camera])
            plain = np.zeros((size[1] // 2, size[0] // 2, 3), np.uint8) if image is None else image
            tile = cut.of(plain, plain.shape[1] / size[0])
            for number, blobs in enumerate(seen):
                _outline(tile, cut, blobs, number)
            tiles.append(_named(tile, rig.names[cut.camera], image is None))
        yield frame, beside(tiles)


def _outline(tile: Picture, cut: Cut, blobs: SeenBlobs, actor: int) -> None:
    """The outline of discs as large as blobs are where they have fallen to a half, over a faint tint."""
    mask, scale = np.zeros(tile.shape[:2], np.uint8), cut.tile[0] / cut.size[0]
    places = scale * (blobs.pixels[cut.camera, 0] - cut.low)
    radii = scale * HALF * blobs.sigmas[cut.camera, 0]
    for (x, y), radius in zip(places, radii, strict=True):
        if np.isfinite([x, y, radius]).all() and max(abs(x), abs(y), radius) < 1e4:
            cv2.circle(mask, (round(16 * float(x)), round(16 * float(y))), round(16 * float(radius)), 1, -1, shift=4)
    blue, green, red = (int(value) for value in actor_palette(actor)[0][::-1])
    inside = mask > 0
    tile[inside] = np.rint(0.75 * tile[inside] + 0.25 * np.array([blue, green, red])).astype(np.uint8)
    outlines, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(tile, outlines, -1, (blue, green, red), 2, cv2.LINE_AA)
