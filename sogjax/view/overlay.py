"""The tracked skeleton drawn over the pictures of all cameras: one grid per frame, or a whole video."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from sogjax.errors import InputError
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.io.video import VideoWriter
from sogjax.view.bones import Bones, actor_palette, bones_from_motion, doubtful_edges
from sogjax.view.projection import picture_points
from sogjax.view.tiles import Fit, grid_for, shrink, write_label

WIDTH = 1920
"""The grid's largest width in pixels."""
BITS = 4
"""Fractional bits of OpenCV's fixed-point pixels."""
Point = tuple[int, int]


@dataclass(frozen=True)
class _Actor:
    """One actor, projected into all cameras."""

    row_of: dict[int, int]
    """The motion's row by frame."""
    bones: Bones
    pixels: Float[np.ndarray, "camera frame point 2"]
    """Pixels of the tiles."""
    colors: UInt8[np.ndarray, "3 3"]
    doubtful: Bool[np.ndarray, "frame edge"]
    """Whether each bone belongs to a limb in doubt."""


class Overlay:
    """Draws motions over pictures; everything is projected once, when it is made.

    Args:
        rig: all cameras, in the order of the pictures that are drawn on.
        motions: one for each actor.
        cameras: the names of those to show, in this order; default all.
        width: largest width of the grid in pixels.
        height: its largest height in pixels; None: any.
        bones: the lines of each actor; default those of its motion.

    Raises:
        InputError: a camera that the rig does not have, or none at all.
    """

    def __init__(
        self,
        rig: CameraRig,
        motions: Sequence[Motion],
        *,
        cameras: Sequence[str] | None = None,
        width: int = WIDTH,
        height: int | None = None,
        bones: Sequence[Bones] | None = None,
    ) -> None:
        names = tuple(rig.names if cameras is None else cameras)
        unknown = [name for name in names if name not in rig.names]
        if unknown or not names:
            raise InputError(f"cameras = {list(names)}: choose some of {', '.join(rig.names)}")
        self.names = names
        self.shown = [rig.names.index(name) for name in names]
        chosen = rig.select(names)
        sizes = [chosen.image_size(name) for name in names]
        self.grid = grid_for(sizes, width, height)
        self.fits = [self.grid.fit(k, size) for k, size in enumerate(sizes)]
        lines = [bones_from_motion(motion) for motion in motions] if bones is None else bones
        self.actors = [
            _projected(chosen, self.fits, motion, lines[number], number) for number, motion in enumerate(motions)
        ]

    def tile(self, camera: int, image: np.ndarray) -> np.ndarray:
        """A camera's picture at the size that the grid shows it in, which `draw` takes as well."""
        if camera not in self.shown:
            return image
        fit = self.fits[self.shown.index(camera)]
        return shrink(image, (fit.width, fit.height))

    def draw(self, images: Sequence[np.ndarray | None], frame: int) -> UInt8[np.ndarray, "h w 3"]:
        """The grid (BGR) of one frame of the recording.

        Args:
            images: BGR pictures of ALL of the rig's cameras; None leaves a tile black.
            frame: the recording's number of the frame; actors without it are not drawn.
        """
        width, height = self.grid.size
        canvas = np.zeros((height, width, 3), np.uint8)
        for k, (camera, fit) in enumerate(zip(self.shown, self.fits, strict=True)):
            area = fit.area(canvas, images[camera])
            for actor in self.actors:
                if frame in actor.row_of:
                    _draw_actor(area, actor, k, actor.row_of[frame])
            write_label(area, self.names[k], (6, 14))
        write_label(canvas, f"frame {frame}", (6, height - 8))
        return canvas


def overlay_frame(
    images: Sequence[np.ndarray | None],
    rig: CameraRig,
    motions: Sequence[Motion],
    frame: int,
    *,
    cameras: Sequence[str] | None = None,
    width: int = WIDTH,
) -> UInt8[np.ndarray, "h w 3"]:
    """One grid (BGR); see `Overlay`, which is faster for several frames."""
    return Overlay(rig, motions, cameras=cameras, width=width).draw(images, frame)


def _projected(rig: CameraRig, fits: list[Fit], motion: Motion, bones: Bones, number: int) -> _Actor:
    """Project an actor, and scale to the tiles."""
    pixels, _ = picture_points(rig, bones.points(motion))
    return _Actor(
        row_of={int(frame): row for row, frame in enumerate(motion.frame)},
        bones=bones,
        pixels=np.stack([fit.pixels(part) for fit, part in zip(fits, pixels, strict=True)]),
        colors=actor_palette(number),
        doubtful=doubtful_edges(motion, bones),
    )


def _draw_actor(area: np.ndarray, actor: _Actor, camera: int, row: int) -> None:
    thick = max(1, round(area.shape[0] / 200))
    points = _fixed_points(actor.pixels[camera, row])
    for (a, b), side, doubtful in zip(actor.bones.edges, actor.bones.sides, actor.doubtful[row], strict=True):
        if a in points and b in points:
            draw = _dashed_line if doubtful else _line
            draw(area, points[a], points[b], _bgr(actor.colors[side]), thick)
    radius = int((0.5 * thick + 1.0) * 2**BITS)
    for k, point in points.items():
        if k < actor.bones.num_joints:
            cv2.circle(area, point, radius, (255, 255, 255), -1, cv2.LINE_AA, BITS)


def _line(area: np.ndarray, a: Point, b: Point, color: tuple[int, int, int], thick: int) -> None:
    cv2.line(area, a, b, color, thick, cv2.LINE_AA, BITS)


def _dashed_line(area: np.ndarray, a: Point, b: Point, color: tuple[int, int, int], thick: int) -> None:
    """Dashes on a black line, which differ from a limb that is not in doubt by their shape, too.

    They are 3 widths long; a line has 64 at most, wherever it goes.
    """
    _line(area, a, b, (0, 0, 0), thick + 2)
    start, along = np.array(a, float), np.array(b, float) - np.array(a, float)
    count = max(1, round(float(np.hypot(*along)) / (6.0 * thick * 2**BITS)))
    for k in range(min(count, 64)):
        begin, end = (np.rint(start + (k + part) / count * along).astype(int) for part in (0.0, 0.5))
        _line(area, (int(begin[0]), int(begin[1])), (int(end[0]), int(end[1])), color, thick)


def _fixed_points(pixels: Float[np.ndarray, "point 2"]) -> dict[int, Point]:
    """The points that are finite, by their numbers, as OpenCV's fixed-point numbers."""
    seen = np.flatnonzero(~np.isnan(pixels.sum(axis=1)))
    fixed: Int[np.ndarray, "seen 2"] = np.rint(pixels[seen] * 2**BITS).astype(int)
    return {int(k): (int(x), int(y)) for k, (x, y) in zip(seen, fixed, strict=True)}


def _bgr(rgb: UInt8[np.ndarray, "3"]) -> tuple[int, int, int]:
    red, green, blue = (int(value) for value in rgb)
    return blue, green, red


class OverlayVideo:
    """A video (mp4) of motions over the pictures of all cameras, within a `with` block; whole or not there.

    It is 9/16 as high as `width` at most.

    Args:
        path: the video.
        recording: what is tracked.
        fps: frames that are shown per second.
        width: largest width in pixels.
    """

    def __init__(self, path: Path, recording: Recording, fps: float, width: int = WIDTH):
        self._rig, self._width = recording.rig, width
        self._video = VideoWriter(Path(path), fps)
        self._bones: list[Bones] | None = None
        self._empty = self._overlay([])

    def __enter__(self) -> "OverlayVideo":
        self._video.__enter__()
        return self

    def _overlay(self, motions: Sequence[Motion]) -> Overlay:
        return Overlay(self._rig, motions, width=self._width, height=self._width * 9 // 16, bones=self._bones)

    def tile(self, camera: int, image: np.ndarray) -> np.ndarray:
        """A camera's picture (BGR) at the size that is shown; thread-safe."""
        return self._empty.tile(camera, image)

    def write(self, motions: Sequence[Motion], tiles: Iterable[Sequence[np.ndarray | None]]) -> None:
        """Append the frames of motions, one for each actor, that follow; `tiles` of all cameras for each of them."""
        if self._bones is None:
            self._bones = [bones_from_motion(motion) for motion in motions]
        overlay = self._overlay(motions)
        for frame, pictures in zip(motions[0].frame, tiles, strict=True):
            self._video.write(overlay.draw(pictures, int(frame)))

    def __exit__(self, *error: Any) -> None:
        self._video.__exit__(*error)


CAMERAS = 4
"""The cameras that are shown of each frame at most, spread evenly over all."""
HEIGHT = 320
"""Height of a cut-out in pixels."""


def closeups(
    frames: Iterable[tuple[int, Sequence[np.ndarray | None]]], rig: CameraRig, motions: Sequence[Motion]
) -> dict[int, UInt8[np.ndarray, "height _width 3"]]:
    """A picture (BGR) of each frame, cameras side by side.

    Args:
        frames: the recording's numbers, with the BGR pictures of all cameras.
        rig: all cameras.
        motions: of all actors.
    """
    step = max(len(rig) / CAMERAS, 1.0)
    chosen = [int(k * step) for k in range(min(CAMERAS, len(rig)))]
    overlays = {k: Overlay(rig, motions, cameras=[rig.names[k]], width=rig.image_size(rig.names[k])[0]) for k in chosen}
    rows = {}
    for frame, images in frames:
        means = [motion.blob_means[motion.frame == frame].reshape(-1, 3) for motion in motions]
        pixels = picture_points(rig, np.concatenate(means)[None].astype(np.float32))[0][:, 0]
        cuts = [_cut(overlay.draw(images, frame), pixels[k], rig.names[k]) for k, overlay in overlays.items()]
        row = np.hstack(cuts)
        write_label(row, f"frame {frame}", (6, HEIGHT - 8))
        rows[frame] = row
    return rows


def below_each_other(rows: Sequence[UInt8[np.ndarray, "_height _width 3"]]) -> UInt8[np.ndarray, "height width 3"]:
    """Pictures as one."""
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
