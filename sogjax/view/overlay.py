"""The tracked skeleton drawn over the pictures of all cameras: one grid per frame, or a whole video."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8

from sogjax.errors import InputError
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.motion import Motion
from sogjax.view.bones import Bones, actor_palette, blob_palette, bones_from_motion, doubtful_edges
from sogjax.view.projection import picture_points
from sogjax.view.tiles import Fit, grid_for, shrink

SUBPIXEL_BITS = 4
DASH, MOST_DASHES = 3.0, 64
"""Length of a dash in units of the line's width; how many a line has at most, wherever it goes."""
Point = tuple[int, int]
Color = tuple[int, int, int]
WIDTH = 1920
"""Pixels; the grid's largest width."""


@dataclass(frozen=True)
class _Drawing:
    """One actor, projected into all cameras."""

    row_of: dict[int, int]
    """The motion's row by frame."""
    bones: Bones
    pixels: Float[np.ndarray, "camera frame point 2"]
    colors: UInt8[np.ndarray, "3 3"]
    doubtful: Bool[np.ndarray, "frame edge"]
    """Which bones belong to a limb in doubt."""
    blob_pixels: Float[np.ndarray, "camera frame blob 2"] | None
    blob_radii: Float[np.ndarray, "camera frame blob"] | None
    blob_colors: UInt8[np.ndarray, "blob 3"]


class Overlay:
    """Draws motions over pictures; everything is projected once, when it is made.

    Args:
        rig: all cameras, in the order of the pictures that are drawn on.
        motions: one for each actor.
        cameras: the names of those to show, in this order; default all.
        width: largest width of the grid in pixels.
        columns: tiles in a row; default as suits a wide screen.
        blobs: draw the blobs too, as circles of radius sigma.
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
        columns: int | None = None,
        blobs: bool = False,
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
        self.grid = grid_for(sizes, width, columns)
        self.fits = [self.grid.fit(k, size) for k, size in enumerate(sizes)]
        lines = [bones_from_motion(motion) for motion in motions] if bones is None else bones
        self.drawings = [
            _drawing(chosen, self.fits, motion, lines[actor], actor, blobs) for actor, motion in enumerate(motions)
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
            image = images[camera]
            if image is not None:
                fit.place(canvas, image)
            area = canvas[fit.top : fit.top + fit.height, fit.left : fit.left + fit.width]
            for drawing in self.drawings:
                if frame in drawing.row_of:
                    _draw_actor(area, drawing, k, drawing.row_of[frame])
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
    columns: int | None = None,
    blobs: bool = False,
) -> UInt8[np.ndarray, "h w 3"]:
    """One grid (BGR); see `Overlay`, which is faster for several frames."""
    overlay = Overlay(rig, motions, cameras=cameras, width=width, columns=columns, blobs=blobs)
    return overlay.draw(images, frame)


def _drawing(rig: CameraRig, fits: list[Fit], motion: Motion, bones: Bones, actor: int, blobs: bool) -> _Drawing:
    """Project an actor, and scale to the tiles."""
    pixels, _ = picture_points(rig, bones.points(motion))
    blob_pixels = blob_radii = None
    if blobs:
        blob_pixels, depths = picture_points(rig, motion.blob_means.astype(np.float32))
        focal = np.asarray(rig.cameras.focal_length, np.float32)[:, None, None]
        scale = np.array([fit.scale_x for fit in fits], np.float32)[:, None, None]
        blob_radii = scale * focal * motion.blob_sigma.astype(np.float32) / np.maximum(depths, 1e-3)
        blob_pixels = _in_tiles(fits, blob_pixels)
    return _Drawing(
        row_of={int(frame): row for row, frame in enumerate(motion.frame)},
        bones=bones,
        pixels=_in_tiles(fits, pixels),
        colors=actor_palette(actor),
        doubtful=doubtful_edges(motion, bones),
        blob_pixels=blob_pixels,
        blob_radii=blob_radii,
        blob_colors=blob_palette(motion, actor),
    )


def _in_tiles(
    fits: list[Fit], pixels: Float[np.ndarray, "camera frame point 2"]
) -> Float[np.ndarray, "camera frame point 2"]:
    return np.stack([fit.pixels(part) for fit, part in zip(fits, pixels, strict=True)])


def _draw_actor(area: np.ndarray, drawing: _Drawing, camera: int, row: int) -> None:
    thick = max(1, round(area.shape[0] / 200))
    if drawing.blob_pixels is not None and drawing.blob_radii is not None:
        _draw_blobs(area, drawing.blob_pixels[camera, row], drawing.blob_radii[camera, row], drawing.blob_colors)
    seen, points = _fixed_point(drawing.pixels[camera, row])
    lines = zip(drawing.bones.edges, drawing.bones.sides, drawing.doubtful[row], strict=True)
    for (a, b), side, doubtful in lines:
        if seen[a] and seen[b]:
            draw = _dashed_line if doubtful else _line
            draw(area, points[a], points[b], _bgr(drawing.colors[side]), thick)
    radius = int((0.5 * thick + 1.0) * 2**SUBPIXEL_BITS)
    for k in range(drawing.bones.num_joints):
        if seen[k]:
            cv2.circle(area, points[k], radius, (255, 255, 255), -1, cv2.LINE_AA, SUBPIXEL_BITS)


def _line(area: np.ndarray, a: Point, b: Point, color: Color, thick: int) -> None:
    cv2.line(area, a, b, color, thick, cv2.LINE_AA, SUBPIXEL_BITS)


def _dashed_line(area: np.ndarray, a: Point, b: Point, color: Color, thick: int) -> None:
    """Dashes on a black line, which differ from a limb that is not in doubt by their shape, too."""
    _line(area, a, b, (0, 0, 0), thick + 2)
    start, along = np.array(a, float), np.array(b, float) - np.array(a, float)
    count = max(1, round(float(np.hypot(*along)) / (2.0 * DASH * thick * 2**SUBPIXEL_BITS)))
    for k in range(min(count, MOST_DASHES)):
        begin, end = (np.rint(start + (k + part) / count * along).astype(int) for part in (0.0, 0.5))
        _line(area, (int(begin[0]), int(begin[1])), (int(end[0]), int(end[1])), color, thick)


def _draw_blobs(
    area: np.ndarray,
    pixels: Float[np.ndarray, "blob 2"],
    radii: Float[np.ndarray, "blob"],
    colors: UInt8[np.ndarray, "blob 3"],
) -> None:
    seen, points = _fixed_point(pixels)
    for k in np.flatnonzero(seen):
        radius = int(min(float(radii[k]), 4096.0) * 2**SUBPIXEL_BITS)
        cv2.circle(area, points[k], radius, _bgr(colors[k]), 1, cv2.LINE_AA, SUBPIXEL_BITS)


def _fixed_point(
    pixels: Float[np.ndarray, "point 2"],
) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Which points are finite, and all as OpenCV's fixed-point numbers."""
    seen = ~np.isnan(pixels.sum(axis=1))
    fixed: Int[np.ndarray, "point 2"] = np.rint(np.where(seen[:, None], pixels, 0) * 2**SUBPIXEL_BITS).astype(int)
    return seen, [(int(x), int(y)) for x, y in fixed]


def _bgr(rgb: UInt8[np.ndarray, "3"]) -> tuple[int, int, int]:
    red, green, blue = (int(value) for value in rgb)
    return blue, green, red


def write_label(area: np.ndarray, text: str, corner: tuple[int, int]) -> None:
    """Small white text on a dark rim, readable on any picture."""
    for color, thick in (((0, 0, 0), 3), ((255, 255, 255), 1)):
        cv2.putText(area, text, corner, cv2.FONT_HERSHEY_SIMPLEX, 0.42, color, thick, cv2.LINE_AA)
