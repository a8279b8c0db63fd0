"""What all cameras show of a clip together: where anything moves, and the voxels of the cube around it."""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from sogjax.model.camera import Camera
from sogjax.scene.background_difference import widened
from sogjax.scene.moving_zone import SEEING, SMALLEST_ROOM
from sogjax.scene.segmentation import COARSE_SIDE
from sogjax.scene.visual_hull import Cube, VoxelPixels, cube_around, resized, voxel_pixels

MOVING = 0.25
"""Part of a pixel of the smaller pictures that moves, at least."""

Mask = Bool[np.ndarray, "_h _w"]
Picture = UInt8[np.ndarray, "_h _w 3"]


@dataclass(frozen=True)
class CoarseViews:
    """What the cameras in which anything moves see of the room around it; everything by camera."""

    movements: dict[int, Mask]
    """Where anything moves in the clip, for all cameras."""
    pictures: dict[int, Picture]
    """Typical pictures of the clip, of the same size."""
    cameras: dict[int, Camera]
    up: Float[np.ndarray, "3"]
    """The world's vertical."""
    moving: dict[int, Mask]
    """Where anything moves, in small pictures; the cameras of this and what follows are those that see that."""
    cube: Cube
    pixels: dict[int, VoxelPixels]
    inside: Bool[np.ndarray, "voxel"]
    """The voxels that enough of these cameras have in their pictures."""

    @classmethod
    def of(
        cls,
        movements: Mapping[int, Mask],
        pictures: Mapping[int, Picture],
        cameras: Mapping[int, Camera],
        up: Float[np.ndarray, "3"],
    ) -> "CoarseViews | None":
        """The views of some cameras, from where anything moves in a clip; None: fewer than two see that."""
        moving = {k: small(mask.astype(np.float32), cv2.INTER_AREA) > MOVING for k, mask in movements.items()}
        moving = {k: mask for k, mask in moving.items() if mask.any()}
        if len(moving) < 2:
            return None
        resized_to = {k: resized(cameras[k], (mask.shape[1], mask.shape[0])) for k, mask in moving.items()}
        found = cube_around([*moving.values()], [*resized_to.values()])
        cube = Cube(found.centre, max(found.size, SMALLEST_ROOM))
        pixels = {k: voxel_pixels(cube, resized_to[k], mask.shape) for k, mask in moving.items()}
        inside = np.sum([at.inside for at in pixels.values()], axis=0) >= SEEING * len(moving)
        return cls(dict(movements), dict(pictures), dict(cameras), up, moving, cube, pixels, inside)

    def small_picture(self, camera: int) -> Picture:
        """A camera's picture at the small size."""
        return small(self.pictures[camera], cv2.INTER_AREA)

    def enlarged(self, camera: int, mask: Mask) -> Mask:
        """A small mask at the size of a camera's pictures."""
        return enlarged(mask, self.movements[camera].shape)

    def missed(self, regions: Mapping[int, Mask]) -> dict[int, Bool[np.ndarray, "voxel"]]:
        """The voxels that lie outside of each camera's region."""
        return {k: ~self.pixels[k].hits(widened(mask, self.pixels[k].footprint)) for k, mask in regions.items()}


def small(picture: np.ndarray, interpolation: int) -> np.ndarray:
    """A picture at the small size."""
    scale = min(COARSE_SIDE / max(picture.shape[:2]), 1.0)
    size = (round(scale * picture.shape[1]), round(scale * picture.shape[0]))
    return cv2.resize(picture, size, interpolation=interpolation)


def enlarged(mask: Mask, shape: tuple[int, ...]) -> Mask:
    """A small mask at a picture's size (rows, columns)."""
    return cv2.resize(mask.astype(np.uint8), shape[1::-1], interpolation=cv2.INTER_NEAREST) > 0
