"""What cameras see of a horizontal plane: each place of it in all of their pictures, and what they agree on."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, UInt8

from sogjax.model.camera import Camera, distort
from sogjax.scene.visual_hull import resized

FEWEST_SEEING = 3
"""Cameras beside one that must have a place in their pictures: something may hide it from one of them."""

Picture = UInt8[np.ndarray, "_h _w 3"]


@dataclass(frozen=True)
class PlaneView:
    """A small picture without the lens's distortion, and how it looks at horizontal planes."""

    picture: Float[np.ndarray, "rows columns 3"]
    """BGR; not a number where the lens shows nothing."""
    intrinsics: Float[np.ndarray, "3 3"]
    rotation: Float[np.ndarray, "3 3"]
    """From two directions along planes, and up, to the camera's directions."""
    translation: Float[np.ndarray, "3"]
    """The world's origin, in the camera's frame."""

    @classmethod
    def of(cls, picture: Picture, camera: Camera, axes: Float[np.ndarray, "3 3"]) -> "PlaneView":
        """The view of a camera; the columns of `axes` are two directions along planes, and up."""
        rows, columns = picture.shape[:2]
        lens, pose = resized(camera, (columns, rows)), np.asarray(camera.camera_from_world, float)
        places = np.asarray(distort(lens, jnp.asarray(pixel_grid(rows, columns).reshape(-1, 2))))
        straight = sampled(picture.astype(np.float32), places.reshape(rows, columns, 2))
        return cls(straight, np.asarray(lens.intrinsics, float), pose[:3, :3] @ axes, pose[:3, 3])

    @property
    def place(self) -> Float[np.ndarray, "2"]:
        """Where the camera stands, along planes."""
        return -(self.rotation.T @ self.translation)[:2]

    def pixels_from_plane(self, height: float) -> Float[np.ndarray, "3 3"]:
        """From places on the plane at this height (metres, and 1) to pixels, times their depth."""
        along, up = self.rotation[:, :2], self.rotation[:, 2]
        return self.intrinsics @ np.column_stack([along, height * up + self.translation])

    def on_plane(self, pixels: Float[np.ndarray, "*n 2"], height: float) -> Float[np.ndarray, "*n 3"]:
        """The places (metres, and 1) that pixels show on the plane; not numbers above the horizon."""
        straight = np.linalg.inv(self.pixels_from_plane(height))
        places = pixels @ straight[:, :2].T + straight[:, 2]
        return places / np.where(places[..., 2:] > 1e-6, places[..., 2:], np.nan)

    def colors(self, places: Float[np.ndarray, "*n 3"], height: float) -> Float[np.ndarray, "*n 3"]:
        """The colours of places on the plane, not numbers where they are not seen."""
        seen = places @ self.pixels_from_plane(height).T
        pixels = seen[..., :2] / np.where(seen[..., 2:] > 0, seen[..., 2:], np.nan)
        return sampled(self.picture, pixels) if pixels.ndim > 2 else sampled(self.picture, pixels[None])[0]


def pixel_grid(rows: int, columns: int) -> Float[np.ndarray, "rows columns 2"]:
    """Columns and rows of the pixels of a picture."""
    return np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).astype(np.float32)


def sampled(picture: Float[np.ndarray, "_h _w channel"], places: Float[np.ndarray, "_rows _columns 2"]) -> np.ndarray:
    """A picture at places (columns, rows) between its pixels; not a number outside of it."""
    outside = (np.nan,) * 3
    if not places.size:
        return np.zeros((*places.shape[:-1], picture.shape[-1]), np.float32)
    where = np.nan_to_num(places, nan=-2.0).clip(-2.0, 1e5).astype(np.float32)
    return cv2.remap(picture, where, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=outside)  # pyright: ignore[reportCallIssue, reportArgumentType]


def _middle(values: Float[np.ndarray, "camera *n"]) -> Float[np.ndarray, "*n"]:
    """The median over cameras, without those that are not numbers."""
    count = np.isfinite(values).sum(axis=0)
    ordered = np.sort(values, axis=0)
    return np.take_along_axis(ordered, np.maximum(count - 1, 0)[None] // 2, axis=0)[0]


class Others(NamedTuple):
    """What other cameras show at some places."""

    colors: Float[np.ndarray, "*n 3"]
    spread: Float[np.ndarray, "*n"]
    """Standard deviation over the cameras, by its median, in the channel where it is largest."""
    enough: Bool[np.ndarray, "*n"]
    """Whether enough of them see the place."""


def from_others(
    camera: int,
    seen: Mapping[int, PlaneView],
    lights: Mapping[int, Float[np.ndarray, "3"]],
    places: Float[np.ndarray, "*n 3"],
    height: float,
) -> Others:
    """What all but one of some cameras show at places of the plane at a height, each in its light, as far as known."""
    shown = np.stack([one.colors(places, height) / lights[k] for k, one in seen.items() if k != camera])
    middle = _middle(shown)
    spread = 1.48 * _middle(np.abs(shown - middle)).max(axis=-1)
    return Others(middle, spread, np.isfinite(shown[..., 0]).sum(axis=0) >= FEWEST_SEEING)
